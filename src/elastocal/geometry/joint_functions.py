"""Functions of each joint that a fit has found: their bands, and the angles where they hold.

A function says nothing about angles that were not measured
(docs/decisions/0123-joint-functions.md).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.findings import Finding, Kind, as_count, as_number
from elastocal.geometry.arm import LOW_ORDERS, ORDERS, waves
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.problem import RUNGS, GeometryProblem, wave_sizes
from elastocal.identification import interval
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.units import in_unit

_TURN = 2.0 * np.pi
REACH = np.pi / ORDERS
"""How far from a measured angle a function holds, in rad: half the shortest wave."""
UNMEASURED = Kind(
    "geometry.angles-not-measured",
    "{rows} of {total} have a joint where no position was measured within {reach} deg ({where}):"
    " its function is not known there, and the error stated for left-out poses does not hold",
    advice="Measure positions at these angles, too, or keep production away from them.",
    shown={"rows": as_count("row"), "reach": as_number(".2g")},
)

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
    measured: tuple[tuple[float, float], ...] = ()
    """Ranges of the angle where it holds, rising, within a turn, in rad: no farther than `REACH`
    from an angle that was measured. Empty in files of before, where they are not known."""

    @property
    def largest(self) -> float:
        """Largest error in the measured range, in rad."""
        return float(np.abs(self.value).max())

    def holds(self, angle: FloatArray) -> BoolArray:
        """Return whether it holds at angles in rad, which may be turns away; of the same shape."""
        inside = [(angle - low) % _TURN <= high - low for low, high in self.measured]
        return np.any(inside, axis=0) if inside else np.ones(np.shape(angle), dtype=bool)


def measured_ranges(angle: FloatArray) -> tuple[tuple[float, float], ...]:
    """Return the ranges that lie within `REACH` of measured angles, shape (pose,), in rad.

    >>> [[round(float(end), 3) for end in each] for each in measured_ranges(np.array([0.0, 0.1]))]
    [[-0.079, 0.179]]
    """
    known = np.unique(angle % _TURN)
    gap = np.diff(np.append(known, known[0] + _TURN))
    ends = np.flatnonzero(gap > 2.0 * REACH)
    if not len(ends):
        return ((-np.pi, np.pi),)
    # A range begins behind the gap before it; the first may begin behind the last gap, a turn ago.
    first = np.append(0, ends[:-1] + 1) if ends[-1] == len(known) - 1 else np.roll(ends, 1) + 1
    begin = known[first]
    width = (known[ends] - begin) % _TURN + 2.0 * REACH
    begin = (begin - REACH + np.pi) % _TURN - np.pi
    return tuple(
        (float(low), float(low + by)) for low, by in sorted(zip(begin, width, strict=True))
    )


class AngleCheck:
    """Counts rows with a joint at an angle where its function does not hold.

    Parameters
    ----------
    functions : sequence of JointFunction
        Functions of an arm; none: nothing is ever found.
    joints : sequence of str
        Names of the joints in the order of the columns that `add` is given.
    """

    def __init__(self, functions: Sequence[JointFunction], joints: Sequence[str]) -> None:
        self._functions = [(joints.index(each.joint), each) for each in functions]
        self._rows = self._total = 0
        self._beyond: dict[str, tuple[float, float]] = {}

    def add(self, q: FloatArray, *_: object) -> None:
        """Count rows, shape (row, joint), in rad or m."""
        beyond = np.zeros(len(q), dtype=bool)
        for column, each in self._functions:
            off = ~each.holds(q[:, column])
            beyond |= off
            if np.any(off):
                angles = q[off, column]
                low, high = self._beyond.get(each.joint, (np.inf, -np.inf))
                self._beyond[each.joint] = (
                    min(low, float(angles.min())),
                    max(high, float(angles.max())),
                )
        self._rows, self._total = self._rows + int(beyond.sum()), self._total + len(q)

    @property
    def ranges(self) -> str:
        """Where functions hold of joints that were not measured over a whole turn, in words."""
        limited = [each for _, each in self._functions if len(each.measured)]
        return "; ".join(
            f"{each.joint} {_degrees(each.measured)}"
            for each in limited
            if each.measured[0][1] - each.measured[0][0] < _TURN
        )

    def findings(self) -> tuple[Finding, ...]:
        """Return what a person should know of the rows so far."""
        if not self._rows:
            return ()
        beyond = ((joint, _degrees([ends])) for joint, ends in self._beyond.items())
        where = ", ".join(f"{joint} at {angles} deg" for joint, angles in beyond)
        reach = float(in_unit(REACH, "deg"))
        found = UNMEASURED(rows=self._rows, total=self._total, reach=reach, where=where)
        return (found,)


def _degrees(ranges: Sequence[tuple[float, float]]) -> str:
    ends = [(in_unit(low, "deg"), in_unit(high, "deg")) for low, high in ranges]
    return ", ".join(f"{low:.0f} to {high:.0f}" for low, high in ends)


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
            measured=measured_ranges(problem.data.q[:, number]),
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
