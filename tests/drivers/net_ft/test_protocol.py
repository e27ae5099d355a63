"""Layouts of a Net F/T box, read from bytes that no line of ours has written."""

import random
import resource
import struct

import pytest
from hypothesis import given, settings, strategies as st

from elastocal.cell import SensorStatus
from elastocal.drivers.net_ft.protocol import (
    ASK_CALIBRATION,
    Command,
    parse_calibration,
    parse_configuration,
    parse_records,
    request,
    status_names,
    status_of,
)
from elastocal.errors import DeviceError

PAGE = """<?xml version="1.0"?><netft><prodname>Net F/T</prodname><cfgnam>Omega160</cfgnam>
<cfgcpf>{cpf}</cfgcpf><cfgcpt>{cpt}</cfgcpt><scfgfu>{fu}</scfgfu><scfgtu>{tu}</scfgtu>
{more}<comrdte>Enabled</comrdte><comrdtrate>1000</comrdtrate></netft>"""


def page(cpf="1000000", cpt="1000000", fu="N", tu="N-m", more="") -> bytes:
    return PAGE.format(cpf=cpf, cpt=cpt, fu=fu, tu=tu, more=more).encode()


def test_the_requests_are_those_of_the_manual():
    assert request(Command.START) == bytes.fromhex("1234000200000000")
    assert request(Command.START, 5) == bytes.fromhex("1234000200000005")
    assert request(Command.STOP) == bytes.fromhex("1234000000000000")
    assert bytes([1]) + bytes(19) == ASK_CALIBRATION


def test_a_record_is_read_big_endian_with_its_signs():
    text = "00000007 0000002a 80010000 ffffffff 00000002 fffffffd 00000004 fffffffb 00000006"
    (record,) = parse_records(bytes.fromhex(text))
    assert record == (7, 42, 0x80010000, (-1, 2, -3, 4, -5, 6))
    assert [each.rdt_sequence for each in parse_records(bytes.fromhex(text) * 3)] == [7, 7, 7]


@pytest.mark.parametrize(
    ("status", "meaning"),
    [
        (0, SensorStatus.OK),
        (0x80010000, SensorStatus.OK),
        (0x80020000, SensorStatus.SATURATED),
        (0x80030000, SensorStatus.SATURATED),
        (0x80004000, SensorStatus.FAULT),
        (0x80024000, SensorStatus.FAULT),
        (0x80000000, SensorStatus.FAULT),
        (1, SensorStatus.FAULT),
    ],
)
def test_a_status_is_ok_or_spoils_the_sample_or_the_sensor(status, meaning):
    assert status_of(status) is meaning


def test_a_status_is_told_by_name():
    assert status_names(0x80C04004) == (
        "0x80c04004: error, configuration does not fit calibration, network, watchdog, temperature"
    )
    assert status_names(1) == "0x00000001: a bit without a name"


@pytest.mark.parametrize(
    ("fu", "tu", "force", "moment"),
    [
        ("N", "N-m", 1e-6, 1e-6),
        ("N", "Nm", 1e-6, 1e-6),
        ("N", "N-mm", 1e-6, 1e-9),
        ("lb", "lb-in", 4.4482216152605e-6, 1.1298482902761668e-7),
        ("lbf", "lbf-ft", 4.4482216152605e-6, 1.3558179483314004e-6),
        ("klb", "kN-m", 4.4482216152605e-3, 1e-3),
        ("kg", "kg-cm", 9.80665e-6, 9.80665e-8),
        ("g", "kgf-cm", 9.80665e-9, 9.80665e-8),
    ],
)
def test_counts_are_read_in_the_units_of_the_page(fu, tu, force, moment):
    scale = parse_configuration(page(fu=fu, tu=tu)).scale
    assert scale.force == pytest.approx(force, rel=1e-12)
    assert scale.moment == pytest.approx(moment, rel=1e-12)


