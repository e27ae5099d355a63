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
from numpy.typing import ArrayLike

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
        axis = [first[k] for k, spring in enumerate(springs) for _ in spring.friction_limits]
        limit = [limit for spring in springs for limit in spring.friction_limits]
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

    def visits(
        self,
        weight: FloatArray,
        load: FloatArray,
        visit: ArrayLike | None = None,
        memory: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the states under loads, those of one visit one after the other in time.

        Parameters
        ----------
        weight, load : ndarray, shape (row, axis)
            Torque of the arm's own weight and of the load about each axis, in N·m.
        visit : array_like, shape (row,), optional
            Rows with one value are a visit: free before its first row, under the weight alone.
            Default: all rows are one.
        memory : ndarray, shape (element,), optional
            What the visit of the first row remembers from before: states less the whole torque.

        Returns
        -------
        states : ndarray, shape (row, element)
            In N·m.
        memory : ndarray, shape (element,)
            After the last row.
        """
        total = weight + load
        states = np.zeros((len(total), len(self)))
        if not len(total):
            return states, np.zeros(len(self)) if memory is None else memory
        labels = np.zeros(len(total)) if visit is None else np.asarray(visit)
        _, number = np.unique(labels, return_inverse=True)
        order = np.argsort(number, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(number[order])) + 1):
            remembers = memory is not None and rows[0] == 0
            before = memory if remembers else -weight[rows[0], self.axis]
            way = np.concatenate([np.zeros((1, total.shape[1])), total[rows]])
            states[rows] = self.path(way, before)[1:]
        return states, states[-1] - total[-1, self.axis]
