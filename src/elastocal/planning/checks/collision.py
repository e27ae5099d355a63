"""Check ``collision``: links and tool keep clear in contact, approaching and on the retreat."""

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures, retreat_joints
from elastocal.planning.scene import CollisionScene, collision_scene
from elastocal.planning.surface import Surface
from elastocal.wording import phrase

_DISTANCES_BEYOND = (1e-3, 1e-2, 3e-2, 1e-1)
"""Distances in m beyond the clearance asked for that are tried. Whether bodies keep a distance
is decided by their bounding volumes, a hundred times faster than the distance is found."""

_STEP = 0.035
"""Largest distance in m between the places on the retreat that are looked at."""


@dataclass(frozen=True, eq=False)
class CollisionCheck(PostureCheck):
    """Largest of 1, 10, 30 and 100 mm that is kept beyond the clearance asked for.

    In contact, and at places on the straight way to the approach pose. In contact the tool is not
    checked against what it presses on; near contact it must not touch it; from the first step of
    the retreat on it keeps the clearance from it too.
    """

    scene: CollisionScene
    clearance: float
    """Clearance to keep, in m."""
    approach: float
    """Distance of the approach pose from the surface, in m."""
    near: float
    """Distance from the surface at which the tool stops before contact, in m."""
    name: str = "collision"
    unit: str = "m"
    advice: str = phrase("move fixtures away, slim the tool's collision shape, or turn the tooling")
    order: ClassVar[int] = 90
    slow: ClassVar[bool] = True

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self:
        """Return the check of robot and tool among tooling and fixtures."""
        engagement = cell.file.engagement
        return cls(
            collision_scene(cell, surface),
            cell.file.limits.clearance,
            engagement.approach_distance,
            engagement.near_contact,
        )

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in m; minus ``clearance`` when none."""
        margin = np.full(len(postures), -max(self.clearance, _DISTANCES_BEYOND[0]))
        left = np.arange(len(postures))
        places = self._places(postures)
        for beyond in reversed(_DISTANCES_BEYOND):
            kept = left
            for q, pressed in places:
                kept = kept[self.scene.keeps(q[kept], self.clearance + beyond, pressed)]
            margin[kept] = beyond
            left = np.setdiff1d(left, kept, assume_unique=True)
        return margin

    def nearest(self, postures: Postures) -> str:
        """Return which bodies are too near at most of some postures, and how near they come.

        Judged in contact and at the approach pose.
        """
        met: dict[tuple[str, str], list[float]] = {}
        for q, q_approach in zip(postures.q, postures.q_approach, strict=True):
            both = (q, True), (q_approach, False)
            near = [float(self.scene.distances(at[None], pressed).min()) for at, pressed in both]
            at, pressed = both[int(np.argmin(near))]
            met.setdefault(self.scene.nearest(at, pressed), []).append(min(near))
        (first, second), distances = max(met.items(), key=lambda each: len(each[1]))
        return phrase(
            "{first} and {second} come as near as {distance} mm (must be above {clearance} mm)",
            first=first,
            second=second,
            distance=f"{1e3 * min(distances):.3g}",
            clearance=f"{1e3 * self.clearance:.3g}",
        )

    def _places(self, postures: Postures) -> list[tuple[FloatArray, float | None]]:
        """Return joints at each place, with the distance of the tool from what it presses on.

        The first step of the retreat comes first: it most often decides.
        """
        steps = max(2, math.ceil(self.approach / _STEP))
        robot = self.scene.robot
        retreat = [retreat_joints(robot, postures, step / steps) for step in range(1, steps + 1)]
        near = retreat_joints(robot, postures, self.near / self.approach)
        return [*((q, None) for q in retreat), (near, 0.0), (postures.q, -math.inf)]
