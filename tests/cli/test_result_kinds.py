"""`elastocal check` of what codec and study leave behind; damaged ones are refused by name."""

import json
import re

import pytest

from elastocal.codec.study import StudyStore, run_study, study_summary, write_study
from elastocal.codec.study.sampling import ONE_AFTER_THE_OTHER
from elastocal.errors import SchemaError
from elastocal.records import write_json
from elastocal.workflows.check import _UNITS, describe_file
from elastocal.workflows.simulate import Ports
from support import reported
from support.cli import elastocal
from support.studies import settings, simulate


@pytest.fixture
def study(tmp_path):
    folder = tmp_path / "study"
    found = run_study(StudyStore(folder), settings(), 3, simulate, ONE_AFTER_THE_OTHER)
    write_study(folder, settings(), found, study_summary(settings(), found, 5e-5))
    return folder


def test_every_file_of_a_study_is_known_and_says_what_it_holds(study):
    kind, facts = describe_file(study)
    assert (kind, facts["samples"], facts["conditions"]) == ("study", 3, ["poses 5", "poses 10"])
    kind, facts = describe_file(study / "study.json")
    assert (kind, facts["samples"]) == ("record of a study", 3)
    assert list(facts["median_error_m"]) == ["poses 5", "poses 10"]
    assert describe_file(study / "settings.json")[1]["schema"] == "elastocal.study_settings/1"
    assert describe_file(study / "samples" / "000002-000002.json")[1]["samples"] == [2]
    assert describe_file(study / "study.csv")[1]["rows"] == 6
    assert describe_file(study / "compliance.csv")[0] == "table of a study"


def test_an_edited_part_is_refused_in_its_folder_and_by_itself(study):
    part = study / "samples" / "000000-000000.json"
    contents = json.loads(part.read_text())
    contents["samples"][0]["number"] = 7
    part.write_text(json.dumps(contents))
    for path in (study, part):
        with pytest.raises(SchemaError, match=r"000000-000000\.json was edited"):
            describe_file(path)


def test_a_row_that_lacks_a_cell_is_refused_by_its_line(study):
    table = study / "study.csv"
    lines = table.read_text().splitlines()
    lines[2] = lines[2].rpartition(",")[0]
    table.write_text("\n".join(lines))
    with pytest.raises(SchemaError, match=r"study\.csv, line 3: 10 cells, not 11"):
        describe_file(table)


def test_a_contact_file_is_known_with_its_schema_and_without(tmp_path):
    path = tmp_path / "contact.yaml"
    for schema in ("", "schema: elastocal.contact/1\n"):
        path.write_text(f'{schema}contact: {{normal: "50 N/um"}}\n', encoding="utf-8")
        kind, facts = describe_file(path)
        assert (kind, facts["normal"], facts["lateral"]) == ("contact file", 5e7, "free")
    for text, named in (
        ("contact: {}\nfoo: 1\n", "unknown key 'foo'"),
        ("contact:\n", "contact"),
        ("schema: elastocal.contact/9\ncontact: {}\n", "elastocal.contact/9"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(SchemaError, match=re.escape(named)):
            describe_file(path)


def test_the_ports_of_a_simulated_cell_are_known(tmp_path):
    write_json(tmp_path / "ports.json", Ports("127.0.0.1", {"net_ft": {"udp": 49152}}))
    kind, facts = describe_file(tmp_path / "ports.json")
    assert kind == "ports of simulated devices"
    assert facts["ports"] == {"net_ft": {"udp": 49152}}


def test_check_shows_numbers_with_their_units_and_no_more_digits_than_mean_something(study):
    done = reported.finished()
    for path in (study, study / "study.json", done / "plan", done / "process", done / "tool.json"):
        shown = elastocal("check", path)
        assert shown.code == 0
        assert not re.search(r"\.0*[1-9]\d{4}|[\[\]{}']", shown.err), shown.err
    assert re.search(r"covering radius: [\d.]+ mm$", elastocal("check", done / "plan").err, re.M)
    assert re.search(r"mass: [\d.]+ kg$", elastocal("check", done / "tool.json").err, re.M)


def test_every_number_that_is_no_count_has_a_unit(study):
    done = reported.finished()
    for path in (study / "study.json", done / "plan", done / "process", done / "tool.json"):
        holds = describe_file(path)[1]
        lengths = {name for name, value in holds.items() if isinstance(value, float)}
        assert lengths <= _UNITS.keys()
