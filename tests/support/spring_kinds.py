"""Kinds of springs that only tests know: what the interface carries beside hinges.

Not for calibrations: they hold the contract of `Spring` open for kinds to come, with several
parameters, a law that is not linear in the load, and several axes.
"""

from typing import Literal

import numpy as np

from elastocal.elastic import OneAxisSpring, Parameter, Spring, SpringAxis, SpringLoad, Unit
from elastocal.elastic.springs import Quantity, atan
from elastocal.records import record

TORSIONAL = Unit("rad/(N*m)", "µrad/(N·m)", 1e6, "MN·m/rad")


@record()
class SaturatingGear(OneAxisSpring):
    """A gear that stiffens: ``theta = sum_k c_k T_k atan(t / T_k)``."""

    thresholds: tuple[float, ...] = (300.0, 1000.0)
    """``T_k``, in N·m."""
    kind: Literal["saturating"] = "saturating"

    units = (TORSIONAL,)

    @property
    def parameters(self):
        names = (f"{self.name}.{threshold:g}" for threshold in self.thresholds)
        return tuple(Parameter(name, self.joint, TORSIONAL, 1e-6) for name in names)

    def angles(self, load: SpringLoad[Quantity]):
        (t,) = load.torque
        return (tuple(T * atan(t / T) for T in self.thresholds),)

    def tangents(self, load):
        (t,) = load.torque
        return ((tuple(1.0 / (1.0 + np.square(t / T)) for T in self.thresholds),),)


@record()
class JointTensor(Spring):
    """A symmetric compliance about three axes of a joint's frame: ``theta = C t``."""

    kind: Literal["tensor"] = "tensor"

    units = (TORSIONAL,)
    _PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))

    @classmethod
    def at(cls, axis: SpringAxis) -> "JointTensor":
        return cls(axis.name, axis.joint)

    @property
    def axes(self):
        return tuple(
            SpringAxis(f"{self.name}.{name}", self.joint, tuple(np.eye(3)[k]))
            for k, name in enumerate("xyz")
        )

    @property
    def parameters(self):
        return tuple(
            Parameter(
                f"{self.name}.{'xyz'[i]}{'xyz'[j]}",
                self.joint,
                TORSIONAL,
                1e-6,
                0.0 if i == j else -np.inf,
            )
            for i, j in self._PAIRS
        )

    def angles(self, load: SpringLoad[Quantity]):
        t = load.torque

        def angle(axis: int, pair: tuple[int, int]):
            i, j = pair
            return t[j] if axis == i else t[i] if axis == j else 0.0 * t[axis]

        return tuple(tuple(angle(axis, pair) for pair in self._PAIRS) for axis in range(3))

    def tangents(self, load):
        del load
        return tuple(
            tuple(
                tuple(float({axis, other} == set(pair)) for pair in self._PAIRS)
                for other in range(3)
            )
            for axis in range(3)
        )
