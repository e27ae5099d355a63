"""The training sets of a finished codec: the springs that they determine, and their indices.

A compliance that is not separately observable has a value, the smallest one that explains the data,
but the value means nothing by itself (docs/explanation/observability.md). Charts of compliances say
so.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.codec._prepared import PreparedVariant, prepared_variants
from elastocal.codec.data import NO_POSE, CodecData
from elastocal.codec.indices import Correlation, IndexValues, correlate, index_values
from elastocal.dataset import Readings
from elastocal.identification import Term, column_scaling, factor, observability, rank
from elastocal.results import brief_repr
from elastocal.robot import Robot

_SHARE = 1e-6
"""Least part in a direction that the data do not see by which a spring counts as mixed up."""


@brief_repr
@dataclass(frozen=True, eq=False)
class SpringObservability:
    """Springs that the training sets of one variant determine."""

    variant: str
    determined: BoolArray
    """Whether a training set determines a spring separately, shape (cv, n_train, spring)."""
    groups: tuple[tuple[Term, ...], ...]
    """Combinations that even all poses do not see; see `Observability.unobservable`."""

    @property
    def share(self) -> FloatArray:
        """Return the share of the splits that determine a spring, shape (n_train, spring)."""
        return np.asarray(self.determined.mean(axis=0))

    @property
    def never(self) -> BoolArray:
        """Return the springs that no training set determines, shape (spring,)."""
        return np.asarray(~self.determined.any(axis=(0, 1)))


@brief_repr
@dataclass(frozen=True, eq=False)
class CodecAnalysis:
    """The training sets of every variant, in order of the variants."""

    seen: tuple[SpringObservability, ...]
    """Springs that its training sets determine."""
    indices: tuple[IndexValues, ...] = ()
    """Indices of its training sets; empty where they were not asked for."""
    correlations: tuple[Correlation, ...] = ()
    """Their correlations with accuracy."""


def analyse(
    robot: Robot,
    readings: Readings,
    data: CodecData,
    *,
    marker_offset: ArrayLike | None = None,
    with_indices: bool = False,
) -> CodecAnalysis:
    """Return the analysis of a codec beyond its errors.

    Parameters
    ----------
    robot, readings, marker_offset : Robot, Readings, array_like
        Those that the codec was made with.
    data : CodecData
        The codec.
    with_indices : bool
        Whether indices are wanted; they take about a second a variant.

    Raises
    ------
    CodecError
        If readings or layouts are not those of the codec.
    """
    variants = prepared_variants(robot, readings, data, marker_offset)
    seen = tuple(_spring_observability(data, each) for each in variants)
    if not with_indices:
        return CodecAnalysis(seen)
    indices = tuple(index_values(data, each) for each in variants)
    correlations = tuple(one for each in indices for one in correlate(data, each))
    return CodecAnalysis(seen, indices, correlations)


def _spring_observability(data: CodecData, prepared: PreparedVariant) -> SpringObservability:
    variant, problem = prepared.variant, prepared.problem
    chosen, springs = data.chosen[data.index(variant.name)], problem.springs

    determined = np.array(
        [
            _determined(
                prepared.triangles.grown([poses[poses != NO_POSE] for poses in row]),
                problem.size,
                springs,
            )
            for row in chosen
        ]
    )
    system = factor(problem.take(prepared.trains).of_springs())
    found = observability(system, prepared.model.springs)
    return SpringObservability(variant.name, determined, found.unobservable)


def _determined(triangles: FloatArray, size: FloatArray | float, springs: slice) -> BoolArray:
    """Return which springs each of some triangles of ``[O d]`` determines, (triangle, spring)."""
    n = triangles.shape[2] - 1
    rows = triangles[:, :n, :n]
    gain, _ = column_scaling(np.linalg.norm(rows, axis=1), size)
    _, s, Vt = np.linalg.svd(rows * gain[:, None])
    unseen = [Vt[number, rank(s[number]) :, springs] for number in range(len(s))]
    return np.array([np.linalg.norm(each, axis=0) <= _SHARE for each in unseen])
