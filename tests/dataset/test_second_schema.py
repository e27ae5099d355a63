"""The second schema: what is new in it, and that the first is written where nothing of it is."""

import numpy as np
import pytest

from elastocal.dataset import Dataset, merge, read, write
from elastocal.errors import DatasetError
from support.datasets import JOINTS, dataset, full_keywords, keywords, second_keywords, write_lines

NEWS = (
    *("sequence", "contacts", "reference_joint_position", "reference_force"),
    *("link_joint_position", "campaigns", "gravity", "conditioned", "check"),
)


def second(**changes):
    return Dataset.from_arrays(**second_keywords(**changes))


def only(name):
    return Dataset.from_arrays(**full_keywords(**{name: second_keywords()[name]}))


def test_the_first_schema_is_stated_where_nothing_is_new():
    data = Dataset.from_arrays(**full_keywords())
    assert data.attributes["schema"] == "elastocal.dataset/1"
    again = Dataset.from_xarray(data.to_xarray().assign_attrs(schema="elastocal.dataset/2"))
    assert again.to_xarray().identical(data.to_xarray())


@pytest.mark.parametrize("name", NEWS)
def test_each_new_thing_states_the_second_schema(name):
    assert only(name).attributes["schema"] == "elastocal.dataset/2"


@pytest.mark.parametrize("name", NEWS)
def test_the_first_schema_has_none_of_it(name):
    data = only(name).to_xarray().assign_attrs(schema="elastocal.dataset/1")
    with pytest.raises(DatasetError, match=r"needs schema 'elastocal.dataset/2': the dataset says"):
        Dataset.from_xarray(data)


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_files_carry_all_of_it(tmp_path, suffix):
    data = second()
    write(data, tmp_path / f"data{suffix}")
    back = read(tmp_path / f"data{suffix}")
    assert back.to_xarray().identical(data.to_xarray())
    assert back.campaigns == ("monday", "monday", "in the winter")
    assert back.gravity == (0.0, 9.8, -0.5)
    assert back.conditioned
    assert back.check_cases == ("north",)


def test_the_table_names_its_columns_after_joints_and_axes(tmp_path):
    write(second(), tmp_path / "data.csv")
    header = next(
        line
        for line in (tmp_path / "data.csv").read_text().splitlines()
        if not line.startswith("#")
    )
    assert header.split(",")[:14] == [
        *("pose", "load_case", "status", "sequence", "contacts", "campaign"),
        *("joint_1[rad]", "joint_2[rad]"),
        *("reference_joint_1[rad]", "reference_joint_2[rad]"),
        *("link_joint_1[rad]", "link_joint_2[rad]"),
        *("reference_link_joint_1[rad]", "reference_link_joint_2[rad]"),
    ]
    assert header.endswith("reference_force_x[N],reference_force_y[N],reference_force_z[N]")


HEAD = [
    *("pose", "load_case", "a1[deg]"),
    *(f"{name}_{axis}[{unit}]" for name, unit in (("force", "N"),) for axis in "xyz"),
    *(f"controller_displacement_{axis}[mm]" for axis in "xyz"),
]
MARKER = [f"marker_displacement_{axis}[mm]" for axis in "xyz"]
ROW = [*"10", "0,0,-500,0,0,0"]


def table(path, more, *cells, marker=True, above=()):
    head = [*HEAD, *(MARKER if marker else []), *more]
    rows = [
        ",".join([*row, *(["0", "0", "-0.5"] if marker else []), *cell])
        for row, cell in zip(
            ([*"0n", "30", "0,0,-500,0,0,0"], [*"0s", "30", "0,0,-500,0,0,0"]), cells, strict=True
        )
    ]
    return write_lines(path / "a.csv", *above, ",".join(head), *rows)


def test_a_table_may_state_the_joints_of_the_reference_in_degrees(tmp_path):
    path = table(tmp_path, ["reference_a1[deg]", "sequence"], ["30.1", "2"], ["30.1", "1"])
    data = read(path)
    assert data.reference_joint_position == pytest.approx(np.radians([[30.1]]))
    assert data.sequence.tolist() == [[2, 1]]


