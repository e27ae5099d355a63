"""The interface of all checks of a calibration pose.

A check is one small class: a name with a unit, the margin of many candidates at once (positive is
fine), and `of`, which makes it from the cell. A check that lacks the numbers to judge is None: it
is left out, with a note in the plan.

Checks judge calibration poses: in contact and, where a check says so, on the straight way off the
surface to the approach pose. They do not apply to HOME and the via poses between the calibration
poses: those are checked for joint limits and collision alone (`elastocal.planning.motion`), not for
singularity, wrist, torque or sight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from elastocal import plugins
from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell import Cell
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface, SurfacePoints
from elastocal.records import StrictModel
from elastocal.results import brief_repr


class Check(Protocol):
    """A condition that a calibration pose must meet."""

    @property
    def name(self) -> str:
        """Name in reports and plan files, e.g. ``joint_limits``."""

    @property
    def unit(self) -> str:
        """Unit of the margin."""

    @property
    def advice(self) -> str:
        """Advice to a user when this check refuses most candidates."""

    def margin(self, postures: Postures) -> FloatArray:
        """Return the distance of each posture from refusal, shape (pose,); positive is allowed."""


class PostureCheck(Check, Protocol):
    """A check that the robot's posture decides."""

    order: ClassVar[int]
    """Place among the checks, in tables and when a pose fails several: the lower the earlier."""
    slow: ClassVar[bool] = False
    """Whether the check uses meshes, so that only the best postures are judged."""
    settings: ClassVar[type[StrictModel]] = StrictModel
    """Settings that a cell file gives a plug-in's check under ``limits.checks``; `of` finds them as
    ``cell.file.limits.checks[name]``."""

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of a cell; None when the cell lacks the numbers to judge."""


class PointCheck(Check, Protocol):
    """A check that the point on the surface decides alone, whatever the robot does."""

    order: ClassVar[int]
    """Place among the checks of points."""

    @classmethod
    def of(cls, cell: Cell, surface: Surface, points: SurfacePoints) -> Self:
        """Return the check of the points sampled on a cell's surface, by which it counts."""

    @property
    def at_points(self) -> FloatArray:
        """Margin of every sampled point, shape (point,)."""

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of the point that each posture touches, shape (pose,)."""
        return self.at_points[postures.point]


@brief_repr
@dataclass(frozen=True, eq=False)
class Checks:
    """All conditions of a pose, in the order of their computing time."""

    point: tuple[PointCheck, ...] = ()
    """Asked of the sampled points, before any robot."""
    quick: tuple[Check, ...] = ()
    """Microseconds a posture: asked of every posture."""
    slow: tuple[Check, ...] = ()
    """Ask meshes: asked of the most promising postures only."""

    @property
    def all(self) -> tuple[Check, ...]:
        """Every check, in this order."""
        return (*self.point, *self.quick, *self.slow)


@brief_repr
@dataclass(frozen=True, eq=False)
class Margins:
    """The margins of many postures under many checks."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    advice: tuple[str, ...]
    margin: FloatArray
    """Shape (check, pose), each in its check's unit."""

    def take(self, index: ArrayLike) -> "Margins":
        """Return the margins of some of the postures (a mask or indices)."""
        return replace(self, margin=self.margin[:, np.asarray(index)])

    @staticmethod
    def joined(parts: "Sequence[Margins]") -> "Margins":
        """Return the margins of several groups of postures under the same checks."""
        return replace(parts[0], margin=np.hstack([part.margin for part in parts]))

    @property
    def passed(self) -> BoolArray:
        """Whether each posture passes every check, shape (pose,). NaN does not pass."""
        return np.asarray(np.all(self.margin > 0.0, axis=0))

    @property
    def quality(self) -> FloatArray:
        """Smallest margin of each posture, each in units of its check's median, shape (pose,).

        For ranking postures: margins have different units. Of no check it is 0.
        """
        if not self.margin.size:
            return np.zeros(self.margin.shape[1])
        typical = np.median(np.abs(self.margin), axis=1, keepdims=True)
        return np.asarray((self.margin / np.where(typical > 0.0, typical, 1.0)).min(axis=0))


def check_margins(checks: Sequence[Check], postures: Postures) -> Margins:
    """Return the margins of postures under all checks."""
    margins = [
        np.asarray(plugins.used("check", each.name, partial(each.margin, postures)), dtype=float)
        for each in checks
    ]
    return Margins(
        tuple(check.name for check in checks),
        tuple(check.unit for check in checks),
        tuple(check.advice for check in checks),
        np.array(margins).reshape(len(checks), len(postures)),
    )
