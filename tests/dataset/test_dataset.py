import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.dataset import SCHEMA, Dataset
from elastocal.errors import DatasetError
from support.datasets import JOINTS, dataset, full_keywords, keywords, labelled


def test_properties_are_those_of_the_arguments():
    data = Dataset.from_arrays(**full_keywords())
    assert data.poses == (4, 2, 11)
    assert data.load_cases == ("normal", "north")
    assert data.joint_names == JOINTS
    assert data.joint_units == ("rad", "rad")
    assert data.robot_name == "arm"
    assert data.robot_urdf == full_keywords()["robot_urdf"]
    assert data.tcp_frame == "tcp"
    assert data.provenance == "made up, “for tests”"
    assert data.to_xarray().attrs["schema"] == SCHEMA


def test_what_is_not_known_about_the_robot_is_none_or_empty():
    data = dataset()
    assert (data.robot_name, data.robot_urdf, data.tcp_frame) == ("", None, None)
    assert data.poses == (0, 1, 2)


def test_the_status_carries_its_cf_flags():
    attributes = dataset().to_xarray()["status"].attrs
    assert attributes["flag_values"].tolist() == [0, 1, 2, 3, 4]
    assert attributes["flag_meanings"] == "ok slipped unstable aborted missing"


def test_arrays_are_copied_in_and_read_only():
    source = labelled()
    data = Dataset.from_xarray(source)
    source["force"].values[:] = 0.0
    assert data.to_xarray()["force"].values[0].all()
    for name in data.to_xarray().variables:
        with pytest.raises(ValueError, match="read-only"):
            data.to_xarray()[name].values[0] = data.to_xarray()[name].values[-1]


@pytest.mark.parametrize(
    "sigma", [2e-5, np.full((3, 2), 2e-5), np.full((3, 2, 3), 2e-5)], ids=["scalar", "2d", "3d"]
)
def test_a_sigma_is_broadcast_to_every_axis(sigma):
    readings = dataset(marker_sigma=sigma).readings(JOINTS)
    np.testing.assert_array_equal(readings.marker_sigma, np.full((6, 3), 2e-5))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"force": np.ones((3, 2))},
            "force has shape (3, 2): it must be (pose, load_case, axis) = (3, 2, 3)",
        ),
        (
            {"marker_sigma": np.ones(3)},
            "marker_sigma has shape (3,): it must be (pose, load_case, axis) = (3, 2, 3) or"
            " (pose, load_case) = (3, 2) or () = ()",
        ),
        (
            {"status": np.zeros(3)},
            "status has shape (3,): it must be (pose, load_case) = (3, 2)",
        ),
        (
            {"poses": (1, 2)},
            "joint_position has shape (3, 2, 2): it must be (pose, load_case, joint) = (2, 2, 2)",
        ),
        ({"status": [[0, 0], [0]]}, "status is ragged: its rows differ in length"),
        ({"joint_units": ("rad",)}, "1 joint units given for 2 joints"),
        (
            {"joint_units": ("rad", "inch")},
            "variable 'joint_position': unit 'inch' is not one of rad, deg, m, mm",
        ),
        ({"poses": ("a", "b", "c")}, "coordinate 'pose' has <U1 labels: they must be integers"),
        ({"force": np.full((3, 2, 3), "N")}, "variable 'force' is <U1: it must hold numbers"),
    ],
)
def test_arrays_that_do_not_fit_are_refused_by_name(changes, message):
    with pytest.raises(DatasetError) as caught:
        dataset(**changes)
    assert str(caught.value) == message


def test_readings_are_the_ok_ones_in_pose_and_load_case_order():
    status = [[0, 2], [0, 0], [4, 0]]
    readings = dataset(status=status).readings(JOINTS)
    assert readings.pose.tolist() == [0, 1, 1, 2]
    assert readings.load_case.tolist() == ["normal", "normal", "north", "north"]
    force = keywords()["force"]
    np.testing.assert_array_equal(readings.force, force[[0, 1, 1, 2], [0, 0, 1, 1]])


