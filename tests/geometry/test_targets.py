"""Targets that a tracker sees with their orientation, as input beside points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import GeometryError
from elastocal.geometry import GeometryProblem, read_positions
from elastocal.geometry.ladder import climb
from elastocal.geometry.solve import register
from elastocal.progress import silent
from elastocal.robot import catalogue
from support.measured_arms import Measured, measure, write_positions

ARM = catalogue.load("KR 210 R2700-2")
TARGET = Rotation.from_euler("ZYX", [0.4, -0.3, 1.1])
"""Orientation of the target in the tcp."""
PLACE = np.array([0.1, 0.2, 0.3])


def seen(found: Measured, noise: float, turned: float) -> tuple[np.ndarray, Rotation]:
    """Return places and orientations of a target on the tool, in the frame of its station."""
    rng = np.random.default_rng(1)
    T = found.T_station_base[0] @ found.truth.forward(found.data.q)
    places = T[:, :3, 3] + T[:, :3, :3] @ PLACE + rng.normal(0.0, noise, (len(T), 3))
    error = Rotation.from_rotvec(rng.normal(0.0, turned, (len(T), 3)))
    return places, Rotation.from_matrix(T[:, :3, :3]) * TARGET * error


def table(path, found: Measured, kind: str, noise: float = 3e-5, turned: float = 1e-4):
    """Write the table of a target, its orientation in angles or quaternions."""
    places, turns = seen(found, noise, turned)
    names = [f"{name}[rad]" for name in ARM.joint_names]
    heads = [*names, *(f"target_{axis}[mm]" for axis in "xyz")]
    if kind == "abc":
        heads += [f"target_{name}[deg]" for name in "abc"]
        angles = turns.as_euler("ZYX", degrees=True)
    else:
        heads += [f"target_{name}" for name in ("qw", "qx", "qy", "qz")]
        angles = np.roll(turns.as_quat(), 1, axis=1)
    rows = np.column_stack([found.data.q, 1e3 * places, angles])
    text = [",".join(heads), *(",".join(map(repr, row)) for row in rows.tolist())]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", ["abc", "quaternion"])
def test_a_target_is_its_origin_and_points_on_its_axes(kind, tmp_path):
    found = measure(ARM, 12, stations=1)
    data = read_positions(table(tmp_path / "t.csv", found, kind), ARM)
    places, turns = seen(found, 3e-5, 1e-4)
    x, y, _ = turns.as_matrix().transpose(2, 0, 1)
    expected = np.stack([places, places + 0.2 * x, places + 0.2 * y], axis=1)
    np.testing.assert_allclose(data.markers, expected, atol=1e-12)


def test_orientations_tell_an_arm_from_poses_too_few_for_points(tmp_path):
    """Judged at unseen poses: places where the fit expects them, against those of the arm."""
    found, unseen = measure(ARM, 9, stations=1), measure(ARM, 200, stations=1, seed=5).data.q
    whole = read_positions(table(tmp_path / "t.csv", found, "abc"), ARM)
    points = GeometryProblem(ARM, replace(whole, markers=whole.markers[:, :1]))
    with pytest.raises(GeometryError, match="9 positions of markers cannot tell"):
        climb(points, 40, np.random.default_rng(0), silent)
    problem = GeometryProblem(ARM, whole)
    ladder = climb(problem, 40, np.random.default_rng(0), silent)
    T = found.T_station_base[0] @ found.truth.forward(unseen)
    markers = np.full((200, 3, 3), np.nan)
    markers[:, 0] = T[:, :3, 3] + T[:, :3, :3] @ PLACE
    blind = replace(whole.rows(np.zeros(200, dtype=int)), q=unseen, markers=markers)
    there = GeometryProblem(ARM, blind)
    before, after = (there.residual(state) for state in (register(problem), ladder.whole.fit.state))
    left, drawn = (np.linalg.norm(each, axis=1).mean() for each in (after, before))
    assert left < 0.15 * drawn


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("target_c[deg]", "target_e[deg]", r"column 'target_c\[…\]' is missing"),
        ("target_a[deg]", "target_a", "column 'target_a' has no unit"),
        ("target_qw", "target_qv", "column 'target_qw' is missing"),
        ("target_qx", "target_qx[deg]", "column 'target_qx' has no unit, found 'deg'"),
        ("target_x[mm]", "aside[mm]", "no column 'marker_x"),
    ],
)
def test_columns_of_a_target_are_refused_by_name(old, new, message, tmp_path):
    kind = "quaternion" if "_q" in old else "abc"
    path = table(tmp_path / "t.csv", measure(ARM, 6, stations=1), kind)
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(GeometryError, match=message):
        read_positions(path, ARM)


def test_a_quaternion_of_another_length_and_a_target_beside_markers_are_refused(tmp_path):
    found = measure(ARM, 6, stations=1)
    path = table(tmp_path / "t.csv", found, "quaternion")
    head, first, *rest = path.read_text(encoding="utf-8").splitlines()
    cells = first.split(",")
    cells[-1] = repr(2.0 + float(cells[-1]))
    path.write_text("\n".join([head, ",".join(cells), *rest]) + "\n", encoding="utf-8")
    with pytest.raises(GeometryError, match=r"row 2: target_qw … target_qz have the length"):
        read_positions(path, ARM)
    both = write_positions(tmp_path / "p.csv", found)
    text = both.read_text(encoding="utf-8").replace("marker1_x[mm]", "target_x[mm]")
    both.write_text(text, encoding="utf-8")
    with pytest.raises(GeometryError, match="columns of a target and of markers"):
        read_positions(both, ARM)


def test_a_target_without_orientation_is_hidden(tmp_path):
    path = table(tmp_path / "t.csv", measure(ARM, 6, stations=1), "abc")
    head, first, *rest = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([head, first.rpartition(",")[0] + ",", *rest]) + "\n")
    assert read_positions(path, ARM).seen.any(axis=1).tolist() == [False, *[True] * 5]
