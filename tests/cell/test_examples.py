"""The example cells: reachable, and with the figures of the paper."""

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import EXAMPLES, write_example
from elastocal.errors import FileAccessError, SchemaError
from elastocal.planning.surface import (
    ReachableFrom,
    contact_frames,
    distance_to_boundary,
    fit_disk,
    load_surface,
    sample_blue_noise,
    sample_uniform,
)
from elastocal.robot.inverse import inverse_for


def surface_of(cell):
    source = cell.file.surface
    return load_surface(
        cell.surface_path,
        source.metres,
        cell.T_base_surface,
        source.region,
        source.crease_angle,
    )


def engaged(cell, points):
    """The points where the whole disk lies on the surface, clear of its edges."""
    wanted = cell.file.engagement
    distance = distance_to_boundary(surface_of(cell), points)
    return points.take(distance >= wanted.disk_radius + wanted.edge_margin)


def cover(position, d_max):
    """COVER (paper, Pseudocode 2), written out: how many poses until all are within d_max."""
    first = np.argmin(np.linalg.norm(position - position.mean(axis=0), axis=1))
    distance, count = np.linalg.norm(position - position[first], axis=1), 1
    while distance.max() > d_max:
        nearest = np.linalg.norm(position - position[np.argmax(distance)], axis=1)
        distance, count = np.minimum(distance, nearest), count + 1
    return count


@pytest.fixture(params=sorted(EXAMPLES))
def cell(request, tmp_path):
    return load_cell(write_example(tmp_path, request.param)[0])


@pytest.mark.parametrize("sample", [sample_uniform, sample_blue_noise])
@pytest.mark.parametrize("seed", range(3))
def test_the_dome_takes_about_31_poses_at_175_mm(tmp_path, sample, seed):
    cell = load_cell(write_example(tmp_path, "afp")[0])
    assert cell.file.search.d_max == pytest.approx(0.175)
    points = engaged(cell, sample(surface_of(cell), 3600, np.random.default_rng(seed)))
    assert len(points) >= 3000
    assert 28 <= cover(points.position[:3000], cell.file.search.d_max) <= 34


def test_nearly_all_of_the_surface_is_reached_and_takes_the_disk(cell):
    surface, wanted = surface_of(cell), cell.file.engagement
    points = engaged(cell, sample_blue_noise(surface, 150, np.random.default_rng(0)))
    fit = fit_disk(surface, points, wanted.disk_radius)
    assert fit.supported.all()
    assert fit.angle.max() < wanted.normal_tolerance
    poses = contact_frames(points.position, points.normal, np.arange(8) * np.pi / 4)
    away = poses.copy()
    away[..., :3, 3] += wanted.approach_distance * points.normal[:, None]
    reachable = ReachableFrom(inverse_for(cell.robot), cell.external_positions[::3])
    both = [reachable(T.reshape(-1, 4, 4)).reshape(len(points), -1) for T in (poses, away)]
    assert (both[0] & both[1]).any(axis=1).mean() > 0.99


def test_the_block_offers_five_faces(tmp_path):
    cell = load_cell(write_example(tmp_path, "machining")[0])
    points = sample_uniform(surface_of(cell), 500, np.random.default_rng(0))
    assert len(np.unique(np.round(points.normal), axis=0)) == 5
    assert points.normal[:, 2].min() > -0.5
    assert cell.file.search.pose_limit == 15
    assert len(cell.file.trackers) == 2


def test_friction_and_sensor_bear_the_load_cases(cell):
    loads, sensor = cell.file.load_cases, cell.file.sensor
    lateral = np.hypot(*loads.force_tcp[:, :2].T)
    assert np.all(lateral <= loads.friction * loads.fz / loads.safety)
    T = cell.T_sensor_tcp
    force = loads.force_tcp @ T[:3, :3].T
    assert np.all(np.abs(force) < sensor.largest_force)
    assert np.all(np.abs(np.cross(T[:3, 3], force)) < sensor.largest_moment)


def test_examples_are_the_same_bytes_each_time(tmp_path):
    for like in EXAMPLES:
        first, second = (write_example(tmp_path / like / run, like) for run in "ab")
        assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_a_cell_that_is_there_is_not_overwritten_unless_forced(tmp_path):
    cell, mesh = write_example(tmp_path, "afp")
    cell.write_text("mine")
    with pytest.raises(FileAccessError, match="is there already: give --force"):
        write_example(tmp_path, "afp")
    cell.unlink()
    with pytest.raises(FileAccessError, match=r"dome\.stl is there already"):
        write_example(tmp_path, "afp")
    write_example(tmp_path, "afp", force=True)
    assert "schema: elastocal.cell/1" in cell.read_text()
    assert not [p for p in tmp_path.iterdir() if p not in (cell, mesh)]


def test_an_unknown_example_and_a_folder_that_cannot_be_made_are_refused(tmp_path):
    with pytest.raises(SchemaError, match="did you mean 'afp'"):
        write_example(tmp_path, "apf")
    (tmp_path / "file").write_text("")
    with pytest.raises(FileAccessError, match="cannot make folder"):
        write_example(tmp_path / "file" / "inner", "afp")


@pytest.mark.parametrize("like", EXAMPLES)
def test_a_cell_shows_itself_in_a_few_lines(tmp_path, like):
    cell = load_cell(write_example(tmp_path, like)[0])
    for shown in (repr(cell), repr(cell.file)):
        assert repr(cell.name) in shown
        assert len(shown.splitlines()) <= 20
