"""Findings are data: files keep kind and values, and nothing hangs on the words."""

import copy
import importlib
import json
import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import elastocal
from elastocal.errors import SchemaError
from elastocal.findings import KINDS, Finding, Grade, Kind, as_number, group_alike
from elastocal.records import from_data, read_json, record, schema_of, write_json
from elastocal.results import Result

SOURCE = Path(elastocal.__file__).parent
BUMPED = Kind(
    "test.bumped",
    "stand {stand} moved by {by} mm",
    advice="Fix stand {stand}.",
    shown={"by": as_number(".2f", 1e3)},
)
WITHIN = Kind("test.within", "run: {warning}", grade=None)


@record("elastocal.test-warned/2", sealed=True, reads=("elastocal.test-warned/1",))
class Warned(Result):
    """A record with findings."""

    warnings: tuple[Finding, ...]


def of_the_program() -> list[Kind]:
    """Return the kinds of findings of all features."""
    for path in SOURCE.rglob("*.py"):
        if " = Kind(\n" in path.read_text(encoding="utf-8"):
            module = path.relative_to(SOURCE.parent).with_suffix("").parts
            importlib.import_module(".".join(module))
    return [each for each in KINDS.values() if not each.name.startswith(("test.", "doc."))]


def test_a_file_keeps_kind_values_and_text(tmp_path):
    found = WITHIN(warning=BUMPED(stand="north", by=np.float64(0.0125)))
    write_json(tmp_path / "warned.json", Warned((found,)))
    (stored,) = json.loads((tmp_path / "warned.json").read_text())["warnings"]
    inner = {
        "kind": "test.bumped",
        "values": {"stand": "north", "by": 0.0125},
        "text": "stand north moved by 12.50 mm",
    }
    assert stored == {
        "kind": "test.within",
        "values": {"warning": inner},
        "text": "run: stand north moved by 12.50 mm",
    }
    (read,) = read_json(tmp_path / "warned.json", Warned).warnings
    assert (read.kind, read, read.advice) == (found.kind, found, "Fix stand north.")
    assert read.stored() == stored


def test_an_older_file_with_sentences_is_read_and_written_as_it_was():
    data = {"schema": "elastocal.test-warned/1", "warnings": ["stand north moved by 12.50 mm"]}
    (read,) = from_data(Warned, data, "warned.json").warnings
    assert (read.kind, read.advice, read.grade) == ("", "", Grade.WARNING)
    assert read.stored() == "stand north moved by 12.50 mm"


@pytest.mark.parametrize(
    "wrong", [3, None, {"kind": "a"}, {"kind": "a", "values": [], "text": "b"}, ["a"]]
)
def test_what_is_no_finding_is_refused_with_its_place(wrong):
    data = {"schema": schema_of(Warned), "warnings": [wrong]}
    with pytest.raises(SchemaError, match=r"^f: warnings\.0: must be a text, or a finding"):
        from_data(Warned, data, "f")


@pytest.mark.parametrize("kind", ["test.of-a-later-version", "test.bumped"])
def test_a_kind_or_values_of_a_later_version_stay_their_text(kind):
    stored = {"kind": kind, "values": {"other": 1}, "text": "said by a later version"}
    read = Finding.read(stored)
    assert read == "said by a later version"
    assert read.advice == ""


def test_a_number_that_is_not_known_is_none_in_a_file():
    odd = Kind("test.odd", "off by {by} mm", shown={"by": as_number(".1f", 1e3)})
    stored = odd(by=float("nan")).stored()
    assert (stored["values"], stored["text"]) == ({"by": None}, "off by nan mm")
    assert Finding.read(stored) == "off by nan mm"


@pytest.mark.parametrize("again", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_is_the_same_finding(again):
    found = WITHIN(warning=BUMPED(stand="north", by=0.01))
    assert again(found).stored() == found.stored()
    assert again(found).advice == "Fix stand north."


def test_many_of_one_kind_are_grouped_whatever_they_say():
    found = [WITHIN(warning=BUMPED(stand=name, by=0.01)) for name in ("a", "b", "c", "d")]
    (shown,) = group_alike(found)
    assert shown == "run: stand a moved by 10.00 mm (and 3 more of this kind)"
    assert shown.advice == "Fix stand a."
    other = WITHIN(warning=Kind("test.other", "stand {stand} is there")(stand="e"))
    assert group_alike([*found[:3], other]) == [*found[:3], other]


def test_two_kinds_of_one_name_are_refused():
    with pytest.raises(ValueError, match=r"two kinds of finding are named 'test\.bumped'"):
        replace(BUMPED, template="other words")


def sample(kind: Kind) -> dict[str, object]:
    """Return values that a kind can show."""
    texts = kind.template + (kind.advice if isinstance(kind.advice, str) else "")
    values: dict[str, object] = dict.fromkeys(re.findall(r"{(\w+)}", texts), "a name")
    for name, show in kind.shown.items():
        values[name] = next(value for value in (1, [1, 2], ["a", "b"]) if _can_show(show, value))
    return values | ({} if isinstance(kind.advice, str) else {"committed": [1]})


def _can_show(show, value) -> bool:
    try:
        return bool(show(value))
    except TypeError:
        return False


def test_no_advice_and_no_light_hangs_on_the_words(monkeypatch):
    kinds = of_the_program()
    assert len(kinds) > 70
    made = [kind(**sample(kind)) for kind in kinds]
    for kind in kinds:
        monkeypatch.setitem(kind.__dict__, "template", "said in other words")
    for kind, before in zip(kinds, made, strict=True):
        again = kind(**sample(kind))
        assert again == "said in other words"
        assert (again.advice, again.grade) == (before.advice, before.grade)
        read = Finding.read({**before.stored(), "text": "said in a file"})
        assert (read.advice, read.grade) == (before.advice, before.grade)


def test_an_advice_that_lacks_a_value_is_left_out_with_its_kind():
    kind = Kind("test.advised-by-value", "it moved", advice="Look at {what}.")
    assert Finding.read({"kind": kind.name, "values": {"by": 1}, "text": "it moved"}).advice == ""
