"""Every trap of the shop floor that a dataset can show, met at the command line (spec section 6).

Each is refused in one line that names it, or survived; nothing half-written is left behind.
"""

import json
from functools import cache

import numpy as np
import pytest

from elastocal import dataset
from elastocal.dataset import Dataset
from elastocal.errors import DatasetError
from elastocal.robot import Robot
from elastocal.sim.arm import (
    Blunder,
)
from support.cells import Cell, linear_truth, robot, urdf
from support.cli import elastocal

POSES = 12


@cache
def good() -> Dataset:
    return Cell(linear_truth(), poses=POSES).measure()


def arrays(measured: Dataset | None = None) -> dict:
    data = measured or good()
    names = ("joint_position", "force", "controller_displacement", "marker_displacement")
    return {name: getattr(data, name).copy() for name in names}


def changed(**changes) -> Dataset:
    """Return the good dataset with arrays or labels replaced."""
    labels = {"joint_names": robot().joint_names, "load_cases": good().load_cases}
    attributes = {"robot_urdf": urdf(), "tcp_frame": "tcp"}
    return Dataset.from_arrays(**(arrays() | labels | attributes | changes))


def calibrate(tmp_path, data: Dataset, *options):
    path = tmp_path / "data.nc"
    dataset.write(data, path)
    out = tmp_path / "model.json"
    result = elastocal("calibrate", path, "--out", out, "--json", *options)
    if result.code:
        assert not list(tmp_path.glob("*model*")), "a refused calibration left a file"
    return result


def calibrate_text(tmp_path, text: str, *options):
    path = tmp_path / "data.csv"
    path.write_text(text)
    return elastocal("calibrate", path, "--out", tmp_path / "model.json", "--json", *options)


def as_csv(tmp_path) -> str:
    path = tmp_path / "good.csv"
    dataset.write(good(), path)
    return path.read_text()


def scaled(text: str, columns: tuple[str, ...], by: float) -> str:
    """Return a table whose numbers in some columns are in another unit than the header says."""
    comments = [line for line in text.splitlines() if line.startswith("#")]
    header, *rows = (line.split(",") for line in text.splitlines()[len(comments) :])
    chosen = [index for index, name in enumerate(header) if name.startswith(columns)]
    for row in rows:
        for index in chosen:
            row[index] = repr(float(row[index]) * by)
    return "\n".join([*comments, *(",".join(row) for row in (header, *rows))]) + "\n"


def turned(q: np.ndarray) -> np.ndarray:
    return q * [-1, 1, 1, -1, 1, -1]


def coupled(q: np.ndarray) -> np.ndarray:
    q = q.copy()
    q[..., 2] = -(q[..., 1] + q[..., 2])
    return q


def in_tcp_frame(force: np.ndarray) -> np.ndarray:
    R = robot().forward(arrays()["joint_position"])[..., :3, :3]
    return np.einsum("plji,plj->pli", R, force)


@pytest.mark.slow
def test_good_data_pass(tmp_path):
    result = calibrate(tmp_path, good())
    assert result.code == 0, result.err
    # The arm of these data has no masses, which is said.
    assert [text for text in json.loads(result.out)["warnings"] if "has a mass" not in text] == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(
            lambda: {"force": -arrays()["force"]},
            "sign turned",
            id="sign of the force",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            lambda: {"force": in_tcp_frame(arrays()["force"])},
            "tcp frame",
            id="force in tcp frame",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            lambda: {"force": in_tcp_frame(-arrays()["force"])},
            "tcp frame with their sign turned",
            id="sensor convention",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            lambda: {"joint_position": turned(arrays()["joint_position"])},
            "joints 1, 4 and 6",
            id="KUKA signs",
        ),
        pytest.param(
            lambda: {"joint_position": coupled(arrays()["joint_position"])},
            "-(q2 + q3)",
            id="FANUC coupled axis",
        ),
        pytest.param(
            lambda: {"joint_position": arrays()["joint_position"][..., ::-1]},
            "reverse order|outside the robot's",
            id="joint order",
        ),
        pytest.param(
            lambda: {"joint_position": np.repeat(arrays()["joint_position"][:1], POSES, axis=0)},
            "1 distinct joint configuration",
            id="all poses equal",
        ),
        pytest.param(
            lambda: {name: array[:1] for name, array in arrays().items()},
            "1 distinct joint configuration",
            id="one pose only",
        ),
    ],
)
def test_a_wrong_convention_is_refused_by_name(tmp_path, change, message):
    reason = calibrate(tmp_path, changed(**change())).reason
    assert any(part in reason for part in message.split("|")), reason


@pytest.mark.parametrize(
    ("columns", "by", "message"),
    [
        pytest.param(("joint_",), 180.0 / np.pi, "degrees", id="degrees in a radian column"),
        pytest.param(("controller_", "marker_displ"), 1e3, "mm", id="mm in a metre column"),
        pytest.param(("force_x", "force_y", "force_z"), 1e-3, "kN", id="kN in a newton column"),
    ],
)
def test_a_wrong_unit_is_refused_by_name(tmp_path, columns, by, message):
    assert message in calibrate_text(tmp_path, scaled(as_csv(tmp_path), columns, by)).reason


@pytest.mark.slow
def test_a_tool_weight_left_in_the_forces_is_named(tmp_path):
    result = calibrate(tmp_path, changed(force=arrays()["force"] + [0.0, 0.0, -600.0]))
    assert result.code == 0, result.err
    assert any("tool weight left in" in warning for warning in json.loads(result.out)["warnings"])


