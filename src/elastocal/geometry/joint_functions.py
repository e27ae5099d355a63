"""Functions of each joint that a fit has found, with bands, for people and pictures."""

from collections.abc import Iterator

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.geometry.arm import LOW_ORDERS, ORDERS, waves
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.problem import RUNGS, GeometryProblem, wave_sizes
from elastocal.identification import interval
from elastocal.records import record
from elastocal.results import brief_repr

_SAMPLES = 4
"""Angles of a band for each wave of the highest order."""
_LEAST_SPAN = np.pi / 3.0
"""Smallest range of a joint, in rad, over which more than low orders can be told."""


@brief_repr
@record()
class JointFunction:
    """Errors of a joint beyond twice a turn, as a function of its angle: gear and encoder.

    Without what zero, scale, once and twice a turn could stand in for over the measured range.
    """

    joint: str
    angle: FloatArray
    """Over the range that was measured, a turn at most, shape (sample,), in rad."""
    value: FloatArray
    """How much farther the joint turns than it says, shape (sample,), in rad."""
    low: FloatArray
    """Lower end of the 95 % interval, shape (sample,), in rad."""
    high: FloatArray
    """Upper end, shape (sample,), in rad."""
    order: int
    """The strongest order, in waves a turn."""
    amplitude: float
    """Its amplitude, in rad."""
    known: bool
    """Whether the band is narrower, in the mean, than what one would guess without measuring."""

    @property
    def largest(self) -> float:
        """Largest error in the measured range, in rad."""
        return float(np.abs(self.value).max())


def joint_functions(problem: GeometryProblem, found: GeometryLadder) -> tuple[JointFunction, ...]:
    """Return the functions of the joints; none where another rung was chosen.

    Parameters
    ----------
    problem : GeometryProblem
        What was fitted.
    found : GeometryLadder
        What was found.
    """
    return tuple(_functions(problem, found)) if found.chosen == RUNGS[-1] else ()


def _functions(problem: GeometryProblem, found: GeometryLadder) -> Iterator[JointFunction]:
    start, whole = problem.dense, found.whole
    count = 2 * len(wave_sizes())
    sizes = np.repeat(wave_sizes(), 2)
    for number, joint in enumerate(problem.robot.chain.joints):
        if not joint.revolute:
            continue
        own = slice(start, start + count)
        start += count
        low, high = np.percentile(problem.data.q[:, number], [0.0, 100.0])
        span = min(float(high - low), 2.0 * np.pi)
        samples = 2 + int(_SAMPLES * ORDERS * span / (2.0 * np.pi))
        angle = low + np.linspace(0.0, span, samples)
        wave = beyond_low_orders(angle, waves(angle[:, None], LOW_ORDERS + 1, ORDERS)[:, 0])
        below, above = interval(whole.draws[:, own] @ wave.T)
        amplitudes = np.linalg.norm(whole.values[own].reshape(-1, 2), axis=1)
        strongest = int(amplitudes.argmax())
        # Of what low orders cannot stand in for: next to nothing over a small part of a turn.
        guess = float(np.linalg.norm(wave * sizes, axis=1).mean())
        yield JointFunction(
            joint=joint.name,
            angle=angle,
            value=wave @ whole.values[own],
            low=below,
            high=above,
            order=LOW_ORDERS + 1 + strongest,
            amplitude=float(amplitudes[strongest]),
            known=bool(span >= _LEAST_SPAN and (above - below).mean() <= 2.0 * guess),
        )


def beyond_low_orders(angle: FloatArray, values: FloatArray) -> FloatArray:
    """Return functions without their best fit by zero, scale, and waves once and twice a turn.

    Parameters
    ----------
    angle : ndarray, shape (sample,)
        In rad.
    values : ndarray, shape (sample, function)
        At these angles.
    """
    low = np.column_stack([np.ones_like(angle), angle, waves(angle[:, None], 1, LOW_ORDERS)[:, 0]])
    return np.asarray(values - low @ np.linalg.lstsq(low, values)[0])
