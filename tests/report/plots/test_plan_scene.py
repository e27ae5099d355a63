"""What the view of a plan shows."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.report.plots import plan_view
from elastocal.viewer import Dots, Strokes, Tags
from elastocal.viewer.scene import Paint, rail_solid


@pytest.fixture(scope="module")
def view(cell, block, plan, pool):
    return plan_view(cell, block, plan, pool)


def layer(view, start):
    (found,) = [each for each in view.scene.layers if each.label.startswith(start)]
    return found


def test_every_layer_holds_something(view):
    for each in view.scene.layers:
        assert each.parts or each.name == "sight", each.label
        for part in each.parts:
            match part:
                case Paint():
                    assert len(part.solid.faces)
                case Strokes():
                    assert np.isfinite(part.ends).all()
                case Dots() | Tags():
                    assert np.isfinite(part.at).all()


def test_line_of_sight_joins_marker_and_station(view, cell, plan):
    marker = np.append(cell.file.marker.position_tcp, 1.0)
    stations = {station.name: station.position_base for station in cell.file.trackers}
    for pose, (start, end) in zip(plan.poses, view.sight[1:], strict=True):
        np.testing.assert_allclose(start, (cell.robot.forward(pose.joints) @ marker)[:3], atol=1e-9)
        np.testing.assert_allclose(end, stations[pose.seen_by], atol=1e-9)


def test_home_has_no_line_of_sight(view):
    assert np.isnan(view.sight[0]).all()


def test_robot_moves_from_posture_to_posture_and_its_foot_stays(view, plan):
    parts = [each.part for each in layer(view, "Robot").parts]
    assert parts == list(range(view.scene.places.shape[1]))
    assert len(view.scene.places) == len(plan.poses) + 1
    for before, after in pairwise(view.scene.places):
        np.testing.assert_array_equal(before[0], after[0])
        assert np.abs(after[-1] - before[-1]).max() > 0.05


def test_way_runs_from_home_through_every_approach_pose_and_back(view, cell, plan):
    ends = layer(view, "Path").parts[0].ends
    np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
    home = cell.robot.forward(plan.robot.home)[:3, 3]
    np.testing.assert_allclose([ends[0, 0], ends[-1, 1]], [home, home], atol=1e-9)
    stops = cell.robot.forward([pose.approach_joints for pose in plan.poses])[:, :3, 3]
    assert np.linalg.norm(ends[:, None, 1] - stops, axis=2).min(axis=0).max() < 1e-9


def test_a_wide_floor_does_not_send_the_camera_far_away(view):
    for camera in view.scene.cameras:
        assert np.linalg.norm(camera.eye - camera.centre) < 20.0


def test_no_camera_is_below_the_floor_nor_looks_up(view):
    for camera in view.scene.cameras:
        assert camera.eye @ view.scene.up > view.scene.floor
        assert (camera.eye - camera.centre) @ view.scene.up > 0.0


@pytest.mark.parametrize("number", range(5))
def test_camera_sees_all_of_the_tooling(view, block, number):
    camera = view.scene.cameras[number]
    seen = block.mesh.vertices - camera.eye
    ahead = (camera.centre - camera.eye) / np.linalg.norm(camera.centre - camera.eye)
    right = np.cross(ahead, view.scene.up) / np.linalg.norm(np.cross(ahead, view.scene.up))
    depth = seen @ ahead
    assert depth.min() > 0.0
    assert np.abs(seen @ np.cross(right, ahead) / depth).max() < np.tan(np.radians(22.5))
    assert np.abs(seen @ right / depth).max() < 1.5 * np.tan(np.radians(22.5))


def test_a_cell_without_stations_has_no_line_of_sight(cell, block, plan, pool):
    unseen = tuple(replace(pose, seen_by=None) for pose in plan.poses)
    view = plan_view(cell, block, replace(plan, poses=unseen), pool)
    assert not any(each.name == "sight" for each in view.scene.layers)
    assert np.isnan(view.sight).all()


def test_a_hint_tells_margins_with_units_and_times(view):
    hint = layer(view, "Poses").parts[0].hints[2]
    for wanted in ("pose 2", "wrist: ", "°", "1 min 02 s in contact"):
        assert wanted in hint
    assert "rank" not in hint


def test_dots_and_tags_have_a_hint_each(view):
    for each in view.scene.layers:
        for part in each.parts:
            if isinstance(part, Dots | Tags):
                assert len(part.hints) == len(part.at)


class TestRail:
    @pytest.fixture
    def on_rail(self, tmp_path_factory):
        folder = tmp_path_factory.mktemp("afp")
        write_example(folder, "afp")
        return load_cell(folder / "cell.yaml")

    def test_it_is_drawn_below_the_foot_along_the_whole_travel(self, on_rail):
        rail, solid = on_rail.file.robot.rail, rail_solid(on_rail)
        along = np.array(rail.axis) / np.linalg.norm(rail.axis)
        at = (solid.vertices - rail.pose.T[:3, 3]) @ along
        low, high = rail.travel
        assert at.min() < low
        assert at.max() > high
        height = (solid.vertices - rail.pose.T[:3, 3]) @ rail.pose.T[:3, 2]
        assert height.max() == pytest.approx(0.0, abs=1e-9)

    def test_a_robot_without_a_rail_has_none(self, cell):
        assert (rail_solid(cell) is None) is (cell.file.robot.rail is None)