@pytest.mark.parametrize(
    ("more", "cells", "message"),
    [
        (["refrence_a1[deg]"], "30", "column 'refrence_a1[deg]' is not known; did you mean"),
        (["reference_a1[mm]"], "30", "column 'reference_a1[mm]': the unit must be rad or deg, as"),
        (["reference_a1[rad]"], "4", "reference_joint_position is a median of 3.4764 rad away"),
        (["sequence[1]"], "1", "column 'sequence[1]' has a unit: it must be written 'sequence'"),
        (["sequence"], "", "row 2: sequence is '': it must be an integer"),
        (
            ["sequence"],
            "3",
            "sequence of pose 0 is 3 for load cases 'n' and 's': each reading of a",
        ),
        (["campaign"], "", "campaign '' must be a printable name without spaces around it"),
    ],
)
def test_a_bad_column_is_refused(tmp_path, more, cells, message):
    with pytest.raises(DatasetError) as caught:
        read(table(tmp_path, more, [cells], [cells]))
    assert str(caught.value).removeprefix(f"{tmp_path / 'a.csv'}: ").startswith(message)


@pytest.mark.parametrize(
    ("column", "cells", "message"),
    [
        (
            "campaign",
            "ab",
            "row 3: campaign of pose 0 is 'b', but 'a' above: a pose belongs to one",
        ),
        ("reference_a1[rad]", ("0.5", "0.6"), "reference_a1 of pose 0 is 0.5 rad in row 2 but 0.6"),
    ],
)
def test_rows_of_a_pose_must_agree(tmp_path, column, cells, message):
    with pytest.raises(DatasetError) as caught:
        read(table(tmp_path, [column], *([cell] for cell in cells)))
    assert str(caught.value).removeprefix(f"{tmp_path / 'a.csv'}: ").startswith(message)


def test_metrology_may_be_absent_where_the_table_says_so(tmp_path):
    with pytest.raises(DatasetError, match=r"column 'marker_displacement_x\[m\]' is missing$"):
        read(table(tmp_path, [], [], [], marker=False))
    path = table(tmp_path, [], [], [], marker=False, above=['# schema: "elastocal.dataset/2"'])
    data = read(path)
    assert data.marker_displacement is None
    assert data.attributes["schema"] == "elastocal.dataset/2"
    readings = data.readings(["a1"])
    assert readings.contacts.tolist() == [1, 1]
    np.testing.assert_array_equal(readings.deflection, -readings.controller_displacement)


UNTRACKED = {
    "marker_displacement": np.where(np.arange(3)[:, None, None] == 2, np.nan, 1e-4)
    * np.ones((3, 2, 3))
}


def untracked(**changes):
    """Return a dataset whose last pose no tracker measured."""
    return Dataset.from_arrays(**keywords(**UNTRACKED | changes))


def test_a_pose_that_no_tracker_measured_has_readings_held_by_the_contact(tmp_path):
    data = untracked(contacts=[[1, 1], [1, 1], [1, 2]])
    assert data.attributes["schema"] == "elastocal.dataset/2"
    assert data.poses_unmeasured == (2,)
    for name in ("data.nc", "data.csv"):
        write(data, tmp_path / name)
        assert read(tmp_path / name).to_xarray().identical(data.to_xarray())
    readings = data.readings(JOINTS)
    assert readings.contacts.tolist() == [0, 0, 0, 0, 1, 2]
    np.testing.assert_array_equal(readings.marker_displacement[4:], 0.0)
    assert readings.take([5, 0]).contacts.tolist() == [2, 0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"marker_displacement": np.full((3, 2, 3), np.nan)}, "marker_displacement has no number"),
        (
            {"marker_displacement": np.where(np.arange(3) == 1, np.nan, 1e-4) * np.ones((3, 2, 3))},
            "marker_displacement y of pose 0, load case 'normal' is nan although the status is ok",
        ),
        ({"contacts": [[1, 0], [1, 1], [1, 1]]}, "contacts of pose 0, load case 'north' is 0: it"),
        ({"contacts": [[1, 1.5], [1, 1], [1, 1]]}, "is 1.5: it must be a whole number from 1 to 9"),
        (
            {"contacts": [[1, 1], [np.nan, 1], [1, 1]]},
            "contacts of pose 1, load case 'normal' is",
        ),
        ({"contacts": [1, 1]}, "contacts has shape"),
    ],
)
def test_gaps_and_impossible_stacks_are_refused(changes, message):
    with pytest.raises(DatasetError, match=message):
        untracked(**changes)


