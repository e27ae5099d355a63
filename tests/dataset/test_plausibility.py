import numpy as np
import pytest

from elastocal.errors import DatasetError
from support.datasets import dataset, keywords

ARGUMENTS = keywords()


def scaled(*names, by):
    return {name: ARGUMENTS[name] * by for name in names}


DISPLACEMENTS = ("controller_displacement", "marker_displacement")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            scaled("joint_position", by=180 / np.pi),
            r"joint_position joint_1 of pose 0, load case 'normal' is -113\.\d+ rad, beyond"
            r" ±12\.22 rad: looks like degrees in a column of rad",
        ),
        (
            {"joint_units": ("rad", "m"), "joint_position": ARGUMENTS["joint_position"] + [0, 800]},
            r"joint_position joint_2 of .* is 80\d\.\d+ m, beyond ±100 m: looks like mm in a"
            r" column of m",
        ),
        (
            scaled("marker_displacement", by=1e3),
            r"marker_displacement has a median norm of 0\.\d+ m over 6 readings, more than 0\.1 m:"
            r" looks like mm in a column of m",
        ),
        (
            scaled("controller_displacement", by=1e3),
            r"controller_displacement has a median norm of 0\.\d+ m over 6 readings",
        ),
        (
            {"tcp_position": np.full((3, 3), 900.0)},
            r"tcp_position has a median norm of 1558\.85 m over 3 readings, more than 100 m: looks"
            r" like mm in a column of m",
        ),
        (
            scaled("force", by=1e3),
            r"force has a median norm of \d+ N over 6 readings, more than 50000 N: looks like mN",
        ),
        (scaled("force", by=0.0), "force is zero in all 6 usable readings: nothing to fit"),
        (
            {"marker_displacement": ARGUMENTS["controller_displacement"]},
            "marker_displacement equals controller_displacement in all 6 usable readings: the"
            " deflection is zero",
        ),
        (
            scaled("force", by=1e-3),
            r"median deflection per median force is 0\.00\d+ m/N over 6 loaded readings, outside"
            r" 1e-08 to 0\.0002 m/N: softer than any robot: looks like kN in a column of N",
        ),
        (
            scaled(*DISPLACEMENTS, by=1e-3),
            r"median deflection per median force is \de?.* stiffer than any robot: looks like m in"
            r" a column of mm",
        ),
    ],
)
def test_a_unit_mistake_is_refused_and_named(changes, message):
    with pytest.raises(DatasetError, match=f"^{message}"):
        dataset(**changes)


def test_a_single_blunder_of_half_a_metre_is_left_to_the_fit():
    marker = ARGUMENTS["marker_displacement"].copy()
    marker[1, 1, 0] += 0.5
    assert (
        np.abs(
            dataset(marker_displacement=marker).readings(("joint_1", "joint_2")).deflection
        ).max()
        > 0.4
    )


def test_a_reference_loaded_more_than_its_pose_is_refused():
    """Raw wrenches with the tool's weight in them, or another unit."""
    largest = np.linalg.norm(ARGUMENTS["force"], axis=2).max(axis=1)
    light = np.zeros((3, 3))
    light[:, 2] = largest * [0.9, 1.1, 0.0]
    with pytest.raises(DatasetError, match=r"^reference_force of pose 1 is .* more than its"):
        dataset(reference_force=light)
    light[1] = 0.0
    assert dataset(reference_force=light).poses == (0, 1, 2)


def test_a_joint_at_its_widest_range_is_plausible():
    joints = np.full((3, 2, 2), np.radians(690.0))
    assert dataset(joint_position=joints).poses == (0, 1, 2)


def test_readings_that_are_not_ok_are_not_judged():
    joints = ARGUMENTS["joint_position"].copy()
    joints[0, 0] = 500.0
    assert dataset(joint_position=joints, status=[[1, 0], [0, 0], [0, 0]]).poses == (0, 1, 2)


def test_unloaded_readings_do_not_hide_a_sound_ratio():
    force = ARGUMENTS["force"].copy()
    force[:2] = 0.0
    assert dataset(force=force).poses == (0, 1, 2)
