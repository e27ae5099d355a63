import numpy as np
import pytest

from elastocal.dataset import Dataset
from elastocal.errors import DatasetError
from support.datasets import dataset, labelled


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("name", "index", "where"),
    [
        ("force", (2, 1, 0), "force x of pose 11, load case 'north'"),
        ("marker_displacement", (0, 0, 2), "marker_displacement z of pose 4, load case 'normal'"),
        ("joint_position", (0, 1, 1), "joint_position joint_2 of pose 4, load case 'north'"),
        ("moment", (1, 1, 1), "moment y of pose 2, load case 'north'"),
        ("tcp_position", (1, 0), "tcp_position x of pose 2"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_where_the_status_is_ok(name, index, where, value):
    data = labelled()
    data[name].values[index] = value
    with pytest.raises(DatasetError) as caught:
        Dataset.from_xarray(data)
    assert str(caught.value) == (
        f"{where} is {value} although the status is ok: give a finite number, or the status"
        " 'missing'"
    )


def test_a_number_that_is_not_finite_may_stand_where_the_status_says_so():
    data = labelled()
    data["status"][0, 0] = 1
    data["force"].values[0, 0] = np.inf
    assert Dataset.from_xarray(data).readings(("joint_1", "joint_2")).pose.tolist() == [
        4,
        2,
        11,
        11,
    ]


@pytest.mark.parametrize("value", [0.0, -1e-5, np.nan])
def test_a_sigma_must_be_positive(value):
    data = labelled()
    data["marker_sigma"].values[0, 1, 2] = value
    with pytest.raises(DatasetError, match=r"^marker_sigma z of pose 4, load case 'north' is"):
        Dataset.from_xarray(data)


def test_a_load_case_without_a_usable_reading_is_refused_by_name():
    status = np.array([[0, 1], [0, 4], [0, 1]])
    with pytest.raises(DatasetError) as caught:
        dataset(status=status)
    assert str(caught.value) == (
        "load case 'north' has no usable reading at any of the 3 poses (status missing, slipped):"
        " leave it out or measure it"
    )


def test_a_dataset_without_any_usable_reading_is_refused():
    with pytest.raises(DatasetError) as caught:
        dataset(status=np.full((3, 2), 3))
    assert str(caught.value) == (
        "dataset has no usable reading: none of its 6 readings has the status ok"
    )


def test_a_dataset_without_poses_is_refused():
    with pytest.raises(DatasetError, match="none of its 0 readings has the status ok"):
        Dataset.from_xarray(labelled().isel(pose=[]))
