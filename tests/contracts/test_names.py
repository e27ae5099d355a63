"""One set of rules for names: what a dataset cannot hold is refused before an arm moves."""

import os
import re
from pathlib import Path

import pytest

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import DatasetError, SchemaError
from elastocal.robot import catalogue
from support.cells import Cell, linear_truth
from support.cli import elastocal
from support.run_cells import planned_cell

REFUSED = [
    "joint[1]", "joint 'a\"", "shoulder,pan", "arm#1", "a;b", "force_x", "pose", "tcp_positon_x",
    "reference_joint_a2", "link_joint_a2",
]  # fmt: skip
LONG = "robot_1/left_manipulator_shoulder_pan_continuous_joint_of_the_second_cell_in_hall_seven"


def _with_joint(folder: Path, name: str) -> Path:
    """Write the example cell with a robot whose joint_a1 has another name."""
    cell = write_example(folder, "afp")[0]
    urdf = catalogue.urdf("KR 120 R2700 extra HA")
    escaped = name.replace("&", "&amp;").replace('"', "&quot;")
    assert urdf.count('"joint_a1"') == 1
    (folder / "arm.urdf").write_text(urdf.replace('"joint_a1"', f'"{escaped}"'))
    text = re.sub(r"model: KR 120[^#\n]*", "urdf: arm.urdf ", cell.read_text(encoding="utf-8"))
    cell.write_text(text.replace("joint_a1", "'" + name.replace("'", "''") + "'"), encoding="utf-8")
    return cell


@pytest.mark.parametrize("name", REFUSED)
class TestJointsThatNoDatasetHolds:
    def test_the_dataset_refuses_them(self, name):
        measured = Cell(linear_truth(), poses=6).measure()
        joints = [name, "joint_a2", *measured.joint_names[2:]]
        with pytest.raises(DatasetError, match="joint"):
            dataset.require_joint_names(joints)

    def test_so_do_the_urdf_and_every_command_that_measures(self, tmp_path, name):
        cell = _with_joint(tmp_path, name)
        refused = repr(name)
        commands = (
            ("check", tmp_path / "arm.urdf"),
            ("check", cell),
            ("plan", cell, "--out", tmp_path / "plan"),
            ("run", cell, "--plan", tmp_path / "plan", "--out", tmp_path / "run"),
            ("study", cell, "--out", tmp_path / "study"),
        )
        for words in commands:
            assert refused in elastocal(*words).reason, words
        assert {each.name for each in tmp_path.iterdir() if each.is_dir()} == set()


def test_long_names_as_ros_gives_them_stay_usable(tmp_path):
    assert load_cell(_with_joint(tmp_path, LONG)).robot.joint_names[1] == LONG
    measured = Cell(linear_truth(), poses=6).measure()
    names = [f"{LONG}_{index}" for index in range(len(measured.joint_names))]
    data = dataset.Dataset.from_arrays(
        joint_names=names,
        load_cases=measured.load_cases,
        joint_units=measured.joint_units,
        **measured.arrays,
    )
    for file in ("a.nc", "a.csv"):
        dataset.write(data, tmp_path / file)
        assert list(dataset.read(tmp_path / file).joint_names) == names


@pytest.mark.parametrize("key", ["name", "trackers.0.name"])
@pytest.mark.parametrize("name", [r'"a\u001b[2J"', r'"a\nb"', '" a"', '"a\u202e"'])
def test_a_cell_has_names_that_can_be_shown(tmp_path, key, name):
    cell = write_example(tmp_path, "afp")[0]
    text, place = cell.read_text(encoding="utf-8"), key.rpartition(".")[0]
    pattern = r"(?m)^name: .*$" if not place else r"(?<=trackers:\n  - name: ).+"
    text, count = re.subn(pattern, lambda _: f"name: {name}" if not place else name, text)
    assert count == 1
    cell.write_text(text, encoding="utf-8")
    with pytest.raises(SchemaError, match=rf"{key}.* must be a printable name"):
        load_cell(cell)


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    return planned_cell(tmp_path_factory.mktemp("planned"), poses=4)


class TestTheRehearsalOfARun:
    def test_a_result_that_could_not_be_written_is_refused_before_anything_moves(
        self, planned, tmp_path
    ):
        # The dataset states the run's folder, and NetCDF holds UTF-8 alone.
        out = tmp_path / os.fsdecode(b"run\xff")
        for more in ([], ["--dry-run"]):
            words = ("run", planned.cell, "--plan", planned.plan, "--out", out, *more)
            assert "provenance" in elastocal(*words).reason
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.slow
    def test_its_dataset_has_the_shape_of_that_of_a_run(self, planned, tmp_path, monkeypatch):
        from elastocal.procedure.derive import rehearsal

        images = []
        monkeypatch.setattr(rehearsal, "netcdf_image", images.append)
        out = tmp_path / "run"
        assert elastocal("run", planned.cell, "--plan", planned.plan, "--out", out).code == 0
        measured = dataset.read(out / "dataset.nc").to_labelled()
        (rehearsed,) = images
        assert {n: (v.dims, v.values.shape) for n, v in rehearsed.variables.items()} == {
            n: (v.dims, v.values.shape) for n, v in measured.variables.items()
        }
        differing = dict(rehearsed.attributes.items() ^ measured.attributes.items())
        # The marker is by the cell file, and as it was found; the hashes come with the streams.
        assert set(differing) == {"marker", "made_from"}
