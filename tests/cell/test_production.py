"""The production path of a cell file: joints or tcp poses, one or several courses."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.cell import Cell, load_cell, write_example
from elastocal.errors import SchemaError
from elastocal.robot import xyzabc_from_T

ARM = ("joint_a1", "joint_a2", "joint_a3", "joint_a4", "joint_a5", "joint_a6")
JOINTS = np.radians(
    [[-10.0, -60, 90, 10, 60, 5], [-9, -59, 89, 11, 61, 6], [40, -50, 80, 5, 50, 0]]
)
FORCE_TCP = np.array([[100.0, 0, -800], [90, 10, -810], [0, 0, -900]])
RAIL = np.array([0.2, 0.2, 1.0])


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Cell:
    """Return the fibre placement cell without a process."""
    return load_cell(write_example(tmp_path_factory.mktemp("plain"), "afp")[0])


def read(tmp_path: Path, rows: list[str], entry: str = "{file: process.csv}") -> Cell:
    """Return the cell with a process of some rows."""
    path, *_ = write_example(tmp_path, "afp", force=True)
    (tmp_path / "process.csv").write_text("\n".join(rows) + "\n")
    path.write_text(path.read_text() + f"\nprocess: {entry}\n")
    return load_cell(path)


def whole(plain: Cell) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joints with the rail, poses, and forces in base."""
    q = np.column_stack([RAIL, JOINTS])
    T = plain.robot.forward(q)
    return q, T, np.einsum("rij,rj->ri", T[:, :3, :3], FORCE_TCP)


def test_joints_and_courses_are_read(tmp_path, plain):
    q, _, force = whole(plain)
    header = ",".join(["course", "rail[mm]", *(f"{name}[deg]" for name in ARM)])
    rows = [header + ",force_x[N],force_y[N],force_z[N]"]
    for name, joints, f in zip(("one", "one", "two"), q, force, strict=True):
        cells = [1e3 * joints[0], *np.degrees(joints[1:]), *f]
        rows.append(",".join([name, *map(repr, map(float, cells))]))
    found = read(tmp_path, rows).process
    np.testing.assert_allclose(found.joint_position, q, atol=1e-9)
    np.testing.assert_allclose(found.force, force, atol=1e-9)
    assert found.courses == (("one", slice(0, 2)), ("two", slice(2, 3)))


START = ", ".join(
    f"{name}: {degrees} deg" for name, degrees in zip(ARM, (0, -60, 90, 0, 60, 0), strict=True)
)


@pytest.mark.parametrize("has_rail", [True, False])
@pytest.mark.parametrize("quaternions", [True, False])
def test_tcp_poses_become_the_postures_of_the_stated_branch(tmp_path, plain, has_rail, quaternions):
    q, T, force = whole(plain)
    orientation = "qx,qy,qz,qw" if quaternions else "a[deg],b[deg],c[deg]"
    rail = ["rail[mm]"] if has_rail else []
    tcp = ["force_tcp_x[N]", "force_tcp_y[N]", "force_tcp_z[N]"]
    rows = [",".join(["course", *rail, "x[mm]", "y[mm]", "z[mm]", orientation, *tcp])]
    for number, pose in enumerate(T):
        turn = (
            Rotation.from_matrix(pose[:3, :3]).as_quat()
            if quaternions
            else np.degrees(np.asarray(xyzabc_from_T(pose))[3:])
        )
        place = [1e3 * RAIL[number]] if has_rail else []
        cells = [*place, *(1e3 * pose[:3, 3]), *turn, *FORCE_TCP[number]]
        rows.append(",".join([f"course {number // 2}", *map(repr, map(float, cells))]))
    cell = read(tmp_path, rows, "{file: process.csv, start: {rail: 0 mm, " + START + "}}")
    np.testing.assert_allclose(cell.robot.forward(cell.process.joint_position), T, atol=1e-6)
    np.testing.assert_allclose(cell.process.force, force, atol=1e-6)
    if has_rail:
        np.testing.assert_allclose(cell.process.joint_position, q, atol=1e-6)
    else:
        # The rail stands still along a course, at one of the positions that are searched.
        stand = cell.process.joint_position[:, 0]
        assert stand[0] == stand[1]
        assert set(stand) <= set(cell.external_positions[:, 0])


def test_a_path_out_of_reach_is_refused_by_its_row(tmp_path):
    rows = [
        "rail[mm],x[mm],y[mm],z[mm],a[deg],b[deg],c[deg],force_x[N],force_y[N],force_z[N]",
        "0,9000,0,1000,0,90,0,0,0,100",
    ]
    with pytest.raises(SchemaError, match=r"process\.file: .*row 2: no posture"):
        read(tmp_path, rows)


def test_a_start_that_misses_a_joint_is_refused_by_its_name(tmp_path):
    with pytest.raises(SchemaError, match=r"start\.joint_a1 is missing"):
        read(tmp_path, ["x[mm]"], '{file: process.csv, start: {rail: "0 mm"}}')


def test_a_process_makes_i_optimality_the_default_and_a_named_technique_stays(tmp_path, plain):
    q, _, force = whole(plain)
    header = ",".join(["rail[m]", *(f"{name}[rad]" for name in ARM)])
    cells = ",".join(map(repr, map(float, [*q[0], *force[0]])))
    rows = [header + ",force_x[N],force_y[N],force_z[N]", cells]
    assert plain.technique == "cover"
    assert read(tmp_path, rows).technique == "cover"  # the example's file names it
    path = tmp_path / "cell.yaml"
    path.write_text(path.read_text().replace("  technique: cover\n", ""))
    assert load_cell(path).technique == "i_optimal"