def test_tcp_position_is_repeated_for_every_reading_of_its_pose():
    readings = Dataset.from_arrays(**full_keywords()).readings(JOINTS)
    np.testing.assert_array_equal(readings.tcp_position[:, 0], [0.0, 0.0, 3.0, 6.0, 6.0])


def test_joints_are_reordered_by_name():
    forwards = dataset().readings(JOINTS)
    backwards = dataset().readings(JOINTS[::-1])
    np.testing.assert_array_equal(backwards.joint_position, forwards.joint_position[:, ::-1])


@pytest.mark.parametrize("names", [("joint_1",), ("joint_1", "joint_3"), ("joint_1", "joint_1")])
def test_joints_of_another_robot_are_refused_with_both_lists(names):
    with pytest.raises(DatasetError) as caught:
        dataset().readings(names)
    assert str(caught.value) == (
        f"joints of the dataset are ['joint_1', 'joint_2'], those of the robot {list(names)}:"
        " they must have the same names"
    )


def test_selecting_everything_changes_nothing():
    data = Dataset.from_arrays(**full_keywords())
    assert data.select().to_xarray().identical(data.to_xarray())
    assert data.select(data.poses, data.load_cases).to_xarray().identical(data.to_xarray())


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=1, max_size=6, unique=True), st.data())
def test_selection_composes_and_keeps_the_order_asked_for(first, draw):
    data = dataset(count=6)
    second = draw.draw(st.permutations(first).map(lambda labels: labels[:3]))
    assert data.select(second).poses == tuple(second)
    assert data.select(first).select(second).to_xarray().identical(data.select(second).to_xarray())


def test_selection_in_one_direction_commutes_with_the_other():
    data = Dataset.from_arrays(**full_keywords())
    one = data.select(poses=[11, 4]).select(load_cases=["north"])
    other = data.select(load_cases=["north"]).select(poses=[11, 4])
    assert one.to_xarray().identical(other.to_xarray())
    assert one.to_xarray().identical(data.select([11, 4], ["north"]).to_xarray())


def test_a_load_case_that_selection_empties_is_left_out_unless_asked_for():
    data = Dataset.from_arrays(**full_keywords())
    assert data.select(poses=[2]).load_cases == ("north",)
    with pytest.raises(DatasetError, match="load case 'normal' has no usable reading at any of"):
        data.select(poses=[2], load_cases=["normal", "north"])


@pytest.mark.parametrize(
    ("selection", "message"),
    [
        ({"poses": ["0"]}, "pose '0' is not in the dataset (known: 0, 1, 2)"),
        ({"poses": [0, 8]}, "pose 8 is not in the dataset (known: 0, 1, 2)"),
        (
            {"load_cases": ["nort"]},
            "load case 'nort' is not in the dataset; did you mean 'north'? (known: normal, north)",
        ),
        ({"poses": [1, 1]}, "pose 1 stands twice, at positions 0 and 1: every pose needs its own"),
        ({"poses": []}, "dataset has no usable reading: none of its 0 readings has the status ok"),
        ({"load_cases": []}, "dataset has no usable reading: none of its 0 readings"),
    ],
)
def test_a_selection_that_cannot_be_made_is_refused(selection, message):
    with pytest.raises(DatasetError) as caught:
        dataset().select(**selection)
    assert str(caught.value).startswith(message)


def test_a_marker_is_kept_to_the_last_digit_and_round_off_is_nothing():
    marker = (0.1, -1.0 / 3.0, 1e-17)
    assert dataset(marker=marker).marker == (0.1, -1.0 / 3.0, 0.0)
    assert dataset().marker is None


@pytest.mark.parametrize("text", ["", "0 m, 1 m", "0, 0, 0.1", "0 m, 0 m, 3 kg"])
def test_a_marker_that_is_not_three_lengths_is_refused(text):
    data = labelled()
    data.attrs["marker"] = text
    with pytest.raises(DatasetError, match=r"attribute 'marker' is .* it must be three lengths"):
        Dataset.from_xarray(data)
