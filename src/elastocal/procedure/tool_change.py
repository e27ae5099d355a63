"""Whether the tool, or the sensor's zero, changed in the middle of a run.

One mass and one bias are fitted to the whole run. A step of the mass at some reading is one more
unknown; the best place for it is the one that takes most off the sum of squares, and an F test,
with the number of places allowed for, says whether that is more than chance.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from elastocal.arrays import FloatArray

CHANCE = 1e-4
"""Probability of a step that is only chance, over all places, below which it is believed."""
SHARE = 0.05
"""Smallest step that is told, as a share of the tool's mass."""
_DEPENDENT = 1e-8
"""Part of a column that the others leave over, below which it says nothing of its own."""


@dataclass(frozen=True)
class ToolChange:
    """A step of the tool's mass."""

    reading: int
    """First unloaded reading with the new mass, from 0."""
    mass: float
    """Change, in kg."""


def tool_change(
    blocks: FloatArray, force: FloatArray, gravity: FloatArray, nominal_mass: float
) -> ToolChange | None:
    """Return the step of the mass that the unloaded readings show; None: one mass fits them all.

    Parameters
    ----------
    blocks : ndarray, shape (reading, 3, unknown)
        Equations of the forces with one mass.
    force : ndarray, shape (reading, 3)
        Sensor frame, in N.
    gravity : ndarray, shape (reading, 3)
        In the sensor's axes, in m/s².
    nominal_mass : float
        Mass of the tool by the cell file, in kg.
    """
    count, free = len(force), force.size - blocks.shape[2] - 1
    if free < 1:
        return None
    A, b = blocks.reshape(force.size, -1), force.ravel()
    u, s, _ = np.linalg.svd(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300), full_matrices=False)
    basis = u[:, s > _DEPENDENT * s[0]]
    after = np.arange(count)[:, None] >= np.arange(1, count)
    steps = (gravity[:, :, None] * after[:, None, :]).reshape(force.size, -1)
    own = steps - basis @ (basis.T @ steps)
    left = b - basis @ (basis.T @ b)
    squares = (own**2).sum(axis=0)
    told = squares > _DEPENDENT * (steps**2).sum(axis=0)
    change = np.where(told, own.T @ left / np.where(told, squares, 1.0), 0.0)
    gain = change**2 * squares
    best = int(np.argmax(gain))
    rest = max(float(left @ left - gain[best]), np.finfo(float).tiny)
    chance = (count - 1) * stats.f.sf(gain[best] / (rest / free), 1, free)
    if not (chance < CHANCE and abs(change[best]) > SHARE * nominal_mass):
        return None
    return ToolChange(best + 1, float(change[best]))
