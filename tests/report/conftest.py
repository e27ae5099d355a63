import dataclasses
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.planning.surface import load_surface, sample_uniform
from elastocal.planning.surface.mesh import TriangleMesh
from elastocal.planning.surface.surface import build_surface
from support import plans


@pytest.fixture(scope="session")
def cell(tmp_path_factory):
    """The machining example: two stations of the names that the small plan uses, a wide floor."""
    folder = tmp_path_factory.mktemp("machining")
    write_example(folder, "machining")
    return load_cell(folder / "cell.yaml")


@pytest.fixture(scope="session")
def block(cell):
    entry = cell.file.surface
    return load_surface(cell.surface_path, entry.metres, cell.T_base_surface, entry.region)


@pytest.fixture(scope="session")
def ball():
    """A closed smooth surface, which no net unfolds."""
    mesh = trimesh.creation.icosphere(2, 0.4)
    T = np.eye(4)
    T[:3, 3] = 1.5, 0.3, 0.8
    return build_surface(TriangleMesh(np.array(mesh.vertices), np.array(mesh.faces)), T)


@pytest.fixture(scope="session")
def plan():
    return plans.plan(rail=False)


@pytest.fixture(scope="session")
def pool():
    return plans.pool(rail=False)


@pytest.fixture(scope="session")
def moved_onto():
    """Return a function that moves the small plan and its pool onto a surface."""

    def move(surface, plan, pool):
        points = sample_uniform(surface, len(pool), np.random.default_rng(0))
        poses = tuple(
            replace(pose, tcp_position=tuple(points.position[pose.candidate]))
            for pose in plan.poses
        )
        moved = dataclasses.replace(pool, contact=points.position, normal=points.normal)
        return replace(plan, poses=poses), moved

    return move