def test_the_first_schema_has_no_pose_without_a_number():
    data = untracked().to_xarray().assign_attrs(schema="elastocal.dataset/1")
    with pytest.raises(DatasetError, match="marker_displacement of pose 2 has no number although"):
        Dataset.from_xarray(data)


def test_campaigns_with_and_without_a_tracker_are_merged():
    alone = Dataset.from_arrays(**keywords(marker_displacement=None))
    merged = merge([dataset(contacts=np.full((3, 2), 2)), alone], relabel=True)
    assert merged.poses_unmeasured == (3, 4, 5)
    assert merged.contacts.tolist() == [[2, 2]] * 3 + [[1, 1]] * 3
    assert merged.select(poses=[0, 4]).contacts.tolist() == [[2, 2], [1, 1]]


def test_without_metrology_both_files_are_written_and_read(tmp_path):
    data = Dataset.from_arrays(**full_keywords(marker_displacement=None))
    for name in ("data.nc", "data.csv"):
        write(data, tmp_path / name)
        assert read(tmp_path / name).to_xarray().identical(data.to_xarray())


def test_another_history_is_a_remark():
    data = dataset().to_xarray().assign_attrs(history="2026: cut")
    read_back = Dataset.from_xarray(data)
    assert (read_back.conditioned, read_back.attributes["history"]) == (False, "2026: cut")
    assert read_back.attributes["schema"] == "elastocal.dataset/1"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sequence": [[0, 0], [0, 1], [0, 1]]}, "sequence of pose 4 is 0 for load cases 'normal'"),
        (
            {"sequence": [[0.0, 0.5], [0, 1], [0, 1]]},
            "sequence of pose 4, load case 'north' is 0.5: it must be a whole number",
        ),
        (
            {"sequence": [[np.nan, 1], [np.nan, 1], [0, 1]]},
            "sequence of pose 4, load case 'normal' is nan: it must be a whole number",
        ),
        ({"sequence": [0, 1]}, "sequence has shape (2,): it must be (pose, load_case) = (3, 2)"),
        (
            {"reference_joint_position": np.zeros(2)},
            "reference_joint_position has shape (2,): it must be (pose, joint) = (3, 2)",
        ),
        (
            {"reference_force": np.full((3, 3), np.nan)},
            "reference_force x of pose 4 is nan although the status is ok",
        ),
        (
            {"link_joint_position": np.full((3, 2, 2), np.nan)},
            "link_joint_position has no number: leave it out without secondary encoders",
        ),
        (
            {"link_joint_position": np.degrees(keywords()["joint_position"])},
            "link_joint_position joint_1 of pose 4, load case 'normal' is -113.736 rad, beyond",
        ),
        (
            {"link_joint_position": None},
            "reference_link_joint_position needs link_joint_position: there are no links under",
        ),
        (
            {"reference_link_joint_position": [[0.3, np.nan]] * 3},
            "reference_link_joint_position and link_joint_position have different encoders: only",
        ),
        (
            {"reference_joint_position": keywords()["joint_position"][:, 1] + 0.2},
            "reference_joint_position is a median of 0.2",
        ),
        ({"campaigns": ("a", "b")}, "2 campaigns given for 3 poses"),
        ({"campaigns": ("a", "b", "c ")}, "campaign 'c ' must be a printable name"),
    ],
)
def test_what_breaks_the_contract_is_refused_by_name(changes, message):
    with pytest.raises(DatasetError) as caught:
        second(**changes)
    assert str(caught.value).startswith(message)


def test_a_joint_without_secondary_encoder_has_no_link_position():
    links = second_keywords()["link_joint_position"]
    links[..., 1] = np.nan
    data = second(link_joint_position=links, reference_link_joint_position=None)
    assert np.isnan(data.link_joint_position[..., 1]).all()
    assert data.readings(data.joint_names).encoders == (0,)


def test_a_joint_named_like_a_column_of_another_is_refused():
    with pytest.raises(DatasetError, match=r"^joint 'link_a': the name stands for a column of an"):
        dataset(joint_names=("a", "link_a"))


def test_a_unit_of_its_own_is_converted():
    data = second().to_xarray().copy(deep=True)
    data["reference_joint_position"] = np.degrees(data["reference_joint_position"])
    data["reference_joint_position"].attrs["units"] = "deg"
    back = Dataset.from_xarray(data).reference_joint_position
    np.testing.assert_allclose(back, second().reference_joint_position, rtol=1e-15)
    data["reference_joint_position"].attrs["units"] = "mm"
    with pytest.raises(DatasetError, match=r"units 'mm': they must be those of 'joint_position'"):
        Dataset.from_xarray(data)


