"""`elastocal check` on cells, plans and runs: it refuses what planning would refuse at once."""

import json

import pytest
import yaml

from elastocal.cell.examples import write_example
from elastocal.errors import SchemaError
from elastocal.planning import write_plan
from elastocal.workflows import describe_file
from support import plans
from support.cli import elastocal


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    write_example(folder, "machining")
    return folder


def check(folder, **changes):
    """Check the example with values put in, given by their path with two underscores a step."""
    data = yaml.safe_load((folder / "cell.yaml").read_text(encoding="utf-8"))
    for key, value in changes.items():
        *parents, last = key.split("__")
        inner = data
        for parent in parents:
            inner = inner[parent]
        inner[last] = value
    (folder / "changed.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    return elastocal("check", folder / "changed.yaml", "--json")


def test_an_example_passes_and_what_is_odd_is_said(folder):
    facts = json.loads(check(folder).out)
    assert (facts["kind"], facts["technique"], facts["findings"]) == ("cell file", "cover", [])
    facts = json.loads(check(folder, surface__flip_normals=True).out)
    assert "flip_normals" in facts["findings"][0]


def test_a_surface_that_cannot_be_read_is_refused(folder):
    (folder / "short.stl").write_bytes((folder / "block.stl").read_bytes()[:-9])
    assert "short.stl is cut short" in check(folder, surface__file="short.stl").reason


@pytest.mark.parametrize("key", ["fixtures", "tool__shapes"])
def test_a_mesh_of_fixture_or_tool_that_cannot_be_read_is_refused(folder, key):
    (folder / "letter.stl").write_text("Dear reader")
    shape = {"mesh": {"file": "letter.stl", "unit": "mm"}}
    assert "letter.stl is no STL" in check(folder, **{key: [shape]}).reason


def test_an_unknown_technique_is_refused_with_the_nearest(folder):
    assert "'Cover'; did you mean 'cover'?" in check(folder, search__technique="Cover").reason


def test_a_surface_in_the_wrong_place_and_a_home_in_the_table_are_refused(folder):
    far = check(folder, surface__pose={"xyz": ["500 m", "0 m", "0 m"]})
    assert "nearest point" in far.reason
    table = {"box": {"size": ["2 m", "2 m", "3 m"]}, "pose": {"xyz": ["1.5 m", "0 m", "1 m"]}}
    assert "HOME" in check(folder, fixtures=[table]).reason


def test_the_folder_of_a_plan_is_its_plan(tmp_path):
    write_plan(tmp_path, plans.plan())
    kind, facts = describe_file(tmp_path)
    assert (kind, facts["poses"]) == ("plan", 6)


def test_a_folder_of_something_else_is_refused(tmp_path):
    with pytest.raises(SchemaError, match=r"none of plan\.json, journal\.jsonl, table\.json"):
        describe_file(tmp_path)


def test_a_run_without_an_entry_is_refused(tmp_path):
    (tmp_path / "journal.jsonl").touch()
    with pytest.raises(SchemaError, match=r"journal\.jsonl is empty or cut off.* does not tell"):
        describe_file(tmp_path)
