"""The example cells, from their files to a pool of postures."""

from functools import cache

import numpy as np
import pytest

from elastocal.cell import TOOLING, load_cell
from elastocal.cell.examples import write_example
from elastocal.planning import cell_surface, collision_scene
from elastocal.planning.pool import PoolBuilder
from elastocal.planning.surface import sample_uniform

POINTS = 150


@cache
def planned(like, folder):
    write_example(folder, like)
    cell = load_cell(folder / "cell.yaml")
    surface = cell_surface(cell)
    workshop = PoolBuilder.of(cell, surface)
    points = sample_uniform(surface, POINTS, np.random.default_rng(0))
    stands = workshop.rank(points.take(np.arange(32)))
    return cell, surface, points, workshop.pool(stands, points)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return {like: tmp_path_factory.mktemp(like) for like in ("afp", "machining")}


@pytest.mark.parametrize("like", ["afp", "machining"])
class TestExample:
    @pytest.mark.slow
    def test_most_points_have_a_posture_and_the_edge_refuses_most_others(self, like, folders):
        *_, pool = planned(like, folders[like])
        assert len(pool.postures) > 0.65 * POINTS
        assert pool.bottleneck == "edge"

    def test_every_posture_passes_every_check(self, like, folders):
        *_, pool = planned(like, folders[like])
        assert np.all(pool.margins.passed)
        assert {"edge", "flatness", "torque", "sensor", "collision", "sight"} <= set(
            pool.margins.names
        )

    def test_every_posture_presses_where_it_says(self, like, folders):
        cell, _, points, pool = planned(like, folders[like])
        T = cell.robot.forward(pool.postures.q)
        chosen = pool.postures.point
        np.testing.assert_allclose(T[:, :3, 3], points.position[chosen], atol=1e-8)
        np.testing.assert_allclose(T[:, :3, 2], -points.normal[chosen], atol=1e-8)

    def test_the_tool_touches_the_tooling_in_contact_only(self, like, folders):
        cell, surface, _, pool = planned(like, folders[like])
        scene = collision_scene(cell, surface)
        few = pool.postures.take(np.arange(5))
        assert np.all(scene.keeps(few.q, 1e-3, -np.inf))
        assert np.all(scene.keeps(few.q_approach, 1e-3))
        assert TOOLING in {body.name for body in scene.obstacles}


def test_machining_presses_on_at_least_four_faces(folders):
    *_, pool = planned("machining", folders["machining"])
    faces = {tuple(np.round(normal).astype(int)) for normal in pool.postures.normal}
    assert len(faces) >= 4
