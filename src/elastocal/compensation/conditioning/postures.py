"""Static postures: raw wrenches of a sensor that carries nothing but its tool."""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import CompensationError
from elastocal.robot import GRAVITY

LEAST = 3
"""Postures; with fewer nothing is left to tell whether the numbers fit."""


@dataclass(frozen=True, eq=False)
class StaticPostures:
    """Raw wrenches with the flange's orientation, nothing touching the tool."""

    R_base_flange: FloatArray
    """Rotation of the flange in base, shape (posture, 3, 3)."""
    force: FloatArray
    """In the sensor's frame, shape (posture, 3), in N."""
    moment: FloatArray
    """In the sensor's frame, about its origin, shape (posture, 3), in N·m."""
    gravity: FloatArray
    """Acceleration of gravity in base, shape (3,), in m/s²."""

    def __len__(self) -> int:
        """Return the number of postures."""
        return len(self.force)

    @property
    def gravity_flange(self) -> FloatArray:
        """Gravity in the flange's axes, shape (posture, 3), in m/s²."""
        return self.gravity @ self.R_base_flange

    @property
    def spread(self) -> float:
        """Largest angle between gravity in two postures, as the flange sees it, in rad."""
        directions = self.gravity_flange / np.linalg.norm(self.gravity)
        return float(np.arccos(np.clip((directions @ directions.T).min(), -1.0, 1.0)))

    def without(self, row: int) -> "StaticPostures":
        """Return the other postures."""
        kept = np.arange(len(self)) != row
        return replace(
            self,
            R_base_flange=self.R_base_flange[kept],
            force=self.force[kept],
            moment=self.moment[kept],
        )

    def read_as(
        self,
        force: FloatArray | None = None,
        moment: FloatArray | None = None,
        R_base_flange: FloatArray | None = None,
    ) -> "StaticPostures":
        """Return the same postures with numbers that are read otherwise."""
        return replace(
            self,
            force=self.force if force is None else force,
            moment=self.moment if moment is None else moment,
            R_base_flange=self.R_base_flange if R_base_flange is None else R_base_flange,
        )


def static_postures(
    R_base_flange: FloatArray,
    force: FloatArray,
    moment: FloatArray,
    gravity: FloatArray | None = None,
) -> StaticPostures:
    """Return checked postures; see `StaticPostures`.

    Raises
    ------
    CompensationError
        If there are fewer than three, shapes differ, or a number is not finite.
    """
    gravity = np.array(GRAVITY) if gravity is None else gravity
    made = StaticPostures(
        *(np.array(x, dtype=float) for x in (R_base_flange, force, moment, gravity))
    )
    n = len(made.force)
    if n < LEAST:
        raise CompensationError(
            f"{n} postures: the tool's weight needs at least {LEAST}, and better 8 or more that"
            " turn the sensor about two axes"
        )
    shapes = (made.R_base_flange.shape, made.force.shape, made.moment.shape, made.gravity.shape)
    if shapes != ((n, 3, 3), (n, 3), (n, 3), (3,)):
        raise CompensationError(f"postures of shapes {shapes}: rotation, force, moment and gravity")
    for name in ("R_base_flange", "force", "moment", "gravity"):
        if not np.all(np.isfinite(getattr(made, name))):
            raise CompensationError(f"{name} of the postures holds a value that is not finite")
    return made
