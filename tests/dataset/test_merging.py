import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from elastocal.dataset import Dataset, merge
from elastocal.errors import DatasetError
from support.datasets import JOINTS, dataset, full_keywords


def test_one_dataset_merges_to_itself():
    data = Dataset.from_arrays(**full_keywords())
    assert merge([data]).to_xarray().identical(data.to_xarray())


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 2), min_size=5, max_size=5))
def test_parts_merge_to_the_whole_in_the_order_given(part_of):
    whole = dataset(count=5)
    parts = [[pose for pose in range(5) if part_of[pose] == part] for part in range(3)]
    merged = merge([whole.select(part) for part in parts if part])
    assert merged.to_xarray().identical(
        whole.select([pose for part in parts for pose in part]).to_xarray()
    )


def test_a_load_case_that_a_part_lacks_is_missing_there():
    status = np.zeros((3, 2), dtype=int)
    merged = merge(
        [
            dataset(poses=(0, 1, 2), load_cases=("normal", "north"), status=status),
            dataset(poses=(3, 4, 5), load_cases=("east", "normal")),
        ]
    )
    assert merged.load_cases == ("normal", "north", "east")
    assert merged.to_xarray()["status"].values.tolist() == [[0, 0, 4]] * 3 + [[0, 4, 0]] * 3
    assert np.isnan(merged.to_xarray()["force"].sel(pose=3, load_case="north").values).all()
    assert len(merged.readings(JOINTS)) == 12


def test_joints_are_matched_by_name():
    data = dataset()
    turned = Dataset.from_xarray(data.to_xarray().isel(joint=[1, 0]).assign_coords(pose=[7, 8, 9]))
    merged = merge([data, turned]).to_xarray()["joint_position"].values
    np.testing.assert_array_equal(merged[:3], merged[3:])


def test_poses_are_numbered_anew_only_when_asked_for():
    assert merge([dataset(), dataset()], relabel=True).poses == (0, 1, 2, 3, 4, 5)
    with pytest.raises(DatasetError) as caught:
        merge([dataset(), dataset(poses=(7, 1, 8))])
    assert str(caught.value) == (
        "pose 1 is in datasets 0 and 1: give every pose its own label, or number the poses anew"
        " with relabel=True"
    )


def test_provenances_are_joined_once_each():
    sources = ["monday", "", "tuesday", "monday"]
    merged = merge([dataset(provenance=source) for source in sources], relabel=True)
    assert merged.provenance == "monday; tuesday"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"robot_name": "kuka"},
            "datasets 0 and 1 are not of the same robot: attribute 'robot_name' is '' in one and"
            " 'kuka' in the other",
        ),
        (
            {"robot_urdf": "<robot>" * 100},
            "datasets 0 and 1 are not of the same robot: attribute 'robot_urdf' is None in one and"
            " '<robot><robot>",
        ),
        (
            {"joint_names": ("a", "b")},
            "datasets 0 and 1 have different joints: {'joint_1': 'rad', 'joint_2': 'rad'} and"
            " {'a': 'rad', 'b': 'rad'}",
        ),
        (
            {"joint_units": ("m", "rad")},
            "datasets 0 and 1 have different joints: {'joint_1': 'rad', 'joint_2': 'rad'} and"
            " {'joint_1': 'm', 'joint_2': 'rad'}",
        ),
        (
            {"marker_sigma": 1e-5},
            "dataset 0 has no variable 'marker_sigma', dataset 1 has: what was not measured cannot",
        ),
    ],
)
def test_datasets_of_another_kind_are_refused(changes, message):
    with pytest.raises(DatasetError) as caught:
        merge([dataset(), dataset(poses=(7, 8, 9), **changes)])
    assert str(caught.value).startswith(message)


def test_merging_nothing_is_refused():
    with pytest.raises(DatasetError, match=r"^nothing to merge: give at least one dataset$"):
        merge([])


def test_markers_that_are_estimated_alike_are_the_same():
    near = [
        dataset(marker=(0.1, 0.0, z), poses=(k, k + 3, k + 6)) for k, z in ((0, 0.05), (1, 0.0505))
    ]
    assert merge(near).marker == (0.1, 0.0, 0.05)


@pytest.mark.parametrize("other", [None, (0.1, 0.0, 0.06)])
def test_datasets_of_different_markers_are_refused(other):
    parts = [dataset(marker=(0.1, 0.0, 0.05)), dataset(marker=other)]
    with pytest.raises(DatasetError, match=r"datasets 0 and 1 have different markers: .*0.05 m"):
        merge(parts, relabel=True)
