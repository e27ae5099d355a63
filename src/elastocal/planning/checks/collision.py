"""Check ``collision``: links and tool keep clear in contact, approaching and on the retreat."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.postures import Postures
from elastocal.planning.scene import CollisionScene


@dataclass(frozen=True, eq=False)
class CollisionCheck:
    """Smallest clearance from contact to the approach pose, less the clearance asked for.

    A lower bound: bounding volumes decide as far as they can; see `CollisionScene.clearance`.

    In contact the tool is not checked against what it presses on; from the first step of the
    retreat on it is.
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
        """Return the margin of each posture, shape (pose,), in m."""
        least = self.scene.clearance(postures.q, True, self.keep)
        travel = postures.q_approach - postures.q
        for part in np.linspace(1.0 / self.steps, 1.0, self.steps):
            clear = self.scene.clearance(postures.q + part * travel, False, self.keep)
            least = np.minimum(least, clear)
        return np.asarray(least - self.keep)
