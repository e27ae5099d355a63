"""Check ``collision``: links and tool keep clear in contact, approaching and on the retreat."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.planning.scene import CollisionScene

SPARE = (1e-3, 1e-2, 3e-2, 1e-1)
"""Distances in m beyond the clearance asked for that are tried. Whether bodies keep a distance
is decided by their bounding volumes, a hundred times faster than the distance is found."""


@dataclass(frozen=True, eq=False)
class CollisionCheck:
    """Largest of the `SPARE` distances that is kept beyond the clearance asked for.

    From contact to the approach pose; in contact the tool is not checked against what it presses
    on, from the first step of the retreat on it is.
    """

    scene: CollisionScene
    keep: float
    """Clearance to keep, in m."""
    steps: int = 3
    """Number of postures from just off the surface to the approach pose, both included."""
    name: str = "collision"
    unit: str = "m"
    advice: str = "move fixtures away, slim the tool's collision shape, or turn the tooling"

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in m; minus ``keep`` when none."""
        travel = postures.q_approach - postures.q
        # The first step of the retreat comes first: it is the one that most often decides.
        ways = [(part, False) for part in np.linspace(1.0 / self.steps, 1.0, self.steps)]
        ways.append((0.0, True))
        margin = np.full(len(postures), -max(self.keep, SPARE[0]))
        left = np.arange(len(postures))
        for spare in reversed(SPARE):
            kept = left
            for part, in_contact in ways:
                q = postures.q[kept] + part * travel[kept]
                kept = kept[self.scene.keeps(q, self.keep + spare, in_contact)]
            margin[kept] = spare
            left = np.setdiff1d(left, kept, assume_unique=True)
        return margin