@pytest.mark.slow
def test_forces_zeroed_at_the_wrong_moment_are_named(tmp_path):
    forces = arrays()["force"]
    R = robot().forward(arrays()["joint_position"])[..., :3, :3]
    result = calibrate(tmp_path, changed(force=forces + R @ [200.0, -300.0, 0.0]))
    assert result.code == 0, result.err
    assert any("zeroed at the wrong" in warning for warning in json.loads(result.out)["warnings"])


@pytest.mark.slow
def test_a_blunder_of_500_mm_is_set_aside_and_named(tmp_path):
    cell = Cell(linear_truth(), poses=POSES, blunders=(Blunder(3, "west", (0.0, 0.5, 0.0)),))
    figures = json.loads(calibrate(tmp_path, cell.measure()).out)
    first = figures["suspicious"][0]
    assert (first["pose"], first["load_case"], first["set_aside"]) == (3, "west", True)
    assert figures["readings"] == 5 * POSES - 1
    assert figures["held_out"]["mean"] < 0.1 * figures["deflection"]["mean"]


@pytest.mark.slow
def test_readings_that_slipped_and_a_missing_load_case_are_left_out(tmp_path):
    status = np.zeros((POSES, 5), dtype=np.int8)
    status[2, 1], status[4:7, 3] = 1, 4
    values = arrays()
    values["marker_displacement"][2, 1] += 0.01
    for array in values.values():
        array[4:7, 3] = np.nan
    figures = json.loads(calibrate(tmp_path, changed(**values, status=status)).out)
    assert figures["readings"] == 5 * POSES - 4
    assert not figures["suspicious"]


@pytest.mark.slow
def test_a_pose_measured_under_two_labels_is_one_pose(tmp_path):
    values = {name: np.concatenate([array, array[:1]]) for name, array in arrays().items()}
    figures = json.loads(calibrate(tmp_path, changed(**values)).out)
    assert figures["poses"] == POSES
    assert "one configuration" in figures["warnings"][0]


def test_a_pose_that_stands_twice_in_a_csv_is_refused_by_row(tmp_path):
    text = as_csv(tmp_path)
    assert "stands twice" in calibrate_text(tmp_path, text + text.splitlines()[-1] + "\n").reason


def test_columns_in_another_order_give_the_same_model(tmp_path):
    """The joint order of the controller does not matter: columns have names."""
    lines = [line for line in as_csv(tmp_path).splitlines() if not line.startswith("#")]
    turned_round = "\n".join(",".join(line.split(",")[::-1]) for line in lines)
    arm = tmp_path / "arm.urdf"
    arm.write_text(urdf())
    options = ("--robot", arm, "--tcp", "tcp")
    found = [calibrate_text(tmp_path, text, *options) for text in ("\n".join(lines), turned_round)]
    assert found[0].out == found[1].out != ""


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        pytest.param(lambda _: "", "empty", id="empty file"),
        pytest.param(lambda text: text.replace("force_x[N]", "force_x"), "unit", id="no unit"),
        pytest.param(lambda text: text.replace("force_x[N]", "forse_x[N]"), "force_x", id="typo"),
        pytest.param(
            lambda text: text.replace("elastocal.dataset/1", "elastocal.dataset/9"),
            "elastocal.dataset/9",
            id="schema version",
        ),
        pytest.param(
            lambda text: text.replace(",joint_4[", ",axis_4["), "axis_4", id="joint names"
        ),
        pytest.param(
            lambda text: text.replace('tcp_frame: "tcp"', 'tcp_frame: "spindle"'),
            "no tip link 'spindle'",
            id="URDF without the tip",
        ),
    ],
)
def test_a_broken_table_is_refused_by_name(tmp_path, edit, message):
    text = as_csv(tmp_path)
    assert edit(text) != text
    assert message in calibrate_text(tmp_path, edit(text)).reason


def test_nan_in_a_reading_that_claims_to_be_ok_is_refused(tmp_path):
    values = arrays()
    values["force"][1, 2, 0] = np.nan
    with pytest.raises(DatasetError, match=r"force.*pose 1.*south"):
        changed(**values)


def test_a_load_case_without_any_reading_is_refused(tmp_path):
    values = arrays()
    for array in values.values():
        array[:, 4] = np.nan
    status = np.zeros((POSES, 5), dtype=np.int8)
    status[:, 4] = 4
    with pytest.raises(DatasetError, match="west"):
        changed(**values, status=status)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--bounds", "1,0"), "exclude everything"),
        (("--bounds", "nan,1"), "'nan' is not a number"),
        (("--springs", "bering"), "did you mean 'bearing'"),
        (("--loss", "hubert"), "did you mean 'huber'"),
        (("--weights", "equal"), "none, sigma"),
        (("--exclude", "99"), "pose 99"),
        (("--exclude", "1:nort"), "did you mean 'north'"),
        (("--draws", "3"), "at least 40"),
        (("--marker", "1, 2, 3"), "unit"),
        (("--tcp", "link_9"), "no tip link 'link_9'"),
    ],
)
def test_an_impossible_option_is_refused_by_name(tmp_path, options, message):
    assert message in calibrate(tmp_path, good(), *options).reason


def test_an_output_that_cannot_be_written_is_refused_and_nothing_is_left(tmp_path):
    path = tmp_path / "data.nc"
    dataset.write(good(), path)
    result = elastocal("calibrate", path, "--out", path / "model.json")
    assert "cannot write" in result.err.strip().splitlines()[-1]
    assert result.code == 1
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["data.nc"]


def test_a_dataset_of_another_robot_is_refused(tmp_path):
    other = Robot.from_urdf(urdf().replace("joint_", "axis_"), "tcp")
    arm = tmp_path / "other.urdf"
    arm.write_text(other.urdf)
    reason = calibrate(tmp_path, good(), "--robot", arm, "--tcp", "tcp").reason
    assert "axis_1" in reason
    assert "joint_1" in reason
