"""Files for the controller: what it needs, in its words; and the rule of HOLDON enforced."""

import re
from xml.etree import ElementTree

import pytest

from elastocal import workflows
from elastocal.drivers.kuka_rsi import SHEET, RsiSettings, bounds_of, controller_files
from elastocal.drivers.kuka_rsi.controller_files import LONGEST_NAME, PROGRAMS
from elastocal.drivers.kuka_rsi.ethernet_file import MODES, check_ethernet_file
from elastocal.errors import DeviceError, ElastocalError, FileAccessError
from elastocal.records import write_json
from elastocal.workflows.krc_config import _notes
from support.cli import elastocal
from support.kuka_bench import record, write_cell
from support.simulated import example_cell

WORDS = re.compile(
    r"(&ACCESS RVP|&REL 1|&PARAM [A-Z]+ = .*|DEF \w+\( \)|DEFDAT \w+|END|ENDDAT|;.*|"
    r"(GLOBAL )?INTERRUPT (DECL|ON|OFF) .*|BAS \(#\w+,\w+ \)|\$\w+(\[\d+\])? = .*|"
    r"EXT BAS \(BAS_COMMAND :IN,REAL :IN \)|DECL (INT|BOOL|REAL|E6AXIS) \w+=.*|"
    r"ret = RSI_(CREATE|ON|OFF|DELETE)\(.*\)|RSI_MOVECORR\(\)|HALT|PTP (XNEXT|\$AXIS_ACT_MEAS)|"
    r"IF .* THEN|ELSE|ENDIF|LOOP|ENDLOOP|SWITCH .*|CASE \d|DEFAULT|ENDSWITCH|EXIT|WAIT SEC [\d.]+|"
    r"BRAKE F|RESUME|elcal_\w+\( \)|(XNEXT\.\w\d|percent|wanted|done|braked) = .*)"
)
ENDS = ("xml", "rsi", "rsi.xml", "rsi.diagram", "src", "dat")
PAIRS = {"IF": "ENDIF", "LOOP": "ENDLOOP", "SWITCH": "ENDSWITCH", "DEF": "END", "DEFDAT": "ENDDAT"}


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    made = controller_files(example_cell("afp"), RsiSettings(mode="contact", delay="20 ms"))
    return {name: contents.decode("utf-8") for name, contents in made.items()}


def test_every_file_for_the_controller_has_a_short_name_ascii_and_its_line_ends(files):
    assert set(files) == {
        SHEET,
        *(f"{name}.{end}" for name in PROGRAMS.values() for end in ENDS),
    }
    for name, text in files.items():
        if name != SHEET:
            assert len(name) <= LONGEST_NAME
            assert text.isascii()
            assert "\n" not in text.replace("\r\n", "")


@pytest.mark.parametrize("name", PROGRAMS.values())
def test_programs_are_made_of_known_words_and_blocks_that_end(files, name):
    for suffix in ("src", "dat"):
        open_blocks = []
        for line in files[f"{name}.{suffix}"].splitlines():
            text = line.strip()
            if not text:
                continue
            assert WORDS.fullmatch(text), text
            first = text.split(maxsplit=1)[0]
            if first in PAIRS:
                open_blocks.append(PAIRS[first])
            elif first in PAIRS.values():
                assert open_blocks.pop() == first
        assert open_blocks == []
    declared = set(re.findall(r"DECL \w+ (\w+)=", files[f"{name}.dat"]))
    used = set(re.findall(r"^\s*(\w+)(?:\.\w+)? = ", files[f"{name}.src"], flags=re.MULTILINE))
    assert used <= declared


def test_every_call_of_rsi_is_looked_at_and_the_kind_of_correction_is_that_of_the_mode(files):
    for mode, kind in (("contact", "#RELATIVE"), ("compensation", "#ABSOLUTE")):
        lines = files[f"{PROGRAMS[mode]}.src"].splitlines()
        assert f"ret = RSI_ON({kind},#IPO_FAST)" in lines
        calls = [i for i, line in enumerate(lines) if line.startswith("ret = ")]
        assert len(calls) == 4
        assert all(lines[i + 1 : i + 3] == ["IF ret<>RSIOK THEN", "  HALT"] for i in calls)
    assert "POSCORR" not in files["elcal_meas.src"].replace("no POSCORR", "")


@pytest.mark.parametrize("mode", MODES)
def test_ethernet_files_hold_what_their_mode_needs(files, mode):
    text = files[f"{PROGRAMS[mode]}.xml"]
    check_ethernet_file(text, mode)
    root = ElementTree.fromstring(text)
    assert root.findtext("CONFIG/ONLYSEND") == ("TRUE" if mode == "measure" else "FALSE")
    hold = {e.get("TAG"): e.get("HOLDON") for e in root.findall("RECEIVE/ELEMENTS/ELEMENT")}
    wanted = {"measure": None, "contact": "0", "compensation": "1"}[mode]
    assert {hold.get(f"RKorr.{axis}") for axis in "XYZABC"} == {wanted}
    numbers = [e.get("INDX") for e in root.findall("RECEIVE/ELEMENTS/ELEMENT")]
    assert numbers == [str(number) for number in range(1, len(numbers) + 1)]


