"""Unloaded readings of made-up stations: a dome of poses in rows, as a tour visits them."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.procedure.registration import UnloadedReadings

LEVER = np.array([0.02, 0.05, -0.06])
"""Marker in the tcp frame, in m."""
ROWS = 5
SIGMA = 5e-6


@dataclass(frozen=True, eq=False)
class Made:
    """Readings and what they were made from."""

    readings: UnloadedReadings
    T_base_tracker: np.ndarray


def station(seed: int = 0) -> np.ndarray:
    """Return a place of a tracker in base, shape (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    T[:3, 3] = (4.0, -2.0, 1.0 + seed)
    return T


def poses(rng: np.random.Generator, count: int, tilt: float = 0.35) -> np.ndarray:
    """Return tool frames on a dome of 1.6 m, shape (count, 4, 4), row by row."""
    across = rng.uniform(-0.8, 0.8, count)
    along = rng.uniform(-0.8, 0.8, count)
    row = ((along + 0.8) / 1.6 * ROWS).astype(int)
    order = np.lexsort((across * (-1.0) ** row, row))
    x, y = across[order], along[order]
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, 3] = np.stack([2.0 + x, y, 0.6 - 0.2 * (x**2 + y**2)], axis=1)
    turns = rng.uniform(-1.0, 1.0, (count, 3)) * (tilt, tilt, 4.0 * tilt) + (np.pi, 0.0, 0.0)
    T[:, :3, :3] = Rotation.from_euler("xyz", turns).as_matrix()
    return T


def made(
    rng: np.random.Generator,
    count: int = 31,
    noise: float = 50e-6,
    tilt: float = 0.35,
    T_base_tcp: np.ndarray | None = None,
) -> Made:
    """Return readings of one station that does not move, by a robot without errors."""
    T = poses(rng, count, tilt) if T_base_tcp is None else T_base_tcp
    count, place = len(T), station()
    marker = T[:, :3, 3] + T[:, :3, :3] @ LEVER + noise * rng.normal(size=(count, 3))
    readings = UnloadedReadings(
        pose=np.arange(count),
        station=("A",) * count,
        position=(marker - place[:3, 3]) @ place[:3, :3],
        sigma=np.full(count, SIGMA),
        T_base_tcp=T,
        robot_error=np.zeros((count, 3, 0)),
    )
    return Made(readings, place)


def shifted(of: Made, rows: slice | list[int], shift: tuple[float, float, float]) -> Made:
    """Return readings of which some are shifted, in base, in m."""
    position = of.readings.position.copy()
    position[rows] += of.T_base_tracker[:3, :3].T @ np.array(shift)
    return Made(replace(of.readings, position=position), of.T_base_tracker)