def test_page_and_calibration_say_the_same_in_other_words():
    reply = struct.pack(">HBBII6H", 0x1234, 2, 4, 100_000, 1000, *(1,) * 6)
    by_page = parse_configuration(page("100000", "1000", "N", "N-mm")).scale
    assert parse_calibration(reply).same(by_page)
    other = struct.pack(">HBBII6H", 0x1234, 2, 3, 100_000, 1000, *(1,) * 6)
    assert not parse_calibration(other).same(by_page)


def test_the_page_tells_tool_transform_bias_and_rate():
    found = parse_configuration(page(more="<cfgtfx>0;0;12.5;0;0;90</cfgtfx><setbias>0;3</setbias>"))
    assert found.transform == (0.0, 0.0, 12.5, 0.0, 0.0, 90.0)
    assert found.bias == (0.0, 3.0)
    assert found.rate == 1000.0
    assert found.rdt
    numbered = "".join(f"<cfgtfx{i}>{i}</cfgtfx{i}>" for i in range(6))
    assert parse_configuration(page(more=numbered)).transform == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b"hello", "no XML"),
        (b"<netft/>", "cfgcpf is None"),
        (page(cpf="many"), "cfgcpf is 'many': must be a number"),
        (page(cpf="0"), "counts per unit of force are 0.0"),
        (page(cpt="nan"), "counts per unit of torque are nan"),
        (page(fu="stone"), "unit of force is 'stone'"),
        (page(tu="N"), "unit of torque is 'N'"),
        (page(more="<cfgtfx>0;x</cfgtfx>"), "cfgtfx is .*must be numbers"),
        (b'<!DOCTYPE a [<!ENTITY b "c">]>' + page(), "document type"),
        (b"<a>" + b" " * 70_000 + b"</a>", "above 65536 bytes"),
    ],
)
def test_a_page_that_cannot_be_used_says_why(text, reason):
    with pytest.raises(DeviceError, match=reason):
        parse_configuration(text)


def read_or_refused(parse, data) -> bool:
    """Return whether data are read, or refused in a line of ours; anything else escapes."""
    try:
        found = parse(data)
    except DeviceError as error:
        return "\n" not in str(error)
    return bool(found)


@given(st.binary(max_size=300) | st.binary(min_size=24, max_size=24) | st.just(page()))
@settings(max_examples=300, deadline=None)
def test_whatever_comes_is_read_or_refused(data):
    for parse in (parse_records, parse_calibration, parse_configuration):
        assert read_or_refused(parse, data)


@given(st.text("<>/&;!-abcfgptuxDOCTYPE[]\"' 0123456789.\x00\ud800", max_size=200))
@settings(max_examples=300, deadline=None)
def test_whatever_stands_in_a_page_is_read_or_refused(text):
    assert read_or_refused(parse_configuration, page(more=text.encode("utf-8", "replace").decode()))


RECORD = struct.pack(">III6i", 1, 7, 0, *range(6))
CALIBRATION = struct.pack(">HBBII6H", 0x1234, 2, 3, 100_000, 1000, *(1,) * 6)
SEEDS = [(parse_records, RECORD)] * 5 + [(parse_calibration, CALIBRATION)] * 4
SEEDS += [(parse_configuration, page(more="<cfgtfx>0;0;0;0;0;0</cfgtfx>"))]


@pytest.mark.slow
def test_a_million_damaged_messages_are_read_or_refused_and_leave_nothing_behind():
    chance, before = random.Random(1), 0
    for number in range(1_000_000):
        parse, seed = SEEDS[number % len(SEEDS)]
        data = bytearray(seed[: chance.choice((len(seed), len(seed), chance.randrange(len(seed))))])
        for _ in range(chance.randrange(4) if data else 0):
            data[chance.randrange(len(data))] = chance.randrange(256)
        assert read_or_refused(parse, bytes(data)), bytes(data)
        if number == 50_000:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 10_000  # kB
