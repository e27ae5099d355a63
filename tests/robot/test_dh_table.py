"""Robots from tables of Denavit and Hartenberg's numbers, as URDFs are read."""

from pathlib import Path

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import Robot, read_urdf, tool_link
from elastocal.workflows import check
from elastocal.workflows._inputs import find_robot

# Published by Universal Robots for the UR10e, and by Franka for the Panda (Craig's convention).
UR10E = """convention,theta[deg],d[mm],a[mm],alpha[deg]
standard,0,180.7,0,90
standard,0,0,-612.7,0
standard,0,0,-571.55,0
standard,0,174.15,0,90
standard,0,119.85,0,-90
standard,0,116.55,0,0
"""
PANDA = """joint,kind,convention,theta[deg],d[m],a[m],alpha[deg],lower[rad],upper[rad]
panda_joint1,revolute,modified,0,0.333,0,0,-2.8973,2.8973
panda_joint2,revolute,modified,0,0,0,-90,-1.7628,1.7628
panda_joint3,revolute,modified,0,0.316,0,90,-2.8973,2.8973
panda_joint4,revolute,modified,0,0,0.0825,90,-3.0718,-0.0698
panda_joint5,revolute,modified,0,0.384,-0.0825,-90,-2.8973,2.8973
panda_joint6,revolute,modified,0,0,0,90,-0.0175,3.7525
panda_joint7,revolute,modified,0,0,0.088,90,-2.8973,2.8973
flange,fixed,modified,0,0.107,0,0,0,0
"""


def robot(folder: Path, text: str) -> Robot:
    path = folder / "arm.csv"
    path.write_text(text, encoding="utf-8")
    urdf = read_urdf(path)
    return Robot.from_urdf(urdf, tool_link(urdf))


def about(axis: int, angle: float) -> np.ndarray:
    T, c, s = np.eye(4), np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    T[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return T


def along(axis: int, length: float) -> np.ndarray:
    T = np.eye(4)
    T[axis, 3] = length
    return T


def test_an_arm_of_the_standard_convention_goes_where_its_matrices_say(tmp_path):
    arm, q = robot(tmp_path, UR10E), np.linspace(-1.0, 1.5, 6)
    T = np.eye(4)
    d, a = (0.1807, 0, 0, 0.17415, 0.11985, 0.11655), (0, -0.6127, -0.57155, 0, 0, 0)
    for angle, up, out, twist in zip(q, d, a, np.radians([90, 0, 0, 90, -90, 0]), strict=True):
        T = T @ about(2, angle) @ along(2, up) @ along(0, out) @ about(0, twist)
    np.testing.assert_allclose(arm.forward(q), T, atol=1e-12)
    assert arm.joint_names == tuple(f"joint_{n}" for n in range(1, 7))
    assert arm.tip == "flange"
    # As published by the maker for all joints at zero.
    np.testing.assert_allclose(
        arm.forward(np.zeros(6))[:3, 3], [-1.18425, -0.2907, 0.06085], atol=1e-6
    )


def test_an_arm_of_the_modified_convention_has_names_limits_and_a_flange(tmp_path):
    arm, q = robot(tmp_path, PANDA), np.linspace(-0.8, 0.9, 7)
    T = np.eye(4)
    d, a = (0.333, 0, 0.316, 0, 0.384, 0, 0), (0, 0, 0, 0.0825, -0.0825, 0, 0.088)
    for angle, up, out, twist in zip(
        q, d, a, np.radians([0, -90, 90, 90, -90, 90, 90]), strict=True
    ):
        T = T @ about(0, twist) @ along(0, out) @ about(2, angle) @ along(2, up)
    np.testing.assert_allclose(arm.forward(q), T @ along(2, 0.107), atol=1e-12)
    assert arm.joint_names[3] == "panda_joint4"
    np.testing.assert_allclose(arm.limits.upper[[0, 3]], [2.8973, -0.0698])


def test_a_rail_a_turned_sense_and_hayatis_turn_are_those_of_the_row(tmp_path):
    arm = robot(
        tmp_path,
        "kind,convention,theta[deg],d[mm],a[mm],alpha[deg],beta[deg],sense,lower,upper\n"
        "prismatic,standard,90,0,100,90,0,1,0 m,2 m\n"
        "revolute,standard,30,50,300,0,2,-1,-170 deg,170 deg\n",
    )
    q = np.array([0.7, 0.4])
    first = along(2, 0.7) @ about(2, np.pi / 2) @ along(0, 0.1) @ about(0, np.pi / 2)
    second = about(2, np.radians(30) - 0.4) @ along(2, 0.05) @ along(0, 0.3)
    np.testing.assert_allclose(arm.forward(q), first @ second @ about(1, np.radians(2)), atol=1e-12)
    assert arm.revolute == (False, True)
    np.testing.assert_allclose(arm.limits.upper, [2.0, np.radians(170)])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("convention,", "", "column 'convention' is missing"),
        ("standard,0,180.7", "craig,0,180.7", "row 2: convention 'craig'"),
        ("standard,0,180.7", "modified,0,180.7", "the rows are of two conventions"),
        ("d[mm]", "d", r"column 'd' has no unit: it is written like 'd\[mm\]'"),
        ("d[mm]", "d[deg]", "deg"),
        ("d[mm]", "e[mm]", "has no column 'e'"),
        ("180.7", "nan", "nan"),
        ("180.7", "1e9", "1000000"),
        ("standard,0,180.7,0,90", "standard,0,180.7,0", "row 2 has 4 cells"),
        ("alpha[deg]", "a[deg]", "'a' stands twice"),
        ("theta[deg]", "lower[deg],theta[deg]", "row 2 has 5 cells"),
    ],
)
def test_what_is_no_such_table_is_refused_by_name(old, new, message, tmp_path):
    text = UR10E.replace(old, new, 1)
    if old == "convention,":
        text = text.replace("standard,", "")
    with pytest.raises(RobotError, match=message):
        robot(tmp_path, text)


def test_a_limit_without_the_other_is_refused(tmp_path):
    text = UR10E.replace("theta", "lower[deg],theta").replace("standard,", "standard,-90,")
    with pytest.raises(RobotError, match="columns lower and upper go together"):
        robot(tmp_path, text)


def test_a_table_without_rows_and_a_rail_without_limits_are_refused(tmp_path):
    with pytest.raises(RobotError, match="there is no row"):
        robot(tmp_path, UR10E.splitlines()[0] + "\n")
    text = UR10E.replace("convention", "kind,convention").replace("standard", "prismatic,standard")
    with pytest.raises(RobotError, match="row 2: a prismatic joint needs limits"):
        robot(tmp_path, text)


def test_check_and_geometry_take_it_for_a_robot(tmp_path):
    path = tmp_path / "ur10e.csv"
    path.write_text(UR10E, encoding="utf-8")
    found = check(path)
    assert found.kind == "robot description"
    assert found.holds["tcp"] == "flange"
    assert find_robot(str(path), None, None).joint_names == tuple(found.holds["joints"])
