"""The figure behind the page."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from elastocal.report.plots import (
    plan_view,
)


@pytest.fixture(scope="module")
def view(cell, block, plan, pool):
    return plan_view(cell, block, plan, pool)


def _points(trace):
    return np.column_stack([trace.x, trace.y, trace.z])


def test_every_trace_holds_points(view):
    for trace in view.figure.data:
        assert np.isfinite(_points(trace)).any(), trace.name


def test_line_of_sight_joins_marker_and_station(view, cell, plan):
    marker = np.append(cell.file.marker.position_tcp, 1.0)
    stations = {station.name: station.position_base for station in cell.file.trackers}
    for pose, frame in zip(plan.poses, view.figure.frames[1:], strict=True):
        start, end, gap = _points(frame.data[1])
        np.testing.assert_allclose(start, (cell.robot.forward(pose.joints) @ marker)[:3], atol=1e-5)
        np.testing.assert_allclose(end, stations[pose.seen_by], atol=1e-5)
        assert np.isnan(gap).all()


def test_home_has_no_line_of_sight(view):
    assert np.isnan(_points(view.figure.frames[0].data[1])).all()


def test_robot_moves_from_frame_to_frame(view):
    robots = [_points(frame.data[0]) for frame in view.figure.frames]
    assert view.figure.data[0].name == "robot"
    np.testing.assert_array_equal(robots[1], _points(view.figure.data[0]))
    for before, after in pairwise(robots):
        assert np.abs(after - before).max() > 0.05


def test_way_runs_from_home_through_every_approach_pose_and_back(view, cell, plan):
    (way,) = [_points(trace) for trace in view.figure.data if trace.name == "way"]
    home = cell.robot.forward(plan.robot.home)[:3, 3]
    np.testing.assert_allclose(way[[0, -1]], [home, home], atol=1e-5)
    stops = cell.robot.forward([pose.approach_joints for pose in plan.poses])[:, :3, 3]
    gap = np.linalg.norm(way[:, None] - stops, axis=2).min(axis=0)
    assert gap.max() < 1e-5


def test_a_wide_floor_does_not_widen_the_view(view, cell):
    scene = view.figure.layout.scene
    ranges = np.array([scene[f"{axis}axis"].range for axis in "xyz"])
    assert np.ptp(ranges, axis=1).max() < 9.0
    for station in cell.file.trackers:
        assert np.all(
            (ranges[:, 0] < station.position_base) & (station.position_base < ranges[:, 1])
        )


def test_axes_have_one_scale_and_name_their_unit(view):
    scene = view.figure.layout.scene
    sides = [np.ptp(scene[f"{axis}axis"].range) for axis in "xyz"]
    ratio = [scene.aspectratio[axis] for axis in "xyz"]
    np.testing.assert_allclose(np.divide(ratio, sides), ratio[0] / sides[0])
    assert [scene[f"{axis}axis"].title.text for axis in "xyz"] == [
        f"{axis} of base in m" for axis in "xyz"
    ]


@pytest.mark.parametrize("name", ["Robot and tooling", "Tooling", "Whole cell"])
def test_camera_sees_all_of_the_tooling(view, block, name):
    scene, camera = view.figure.layout.scene, view.cameras[name]
    low, high = np.array([scene[f"{axis}axis"].range for axis in "xyz"]).T
    centre, eye, up = (
        np.array([camera[part][axis] for axis in "xyz"]) for part in ("center", "eye", "up")
    )
    seen = (block.mesh.vertices - 0.5 * (low + high)) / np.cbrt(np.prod(high - low)) - eye
    ahead = (centre - eye) / np.linalg.norm(centre - eye)
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    depth = seen @ ahead
    assert depth.min() > 0.0
    assert np.abs(seen @ np.cross(right, ahead) / depth).max() < np.tan(np.radians(22.5))
    assert np.abs(seen @ right / depth).max() < 1.5 * np.tan(np.radians(22.5))


def test_a_cell_without_stations_has_no_line_of_sight(cell, block, plan, pool):
    unseen = tuple(replace(pose, seen_by=None) for pose in plan.poses)
    view = plan_view(cell, block, replace(plan, poses=unseen), pool)
    assert "line of sight" not in {trace.name for trace in view.figure.data}
    assert all(len(frame.data) == 1 for frame in view.figure.frames)
    assert all(np.isfinite(_points(trace)).any() for trace in view.figure.data)


def test_hover_tells_rank_margins_with_units_and_times(view, plan):
    (poses,) = [trace for trace in view.figure.data if trace.name == "poses"]
    text = poses.hovertext[2]
    rank = plan.search.order.index(2)
    for wanted in ("<b>pose 2</b>", f"search rank {rank}", "wrist: ", "°", "1 min 02 s in contact"):
        assert wanted in text
