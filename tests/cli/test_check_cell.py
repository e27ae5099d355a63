"""`elastocal check` on cells, plans and runs: it refuses what planning would refuse at once."""

import json
import re

import pytest
import yaml

from elastocal.cell.examples import write_example
from elastocal.errors import SchemaError
from elastocal.planning import write_plan
from elastocal.planning.surface import SurfaceError
from elastocal.robot import catalogue
from elastocal.workflows.check import describe_file
from support import plans
from support.by_day import some_by_day
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


def without_masses(folder):
    """Write the example's robot as a URDF whose links weigh nothing."""
    text = catalogue.urdf(yaml.safe_load((folder / "cell.yaml").read_text())["robot"]["model"])
    (folder / "light.urdf").write_text(re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.S))
    return {"robot": {"urdf": "light.urdf"}}


def process_of(folder, force):
    """Write a process of one row with a force."""
    joints = [f"joint_a{number}[deg]" for number in range(1, 7)]
    header = ",".join([*joints, *(f"force_{axis}[N]" for axis in "xyz")])
    (folder / "process.csv").write_text(f"{header}\n0,-90,90,0,45,0,{force}\n")
    return {"process": {"file": "process.csv"}}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (without_masses, "limits.torque: the torques of joint_a1, .* give its links masses in the"),
        (lambda folder: process_of(folder, "0,0,0"), "process.file: no row has a force"),
        (lambda _: {"load_cases__friction": 0.01}, "friction is .* N short of holding them"),
        (lambda _: {"sensor__force_range": ["10 N"] * 3}, "need .* times the sensor's range"),
        (
            lambda _: {"engagement__disk_radius": "1 m"},
            "no place of the surface takes the contact disk .*use a smaller disk or edge margin",
        ),
        (lambda _: {"search": {"pool": 10}}, "search.pool: must be at least the 31 poses"),
        (
            lambda _: {"surface__region": {"box": {"min": ["5 m"] * 3, "max": ["6 m"] * 3}}},
            "the region holds none",
        ),
    ],
)
def test_what_check_refuses_plan_refuses_in_the_same_words(folder, changes, words):
    reason = check(folder, **changes(folder)).reason
    assert re.search(words, reason), reason
    planned = elastocal("plan", folder / "changed.yaml", "--out", folder / "plan")
    assert planned.reason == reason


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    some_by_day(
        [
            lambda _: {"search__poses": 1, "search__technique": "random"},
            lambda _: {},
            # Limits of the URDF alone are not judged on an arm without masses.
            lambda folder: without_masses(folder) | {"limits__torque": {}},
            lambda _: {"sensor": None},
            lambda _: {"trackers": [], "marker": None},
            lambda _: {"load_cases__cases": ["normal"], "search__technique": "i_optimal"},
            lambda _: {"search__metric": "geodesic", "search__technique": "ioops"},
            lambda _: {"search__d_max": "200 mm", "search__poses": None},
        ],
        8,
    ),
)
def test_what_check_passes_plan_accepts(folder, changes):
    changes = {"search__pool": 60, "search__poses": 4} | changes(folder)
    assert check(folder, **changes).code == 0
    out = folder / "accepted"
    planned = elastocal(
        *("plan", folder / "changed.yaml", "--out", out, "--force", "--dry-run", "--jobs", 1),
        *("--compare", "none"),
    )
    assert planned.code == 0, planned.reason


def test_a_process_with_a_force_passes(folder):
    assert check(folder, **process_of(folder, "0,0,-10")).code == 0


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


def test_a_mesh_is_described_in_its_own_unit(folder):
    kind, holds = describe_file(folder / "block.stl")
    assert (kind, holds["extent"], holds["findings"]) == ("mesh", "600 x 400 x 300", [])
    assert "surface.unit" in holds["unit"]


def test_a_file_that_is_no_mesh_is_refused_by_name(tmp_path):
    (tmp_path / "mould.stl").write_text("solid\n")
    with pytest.raises(SurfaceError, match=r"mould\.stl has no faces"):
        describe_file(tmp_path / "mould.stl")
