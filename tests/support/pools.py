"""Small pools of candidate poses with true observation rows, for tests of the pose search."""

from functools import cache

import numpy as np

from elastocal.elastic import ElasticModel, layout
from elastocal.planning.search import Candidates, technique
from elastocal.sim.arm import measurement as scene
from support import cells

SPRINGS = 18
LOAD_CASES = 5
RANK = 15
"""Observable directions of the bearing layout on an arm whose wrist axes meet (trap 1)."""


@cache
def rows(size: int, seed: int = 0, springs: str = "bearing") -> tuple[np.ndarray, np.ndarray]:
    """Return contact points (pose, 3) in m and observation rows (pose, 15, spring)."""
    poses = scene.press_poses(cells.linkage(), size, np.random.default_rng(seed))
    model = ElasticModel(cells.robot(), layout(cells.robot(), springs))
    forces = scene.press_forces(poses.T_base_tcp)
    blocks = model.observation_blocks(poses.joints[:, None], forces)
    return poses.T_base_tcp[:, :3, 3], blocks.reshape(size, 3 * LOAD_CASES, -1)


@cache
def dome(size: int = 60, seed: int = 0, springs: str = "bearing") -> Candidates:
    """Return a pool on a dome; its process rows are at other poses of the same dome."""
    contact, observation = rows(size, seed, springs)
    process = rows(12, seed + 1000, springs)[1]
    return Candidates(contact, observation, process=process.reshape(-1, process.shape[2]))


def scattered(size: int, seed: int = 0) -> Candidates:
    """Return points of a wavy sheet, without rows."""
    u, v = np.random.default_rng(seed).uniform(-1.0, 1.0, (2, size))
    return Candidates(np.column_stack([u, v, 0.3 * np.cos(2.0 * u) * np.sin(v)]))


def choice(name: str) -> list[int]:
    """Return what a technique chooses, in whatever process."""
    return technique(name).search(dome(12), 5, np.random.default_rng(4)).order.tolist()
