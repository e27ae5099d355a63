import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification.recertification import check_same_robot
from elastocal.identification.recertification.arms import count_outside_limits
from elastocal.robot import Robot, catalogue
from support.cells import robot, urdf

NAMES = ("old.json", "new.json")


def changed(before: str, after: str, tip: str = "tcp") -> Robot:
    assert before in urdf()
    return Robot.from_urdf(urdf().replace(before, after), tip)


def test_one_robot_passes_whatever_its_description_is_called():
    check_same_robot(robot(), Robot.from_urdf(f"<!-- again -->{urdf()}", "tcp"), NAMES)


def test_a_tool_that_was_measured_again_within_a_tenth_of_a_millimetre_is_the_same():
    check_same_robot(robot(), changed("0.15 0.0 0.565", "0.15005 0.0 0.565"), NAMES)


def test_another_tool_on_the_same_robot_passes():
    check_same_robot(robot(), changed("0.15 0.0 0.565", "0.16 0.0 0.565"), NAMES)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("1.15", "1.17", "different robots: at the same joints their last links are 20 mm"),
        ('"joint_3"', '"elbow"', "different robots: .* has the joints joint_1, .*elbow"),
    ],
)
def test_another_robot_is_refused_by_name(before, after, said):
    with pytest.raises(IdentificationError, match=said) as refused:
        check_same_robot(robot(), changed(before, after), NAMES)
    assert all(name in str(refused.value) for name in NAMES)


def test_a_robot_of_another_size_is_refused_though_its_joints_have_the_same_names():
    small, large = (
        Robot.from_urdf(catalogue.urdf(name), "flange")
        for name in ("KR 120 R2700 extra HA", "KR 300 R2500 ultra")
    )
    assert small.joint_names == large.joint_names
    with pytest.raises(IdentificationError, match="different robots"):
        check_same_robot(small, large, NAMES)


def test_rows_outside_the_limits_are_counted():
    q = np.zeros((3, 6))
    q[1, 2] = 90.0
    limits = robot().limits
    q[0] = q[2] = 0.5 * (limits.lower + limits.upper)
    assert count_outside_limits(robot(), q) == 1
