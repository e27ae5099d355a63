"""Tensor: a joint that yields about every axis, with coupling between them."""

from itertools import combinations_with_replacement
from typing import Literal

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.elastic.springs.expression import Quantity
from elastocal.elastic.springs.hinge import COMPLIANCE_SCALE, TORSIONAL
from elastocal.elastic.springs.spring import (
    AXES,
    Angles,
    Parameter,
    Spring,
    SpringAxis,
    SpringLoad,
    Tangents,
)
from elastocal.records import record

_ENTRIES = tuple(combinations_with_replacement(range(3), 2))
"""Row and column of the entries on and above the diagonal."""


@record()
class Tensor(Spring):
    """A symmetric compliance tensor in a joint's proximal frame: ``theta = C tau``.

    What springs with one origin amount to whatever their directions: the
    six entries of ``C``. Tilted bearings and housings, whose principal axes are not the joint
    frame's, have entries beside the diagonal.
    """

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of the frame that the tensor sits at, in m."""
    kind: Literal["tensor"] = "tensor"

    units = (TORSIONAL,)

    @classmethod
    def at(cls, axis: SpringAxis) -> "Tensor":
        """Return the tensor at a point; it has no axis of its own."""
        return cls(axis.name, axis.joint, axis.offset)

    @property
    def axes(self) -> tuple[SpringAxis, ...]:
        """The coordinate axes of the joint frame."""
        return tuple(
            SpringAxis(f"{self.name}.{name}", self.joint, axis, offset=self.offset)
            for name, axis in AXES.items()
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The entries on and above the diagonal, in rad/(N·m); those on it are not negative."""
        names = "".join(AXES)
        return tuple(
            Parameter(
                f"{self.name}.{names[i]}{names[j]}",
                self.joint,
                TORSIONAL,
                COMPLIANCE_SCALE,
                0.0 if i == j else -np.inf,
            )
            for i, j in _ENTRIES
        )

    def angles(self, load: SpringLoad[Quantity]) -> Angles[Quantity]:
        """Return the torque that each entry multiplies, by axis."""
        t = load.torque

        def angle(axis: int, entry: tuple[int, int]) -> Quantity:
            row, column = entry
            if axis == row:
                return t[column]
            return t[row] if axis == column else 0.0 * t[axis]

        return tuple(tuple(angle(axis, entry) for entry in _ENTRIES) for axis in range(3))

    def tangents(self, load: SpringLoad[FloatArray]) -> Tangents:
        """Return 1 where an entry couples an axis and a torque, whatever the load."""
        del load
        return tuple(
            tuple(
                tuple(float({axis, torque} == set(entry)) for entry in _ENTRIES)
                for torque in range(3)
            )
            for axis in range(3)
        )
