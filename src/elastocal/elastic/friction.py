"""Friction memory: what torque friction bears depends on the way the torque took.

A stop operator (the building block of Prandtl-Ishlinskii hysteresis) follows the changes of a
torque until it slides at its limit:

    s_k = clip(s_{k-1} + tau_k - tau_{k-1}, -r, r).

A free motion of the joint wears the memory off: after it the state is near zero, as far as is
known. A press that changes the torque by more than ``2 r`` wipes out whatever came before.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic.springs import Spring
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class FrictionElements:
    """The friction elements of all springs of a model."""

    axis: IndexArray
    """Axis, counted through the springs, whose torque each element sees, shape (element,)."""
    limit: FloatArray
    """Torque at which each slides, shape (element,), in N·m or N."""

    @classmethod
    def of(cls, springs: Sequence[Spring]) -> "FrictionElements":
        """Return the elements of springs, in their order."""
        first = np.cumsum([0, *(len(spring.axes) for spring in springs)])
        pairs = [
            (first[index], limit)
            for index, spring in enumerate(springs)
            for limit in spring.friction_limits
        ]
        axis, limit = (np.array(part) for part in zip(*pairs, strict=True)) if pairs else ([], [])
        return cls(np.array(axis, dtype=np.intp), np.array(limit, dtype=float))

    def __len__(self) -> int:
        return len(self.limit)

    def press(self, torque: FloatArray) -> FloatArray:
        """Return the states after a press straight from rest.

        Parameters
        ----------
        torque : ndarray, shape (..., axis)
            Change of the torque about each axis since friction bore none, in N·m.

        Returns
        -------
        ndarray, shape (..., element)
        """
        return np.clip(torque[..., self.axis], -self.limit, self.limit)

    def path(self, torque: FloatArray, start: FloatArray | None = None) -> FloatArray:
        """Return the states along a way.

        Parameters
        ----------
        torque : ndarray, shape (step, ..., axis)
            Total torque about each axis at each step, in order in time, in N·m.
        start : ndarray, shape (..., element), optional
            States at the first step; zero, free, by default.

        Returns
        -------
        ndarray, shape (step, ..., element)
            States, the first being the start.
        """
        seen = torque[..., self.axis]
        states = np.zeros(seen.shape)
        if start is not None:
            states[0] = start
        for step, change in enumerate(np.diff(seen, axis=0), start=1):
            states[step] = np.clip(states[step - 1] + change, -self.limit, self.limit)
        return states
