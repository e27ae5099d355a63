"""Edits of a cell file: what is not edited keeps every letter."""

import difflib

import pytest
import yaml

from elastocal.errors import SchemaError
from elastocal.studio.cell_edit import appended, with_value, without

TEXT = """# A cell.
schema: elastocal.cell/1   # first
trackers:                  # two of them
  - name: one              # the near one
    position: ["2 m", "0 m", "1 m"]   # in base
  - {name: two, position: ["3 m", "0 m", "1 m"]}

load_cases:
  fz: "1100 N"             # presses
  cases: [normal, north]   # two

# home comes last
home: {a1: "0 deg", a2: "-90 deg"}
"""


def changed(text):
    """Return the lines that are gone and those that are new."""
    lines = list(difflib.ndiff(TEXT.splitlines(), text.splitlines()))
    return [x[2:] for x in lines if x[0] == "-"], [x[2:] for x in lines if x[0] == "+"]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("place", "value", "line"),
    [
        (("load_cases", "fz"), "900 N", '  fz: "900 N"             # presses'),
        (("load_cases", "cases"), ["normal"], '  cases: ["normal"]   # two'),
        (("home", "a2"), "1 deg", 'home: {a1: "0 deg", a2: "1 deg"}'),
        (("home", "a3"), "1 deg", 'home: {a1: "0 deg", a2: "-90 deg", a3: "1 deg"}'),
        (("trackers", 0, "name"), "new", '  - name: "new"              # the near one'),
        (("load_cases", "level"), 0.45, "  level: 0.45"),
        (("surface", "region"), {"x": ["1 m"]}, 'surface: {region: {x: ["1 m"]}}'),
    ],
)
def test_one_line_changes_and_says_what_was_asked_for(place, value, line, end):
    text = with_value(TEXT.replace("\n", end), place, value)
    assert text.count(end) == text.count("\n")
    text = text.replace(end, "\n")
    gone, new = changed(text)
    assert new == [line]
    assert len(gone) <= 1
    found = yaml.safe_load(text)
    for key in place:
        found = found[key]
    assert found == value


def test_a_block_becomes_a_line():
    text = with_value(TEXT, ("trackers",), [])
    assert yaml.safe_load(text)["trackers"] == []
    assert "trackers: []" in text
    assert "# home comes last" in text


def test_items_come_and_go_with_their_lines():
    text = appended(TEXT, ("trackers",), {"name": "three"})
    assert changed(text) == ([], ['  - {name: "three"}'])
    assert [each["name"] for each in yaml.safe_load(text)["trackers"]] == ["one", "two", "three"]
    gone, new = changed(without(TEXT, ("trackers", 0)))
    assert new == []
    assert gone == TEXT.splitlines()[3:5]
    assert changed(without(TEXT, ("trackers", 1))) == ([TEXT.splitlines()[5]], [])
    assert without(TEXT, ("surface", "region")) == TEXT
    made = appended(TEXT, ("fixtures",), "a")
    assert yaml.safe_load(made)["fixtures"] == ["a"]
    assert yaml.safe_load(appended(made, ("fixtures",), "b"))["fixtures"] == ["a", "b"]


def test_an_end_without_a_line_end_is_no_trap():
    assert yaml.safe_load(with_value("a: 1", ("b",), 2.0)) == {"a": 1, "b": 2}


@pytest.mark.parametrize(
    ("text", "reason"), [("a: [", "line 1"), ("- 1", "keys and values"), ("", "keys and values")]
)
def test_a_text_that_is_no_cell_is_refused(text, reason):
    with pytest.raises(SchemaError, match=reason):
        with_value(text, ("a",), "b")


def test_what_has_no_place_is_refused():
    with pytest.raises(SchemaError, match="no place for 'b'"):
        with_value(TEXT, ("schema", "b"), "c")
    with pytest.raises(SchemaError, match="written on one line"):
        without(TEXT, ("home", "a1"))
    with pytest.raises(SchemaError, match="is no number"):
        with_value(TEXT, ("home", "a1"), float("nan"))