@pytest.mark.parametrize(
    ("mode", "old", "new", "reason"),
    [
        ("contact", 'HOLDON="0"', 'HOLDON="1"', "RKorr.X: relative corrections need HOLDON 0"),
        ("compensation", 'HOLDON="1"', 'HOLDON="0"', "RKorr.X: absolute corrections need HOLDON 1"),
        ("contact", 'HOLDON="0"', 'HOLDON="2"', "must be 0 or 1"),
        ("contact", 'HOLDON="0"', "", "an ELEMENT has no HOLDON"),
        ("contact", "DEF_RSol", "DEF_ESPos", "SEND has no element DEF_RSol"),
        ("contact", "Krl.State", "Site.State", "SEND has no element Krl.State"),
        ("contact", 'TAG="Stop"', 'TAG="Halt"', "RECEIVE has no element Stop"),
        ("contact", "FALSE", "TRUE", "MODE CONTACT NEEDS FALSE"),
        ("measure", "TRUE", "FALSE", "MODE MEASURE NEEDS TRUE"),
        ("contact", "<ROOT>", "<!DOCTYPE a><ROOT>", "document type"),
        ("contact", "ROOT>", "TOOR>", "must be <ROOT>"),
        ("contact", "</ROOT>", "", "no XML"),
    ],
)
def test_files_that_a_site_has_changed_are_checked(files, mode, old, new, reason):
    text = files[f"{PROGRAMS[mode]}.xml"].replace(old, new)
    with pytest.raises(DeviceError, match=re.escape(reason)):
        check_ethernet_file(text, mode)


def test_the_sheet_shows_every_limit_and_where_the_delay_is_from(files):
    sheet = files[SHEET]
    bounds = bounds_of(example_cell("afp"), RsiSettings(mode="contact"))
    for length in (bounds.correction, bounds.poscorr, bounds.monitor, bounds.travel):
        assert f"{1e3 * length:.1f} mm" in sheet
    assert "20.0 ms (as the cell file says)" in sheet
    assert "phase margin of 75.7 deg" in sheet
    assert "RefCorrSys **Base**" in sheet
    for text in files:
        assert text == SHEET or f"`{text}`" in sheet
    assert "Signed for the cell" in sheet


def test_external_axes_are_sent_where_there_are_any():
    with_rail = controller_files(example_cell("afp"), RsiSettings())
    without = controller_files(example_cell("machining"), RsiSettings())
    assert b"DEF_EIPos" in with_rail["elcal_run.xml"]
    assert b"DEF_EIPos" not in without["elcal_run.xml"]


def test_the_command_writes_all_of_it_and_checks_a_file_again(tmp_path):
    cell = write_cell(tmp_path, mode="contact")
    made = workflows.krc_config(cell, out=tmp_path / "krc")
    assert sorted(made.files) == sorted(each.name for each in (tmp_path / "krc").iterdir())
    assert made.mode == "contact"
    assert any("127.0.0.1: a controller cannot reach it" in note for note in made.notes)
    assert any("delay" in note for note in made.notes)
    checked = elastocal("krc-config", cell, "--check", tmp_path / "krc" / "elcal_run.xml", "--json")
    assert checked.code == 0
    refused = elastocal("krc-config", cell, "--check", tmp_path / "krc" / "elcal_comp.xml")
    assert "elcal_comp.xml: SEND has no element Krl.N" in refused.reason
    with pytest.raises(FileAccessError, match="force"):
        workflows.krc_config(cell, out=tmp_path / "krc")
    workflows.krc_config(cell, out=tmp_path / "krc", force=True)


def test_a_cell_without_a_kuka_is_refused(tmp_path):
    with pytest.raises(ElastocalError, match="the driver is 'simulated': must be 'kuka_rsi'"):
        workflows.krc_config(example_cell("afp").path, out=tmp_path / "krc")
    with pytest.raises(ElastocalError, match="either a folder to write into, or a file"):
        workflows.krc_config(write_cell(tmp_path))


def test_the_sheet_says_where_the_delay_comes_from(tmp_path):
    cell = example_cell("afp")
    write_json(cell.path.parent / "commissioning.json", record())
    for told, said in (
        ({"commissioning": "commissioning.json"}, "measured, commissioning.json"),
        ({"delay": "20 ms"}, "as the cell file says"),
        ({}, "ASSUMED: measure it"),
    ):
        sheet = controller_files(cell, RsiSettings(mode="contact", **told))[SHEET].decode("utf-8")
        assert said in sheet


def test_what_is_left_to_do_is_noted():
    sign, reached, measured = _notes(RsiSettings(mode="contact"))
    assert "sign SIGN-OFF.md line by line" in sign
    assert "a controller cannot reach it" in reached
    assert "elastocal measure-delay" in measured
    assert len(_notes(RsiSettings(mode="contact", address="192.168.10.5", delay="20 ms"))) == 1