def test_readings_carry_reference_order_and_campaign():
    readings = second(check=()).readings(JOINTS[::-1])
    assert readings.pose.tolist() == [4, 4, 2, 11, 11]
    assert readings.sequence.tolist() == [0, 1, 4, 7, 2]
    assert readings.campaign.tolist() == ["monday"] * 3 + ["in the winter"] * 2
    assert readings.conditioned
    expected = second_keywords()["reference_joint_position"][[0, 0, 1, 2, 2]][:, ::-1]
    np.testing.assert_array_equal(readings.reference_joint_position, expected)
    assert readings.reference_force[:, 2].tolist() == [-5.0, -5.0, -6.0, 0.0, 0.0]
    assert readings.take([3]).campaign.tolist() == ["in the winter"]


def test_readings_of_the_first_schema_know_nothing_of_it():
    readings = dataset().readings(JOINTS)
    assert (readings.reference_joint_position, readings.sequence, readings.campaign) == (None,) * 3
    assert (readings.conditioned, readings.also_pressed) == (False, None)


def test_a_press_that_slipped_stays_among_what_pressed_on_the_arm():
    data = dataset(status=[[1, 0], [0, 0], [0, 3]])
    presses = data.readings(JOINTS).also_pressed
    assert (presses.pose.tolist(), presses.sequence.tolist()) == ([0, 2], [0, 1])
    np.testing.assert_array_equal(presses.force, data.force[[0, 2], [0, 1]])
    assert data.readings(JOINTS).sequence.tolist() == [1, 0, 1, 0]


def test_a_load_case_that_is_kept_out_of_the_fit_stays_among_what_pressed_on_the_arm():
    data = only("check")
    fitted, checked = data.readings(JOINTS), data.readings(JOINTS, check=True)
    assert set(fitted.load_case) == {"normal"}
    assert set(checked.load_case) == {"north"}
    np.testing.assert_array_equal(fitted.also_pressed.force, checked.force)
    np.testing.assert_array_equal(checked.also_pressed.force, fitted.force)


def test_a_selection_keeps_the_order_in_time():
    data = dataset()
    assert data.select(load_cases=["normal"]).sequence is None
    assert data.select(load_cases=["north", "normal"]).sequence.tolist() == [[1, 0]] * 3
    chosen = second().select(poses=[11, 4], load_cases=["north"])
    assert (chosen.sequence.tolist(), chosen.campaigns) == ([[2], [1]], ("in the winter", "monday"))
    np.testing.assert_array_equal(chosen.reference_force, [[0, 0, 0], [0, 0, -5]])


def test_merged_datasets_keep_their_orders_in_time():
    merged = merge(
        [dataset(), dataset(load_cases=("east", "normal"))], relabel=True, campaigns=("a", "b")
    )
    assert merged.load_cases == ("normal", "north", "east")
    assert merged.sequence.tolist() == [[0, 1, -1]] * 3 + [[1, -1, 0]] * 3
    assert merged.campaigns == ("a",) * 3 + ("b",) * 3


def test_a_dataset_that_names_no_campaign_is_one_beside_others():
    merged = merge([second(), second(campaigns=None)], relabel=True)
    assert merged.campaigns == ("monday", "monday", "in the winter", "1", "1", "1")
    named = merge([second(), second()], relabel=True, campaigns=("old", "new"))
    assert named.campaigns[1:4] == ("old monday", "old in the winter", "new monday")


def test_a_reference_without_a_force_was_unloaded():
    merged = merge([second(reference_force=None), second()], relabel=True)
    assert merged.reference_force[:, 2].tolist() == [0.0, 0.0, 0.0, -5.0, -6.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"conditioned": False}, "datasets 0 and 1 have different histories: conditioned and free"),
        (
            {"gravity": None},
            "datasets 0 and 1 are not of the same robot: attribute 'gravity' is '0.0 m/s2, 9.8",
        ),
        (
            {"reference_joint_position": None},
            "dataset 1 has no variable 'reference_joint",
        ),
    ],
)
def test_datasets_taken_in_another_way_are_not_merged(changes, message):
    with pytest.raises(DatasetError) as caught:
        merge([second(), second(**changes)], relabel=True)
    assert str(caught.value).startswith(message)
