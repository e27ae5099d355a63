"""`<Rob>` and `<Sen>`: tolerant of what differs between controllers, of nothing else."""

import contextlib
import re

import pytest
from hypothesis import given, settings, strategies as st

from elastocal.drivers.kuka_rsi.messages import (
    MoveTarget,
    Order,
    RobMessage,
    SenMessage,
    is_overture,
    read_rob,
    write_sen,
)
from elastocal.errors import DeviceError

EXAMPLE = b"""<Rob Type="KUKA">
<RIst X="1620.9999" Y="0.0000" Z="1909.9998" A="0.0" B="90.0" C="0.0"/>
<RSol X="1620.5" Y="0" Z="1909.5" A="0" B="90" C="0"/>
<AIPos A1="0.0" A2="-90.0" A3="90.0" A4="0.0" A5="90.0" A6="0.0"/><Delay D="2"/>
<Tech C11="0.0" C110="0.0"/><DiL>0</DiL><Digout o1="0" o2="0" o3="0"/><Krl N="3" State="2"/>
<IPOC>4208163634</IPOC></Rob>"""
SDK = (
    b'<Rob Type="KUKA"><RIst X="0.00000" Y="0" Z="0" A="0" B="0" C="0"/>'
    b'<AIPos A1="5.32000" A2="0" A3="0" A4="0" A5="0" A6="0"/><EIPos E1="1.5" E2="0"/>'
    b'<Delay D="15"/><IPOC>357</IPOC></Rob>'
)


def test_the_example_of_the_old_driver_is_read():
    found = read_rob(EXAMPLE)
    assert found.ipoc == 4208163634
    assert found.actual == (1620.9999, 0.0, 1909.9998, 0.0, 90.0, 0.0)
    assert found.setpoint[0] == 1620.5
    assert found.axes == (0.0, -90.0, 90.0, 0.0, 90.0, 0.0)
    assert (found.delay, found.command, found.state) == (2, 3, 2)
    assert found.external is None


def test_what_is_not_sent_is_none_and_external_axes_are_as_many_as_come():
    found = read_rob(SDK)
    assert found.external == (1.5, 0.0)
    assert (found.setpoint, found.state, found.delay) == (None, None, 15)
    assert read_rob(b"<Rob><IPOC>7</IPOC></Rob>") == RobMessage(7)


def test_capitals_do_not_matter_and_unknown_tags_pass():
    text = (
        EXAMPLE.replace(b"Type", b"TYPE").replace(b"RIst X", b"rist x").replace(b"AIPos", b"AIPOS")
    )
    assert read_rob(text.replace(b"<DiL>", b"<Foo Bar='1'><Baz/></Foo><DiL>")) == read_rob(EXAMPLE)


@pytest.mark.parametrize(
    ("datagram", "reason"),
    [
        (b"", "no XML"),
        (b"<Rob><IPOC>1</IPOC>", "no XML"),
        (b"<Sen><IPOC>1</IPOC></Sen>", "expected <Rob>"),
        (b"<Rob></Rob>", "IPOC is '', must be a whole number"),
        (b"<Rob><IPOC>-4</IPOC></Rob>", "must be a whole number"),
        (b"<Rob><IPOC>4.0</IPOC></Rob>", "must be a whole number"),
        (b"<Rob><IPOC>" + b"9" * 21 + b"</IPOC></Rob>", "must be a whole number"),
        (b"<Rob><IPOC>1</IPOC><IPOC>2</IPOC></Rob>", "<IPOC> twice"),
        (EXAMPLE.replace(b'Y="0.0000"', b'Y="nan"'), "RIst.Y is 'nan', no number"),
        (EXAMPLE.replace(b'Y="0.0000"', b'Y="1_0"'), "RIst.Y is '1_0', no number"),
        (EXAMPLE.replace(b'Y="0.0000"', b'Y="0,5"'), "RIst.Y is '0,5', no number"),
        (EXAMPLE.replace(b'Y="0.0000"', b'Y="1e9"'), "no number in range"),
        (EXAMPLE.replace(b' A5="90.0"', b""), "AIPos has no A5"),
        (EXAMPLE.replace(b"<DiL>", b'<RIst X="1"/><DiL>'), "<RIst> twice"),
        (
            b'<!DOCTYPE Rob [<!ENTITY a "1">]><Rob><IPOC>&a;</IPOC></Rob>',
            "document type or entities",
        ),
        (b'<!DOCTYPE Rob SYSTEM "file:///etc/passwd"><Rob/>', "document type or entities"),
        (b"<Rob><IPOC>1</IPOC>" + b" " * 65_536 + b"</Rob>", "at most 65536 are read"),
    ],
)
def test_what_is_no_message_is_refused_with_why(datagram, reason):
    with pytest.raises(DeviceError, match=re.escape(reason)) as caught:
        read_rob(datagram)
    assert "\n" not in str(caught.value)


@given(st.binary(max_size=400))
@settings(max_examples=300, deadline=None)
def test_noise_is_read_or_refused_and_nothing_else(noise):
    with contextlib.suppress(DeviceError):
        read_rob(noise)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=300, deadline=None)
def test_damaged_messages_are_read_or_refused_and_nothing_else(data):
    text = bytearray(EXAMPLE)
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place : place + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    try:
        found = read_rob(bytes(text))
    except DeviceError:
        return
    numbers = [*(found.actual or ()), *(found.axes or ())]
    assert all(abs(number) <= 1e7 for number in numbers)


def test_rsi_2_begins_with_an_empty_message():
    assert is_overture(b'<Rob Type="KUKA"></Rob>')
    assert not is_overture(EXAMPLE)
    assert not is_overture(b"<Rob><IPOC>1</IPOC></Rob>")


def test_an_answer_echoes_ipoc_and_has_six_decimals_and_never_minus_zero():
    sent = write_sen(
        SenMessage((-1e-9, 0.25, 1.0, 0.0, 0.0, 0.0), Order.GUIDE, sentype="PC"), 4208163634
    ).decode()
    assert sent == (
        '<Sen Type="PC"><Stop>0</Stop><RKorr X="0.000000" Y="0.250000" Z="1.000000" A="0.000000"'
        ' B="0.000000" C="0.000000"/><IPOC>4208163634</IPOC></Sen>'
    )


def test_the_stop_channel_is_set_unless_corrections_are_wanted():
    for order in Order:
        sent = write_sen(SenMessage(order=order, target=MoveTarget(7, percent=12.5)), 1).decode()
        assert f"<Stop>{int(order is not Order.GUIDE)}</Stop>" in sent
        assert f'<Cmd N="7" Op="{int(order)}" V="12.500"/>' in sent
        assert '<Ex E1="0.000000"' in sent
