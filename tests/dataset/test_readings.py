from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.dataset import Readings, without
from elastocal.errors import DatasetError
from support.datasets import JOINTS, dataset

READINGS = dataset(moment=np.ones((3, 2, 3))).readings(JOINTS)


def arrays(**changes):
    count = 2
    return {
        "pose": [3, 4],
        "load_case": ["normal", "north"],
        "joint_position": np.zeros((count, 6)),
        "force": np.ones((count, 3)),
        "controller_displacement": np.zeros((count, 3)),
        "marker_displacement": np.ones((count, 3)),
        **changes,
    }


def test_deflection_is_marker_minus_controller():
    readings = Readings(**arrays(controller_displacement=np.full((2, 3), 0.25)))
    np.testing.assert_array_equal(readings.deflection, np.full((2, 3), 0.75))


def test_arrays_are_copied_in_and_read_only():
    force = np.ones((2, 3))
    readings = Readings(**arrays(force=force))
    force[:] = 7.0
    assert np.all(readings.force == 1.0)
    for array in (readings.force, readings.pose, readings.load_case, readings.deflection):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = array[1]


def test_arrays_of_different_length_are_refused():
    with pytest.raises(
        DatasetError, match=r"^force of the readings has shape \(3, 3\), not \(2, 3"
    ):
        Readings(**arrays(force=np.ones((3, 3))))


def test_a_number_that_is_not_finite_is_refused_by_pose_and_load_case():
    force = np.ones((2, 3))
    force[1, 2] = np.nan
    with pytest.raises(
        DatasetError, match=r"^force of pose 4, load case 'north' is \[1.0, 1.0, nan"
    ):
        Readings(**arrays(force=force))


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, len(READINGS) - 1)), st.data())
def test_taking_twice_is_taking_once_with_the_composed_index(first, data):
    indices = st.integers(0, max(0, len(first) - 1))
    second = data.draw(st.lists(indices, max_size=5 if first else 0))
    twice = READINGS.take(first).take(second)
    once = READINGS.take([first[index] for index in second])
    assert len(twice) == len(second)
    for name in ("pose", "load_case", "joint_position", "moment", "deflection"):
        np.testing.assert_array_equal(getattr(twice, name), getattr(once, name))


def test_a_mask_and_its_rows_take_the_same():
    mask = READINGS.load_case == "north"
    taken = READINGS.take(mask)
    assert set(taken.load_case) == {"north"}
    np.testing.assert_array_equal(taken.force, READINGS.take(np.flatnonzero(mask)).force)
    assert taken.force_sigma is None


def test_taking_a_row_that_does_not_exist_is_an_index_error():
    with pytest.raises(IndexError):
        READINGS.take([len(READINGS)])


def test_one_name_to_exclude_is_not_split_into_letters():
    readings = READINGS.take([0, 2, 4])
    readings = replace(readings, pose=[1, 2, 12])
    assert without(readings, "12").pose.tolist() == [1, 2]
    assert without(readings, ["1", "2"]).pose.tolist() == [12]


def test_friction_remembers_a_press_whose_reading_is_excluded():
    readings = READINGS.take([0, 1, 2, 3])
    left = without(readings, f"{readings.pose[0]}:{readings.load_case[0]}")
    assert len(left) == 3
    np.testing.assert_array_equal(left.also_pressed.force, readings.force[:1])
    assert left.sequence.tolist() == [1, 2, 3]
    assert left.also_pressed.sequence.tolist() == [0]


def test_a_name_that_excludes_nothing_is_refused_without_an_option_of_the_command():
    readings = READINGS.take([0, 2, 4])
    readings = replace(readings, pose=[1, 2, 12])
    for name, message in (("7", "no usable reading at pose 7"), ("a", "must be POSE")):
        with pytest.raises(DatasetError, match=message) as refused:
            without(readings, name)
        assert "--" not in str(refused.value)
