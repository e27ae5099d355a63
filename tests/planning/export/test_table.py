"""The table for spreadsheets: what it says is the plan, in mm and deg."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import FileAccessError
from elastocal.planning.export import write_table
from elastocal.robot import T_from_xyzabc
from elastocal.units import split_column
from support import plans


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    path = write_table(tmp_path_factory.mktemp("table"), plans.plan())
    assert path.name == "plan.csv"
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def numbers(row, *columns):
    return np.array([float(row[column]) for column in columns])


def test_there_is_a_row_a_pose_in_visiting_order(rows):
    poses = plans.plan().poses
    assert [int(row["pose"]) for row in rows] == [pose.id for pose in poses]
    assert [int(row["candidate"]) for row in rows] == [pose.candidate for pose in poses]
    assert [row["seen_by"] for row in rows] == [pose.seen_by for pose in poses]
    np.testing.assert_allclose(
        [numbers(row, "contact_time[s]")[0] for row in rows], [p.contact_time for p in poses]
    )


def test_the_rank_says_when_the_search_chose_a_pose(rows):
    by_rank = sorted(rows, key=lambda row: int(row["search_rank"]))
    assert [int(row["pose"]) for row in by_rank] == list(plans.plan().search.order)


def test_joints_are_in_deg_and_the_rail_in_mm(rows):
    arm = [f"joint_a{i}[deg]" for i in range(1, 7)]
    for row, pose in zip(rows, plans.plan().poses, strict=True):
        for prefix, joints in (("", pose.joints), ("approach_", pose.approach_joints)):
            found = numbers(row, *(prefix + column for column in arm))
            np.testing.assert_allclose(found, np.degrees(joints[1:]), rtol=0, atol=5.1e-7)
            assert float(row[f"{prefix}rail[mm]"]) == pytest.approx(1e3 * joints[0], abs=5.1e-5)


def test_the_tcp_is_written_as_kuka_does(rows):
    for row, pose in zip(rows, plans.plan().poses, strict=True):
        xyz = numbers(row, "x[mm]", "y[mm]", "z[mm]") / 1e3
        abc = np.radians(numbers(row, "a[deg]", "b[deg]", "c[deg]"))
        np.testing.assert_allclose(T_from_xyzabc(*xyz, *abc), pose.T_base_tcp, atol=1e-7)
        normal = numbers(row, "normal_x", "normal_y", "normal_z")
        np.testing.assert_allclose(normal, pose.normal, atol=1e-9)


def test_every_margin_has_its_unit(rows):
    for row, pose in zip(rows, plans.plan().poses, strict=True):
        found = numbers(row, "margin_joint_limits[deg]", "margin_wrist[deg]")
        np.testing.assert_allclose(np.radians(found), list(pose.margins.values()), atol=1e-8)


def test_a_margin_in_another_unit_keeps_it(tmp_path):
    plan = plans.plan()
    checks = tuple(
        replace(check, unit=unit)
        for check, unit in zip(plan.pool.checks, (None, "N", "1"), strict=True)
    )
    plan = replace(plan, pool=replace(plan.pool, checks=checks))
    header = write_table(tmp_path, plan).read_text().splitlines()[0].split(",")
    assert header[-2:] == ["margin_joint_limits[N]", "margin_wrist[1]"]


def test_every_number_but_counts_and_normals_has_a_unit(rows):
    plain = {name for name in rows[0] if split_column(name)[1] is None}
    assert plain == {
        *("pose", "candidate", "search_rank", "seen_by"),
        *("normal_x", "normal_y", "normal_z"),
    }


def test_nothing_is_shown_as_minus_zero(tmp_path):
    plan = plans.plan()
    joints = (-1e-9, -math.radians(1e-9), *plan.poses[0].joints[2:])
    poses = (replace(plan.poses[0], joints=joints), *plan.poses[1:])
    text = write_table(tmp_path, replace(plan, poses=poses)).read_text()
    assert ",0.0000,0.000000," in text
    assert "-0.0000," not in text
    assert "-0.000000" not in text


def test_a_cell_without_trackers_leaves_the_station_empty(tmp_path):
    plan = plans.plan(rail=False)
    poses = tuple(replace(pose, seen_by=None) for pose in plan.poses)
    path = write_table(tmp_path, replace(plan, poses=poses))
    with path.open(newline="") as file:
        assert {row["seen_by"] for row in csv.DictReader(file)} == {""}


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot write .*nowhere.*plan\.csv"):
        write_table(tmp_path / "nowhere", plans.plan())


def test_a_check_that_a_pose_leaves_out_is_an_empty_cell(tmp_path):
    plan = plans.plan()
    poses = (replace(plan.poses[0], margins={"wrist": 0.1}), *plan.poses[1:])
    path = write_table(tmp_path, replace(plan, poses=poses))
    with path.open(newline="") as file:
        column = [row["margin_joint_limits[deg]"] for row in csv.DictReader(file)]
    assert column[0] == ""
    assert all(column[1:])
