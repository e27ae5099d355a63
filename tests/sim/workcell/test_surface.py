from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.sim.workcell._contact import TrueSurface
from support.simulated import example_cell, places

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
PLATE = TrueSurface(SQUARE[[[0, 1, 2], [0, 2, 3]]])
DOWN = np.array([0.0, 0.0, -1.0])


def test_a_ray_meets_the_nearest_point_and_its_normal_looks_back():
    hit = PLATE.hit(np.array([0.5, 0.5, 0.3]), DOWN, 1.0)
    assert hit.distance == pytest.approx(0.3)
    np.testing.assert_allclose(hit.normal, (0, 0, 1))
    from_below = PLATE.hit(np.array([0.5, 0.5, -0.2]), -DOWN, 1.0)
    np.testing.assert_allclose(from_below.normal, (0, 0, -1))


@pytest.mark.parametrize(
    ("origin", "reach"), [((0.5, 0.5, 0.3), 0.2), ((1.5, 0.5, 0.3), 1.0), ((0.5, 0.5, -0.1), 1.0)]
)
def test_a_ray_too_short_beside_or_from_behind_meets_nothing(origin, reach):
    assert PLATE.hit(np.array(origin), DOWN, reach) is None


def test_a_ray_along_the_surface_meets_nothing():
    assert PLATE.hit(np.array([-1.0, 0.5, 0.0]), np.array([1.0, 0.0, 0.0]), 9.0) is None


@pytest.mark.parametrize("like", ["afp", "machining"])
def test_the_example_surface_stands_where_the_planner_finds_it(like):
    cell = example_cell(like)
    surface = TrueSurface.of(cell)
    for place in places(like):
        T = cell.robot.forward(place.q_approach)
        hit = surface.hit(T[:3, 3], T[:3, 2], 1.0)
        assert hit.distance == pytest.approx(cell.file.engagement.approach_distance, abs=1e-6)
        np.testing.assert_allclose(hit.normal, place.normal, atol=0.05)


def test_the_tooling_can_stand_elsewhere_than_the_cell_file_says():
    moved = example_cell(simulation={"contact": {"surface_offset": ["0 m", "0 m", "4 mm"]}})
    shift = TrueSurface.of(moved).corners - TrueSurface.of(example_cell()).corners
    np.testing.assert_allclose(shift, np.broadcast_to((0, 0, 4e-3), shift.shape), atol=1e-12)


def test_a_mesh_that_cannot_be_read_is_named():
    cell = example_cell()
    (cell.path.parent / "broken.stl").write_bytes(b"no mesh")
    entry = cell.file.surface.model_copy(update={"file": "broken.stl"})
    broken = replace(cell, file=cell.file.model_copy(update={"surface": entry}))
    with pytest.raises(SchemaError, match=r"broken\.stl"):
        TrueSurface.of(broken)
