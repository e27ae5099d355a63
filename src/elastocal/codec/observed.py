"""Which springs each training set tells apart from the others.

A compliance that is not told apart has a value, the smallest one that explains the data, but the
value is no finding (spec section 2, trap 1). Charts of compliances say so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec.data import NONE, CodecData
from elastocal.codec.training import Trainee
from elastocal.elastic import layout
from elastocal.identification import Term, factor, observability, rank, unit_columns
from elastocal.robot import Robot

_SHARE = 1e-6
"""Least part in a direction that the data do not see by which a spring counts as mixed up."""


@dataclass(frozen=True, eq=False)
class Observed:
    """What the training sets of one variant tell apart."""

    variant: str
    determined: BoolArray
    """Whether a training set tells a spring apart from all others, shape
    (cv, n_train, spring)."""
    groups: tuple[tuple[Term, ...], ...]
    """Combinations that even all poses do not see; see `Observability.unobservable`."""

    @property
    def share(self) -> FloatArray:
        """Return the part of the splits that tell a spring apart, shape (n_train, spring)."""
        return np.asarray(self.determined.mean(axis=0))

    @property
    def never(self) -> BoolArray:
        """Return which springs no training set tells apart, shape (spring,)."""
        return np.asarray(~self.determined.any(axis=(0, 1)))


def observed(robot: Robot, data: CodecData, trainees: Sequence[Trainee]) -> tuple[Observed, ...]:
    """Return what the training sets of each variant tell apart.

    Parameters
    ----------
    robot : Robot
        The robot.
    data : CodecData
        The codec.
    trainees : sequence of Trainee
        Of its variants; from `trainees_of`.
    """
    return tuple(_observed(robot, data, each) for each in trainees)


def _observed(robot: Robot, data: CodecData, trainee: Trainee) -> Observed:
    variant, rows = trainee.variant, trainee.triangles.rows[:, :, :-1]
    chosen, size = data.chosen[data.index(variant.name)], trainee.problem.size
    determined = np.array(
        [[_determined(rows[poses[poses != NONE]], size) for poses in row] for row in chosen]
    )
    system = factor(trainee.problem.take(trainee.trains))
    found = observability(system, layout(robot, variant.springs))
    return Observed(variant.name, determined, found.unobservable)


def _determined(triangles: FloatArray, size: FloatArray | float) -> BoolArray:
    """Return which springs the rows of some poses determine, shape (spring,)."""
    rows = unit_columns(triangles, size).rows
    triangle = np.linalg.qr(rows.reshape(-1, rows.shape[2]), mode="r")
    _, s, Vt = np.linalg.svd(triangle, full_matrices=True)
    return np.asarray(np.linalg.norm(Vt[rank(s) :], axis=0) <= _SHARE)
