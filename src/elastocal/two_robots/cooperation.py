"""A cooperative process: how far the tools yield from each other, and who corrects how much.

Two arms hold a process between them, so that one feels the force ``f`` and the other ``-f``. In
the first base their tools depart from each other by

    e = O_1(q_1, f) c_1 - R O_2(q_2, -R' f) c_2.

The parts ``w_1 + w_2 = 1`` share it: the first arm is moved by ``-w_1 e``, the second by ``w_2 e``.
No arm is moved farther than its limit; what one may not do the other does, as far as its own limit
lets it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Facts, Paragraph
from elastocal.errors import CompensationError
from elastocal.identification import CalibratedModel, interval
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import joints_beside
from elastocal.two_robots.presses import relative_blocks
from elastocal.wording import mm, phrase

_MADE_ZERO = 1e-6
"""Deviation in m below which a correction by the models that predict it leaves nothing."""
_ROUNDS = 3
"""Rounds in which the deviation is predicted at the corrected joints."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Deviation:
    """Relative deviation of the tools along a path, in the first base."""

    e: FloatArray
    """``p_1 - p_2`` under load less that without, shape (row, 3), in m."""
    low: FloatArray
    """Lower ends of its 95 % interval, shape (row, 3), in m: draws of both arms belong together."""
    high: FloatArray
    """Upper ends."""


@brief_repr
@dataclass(frozen=True, eq=False)
class SharedCorrection:
    """Corrections of both arms, in the first base."""

    first: FloatArray
    """Shift of the first tool, shape (row, 3), in m."""
    second: FloatArray
    """Shift of the second tool."""
    limited: int
    """Rows at which a limit leaves a part of the deviation."""


@record("elastocal.cooperation/1", eq=False)
class CooperationSummary(Result):
    """A cooperative process before and after correction."""

    arms: tuple[str, str]
    rows: int
    before: float
    """Mean relative deviation of the uncorrected path, predicted, in m."""
    before_max: float
    after: float
    """Mean relative deviation of the corrected path, predicted, in m."""
    after_max: float
    uncertainty: float
    """Mean half-width of the 95 % interval of the deviation along an axis, in m."""
    weights: tuple[float, float]
    """Parts of the deviation that each arm was to correct."""
    limits: tuple[float, float]
    """Largest correction of each arm, in m."""
    largest: tuple[float, float]
    """Largest correction that each arm makes, in m."""
    limited: int
    """Rows at which a limit leaves a part of the deviation."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the deviation before and after, and how it was shared."""
        own = zip(self.arms, self.largest, self.weights, strict=True)
        return (
            (phrase("Rows"), str(self.rows)),
            (phrase("Relative deviation before, mean"), mm(self.before)),
            (phrase("Relative deviation before, largest"), mm(self.before_max)),
            *self._left(),
            (phrase("95 % interval of the deviation, mean"), f"±{mm(self.uncertainty)}"),
            *(
                (
                    phrase("Largest correction of {arm}", arm=arm),
                    phrase("{largest}, for a part of {part}", largest=mm(most), part=f"{part:.0%}"),
                )
                for arm, most, part in own
            ),
        )

    def _left(self) -> Iterator[tuple[str, str]]:
        # Where no limit is reached it is zero by its making, and says nothing of the arms.
        if self.limited or self.after_max > _MADE_ZERO:
            yield phrase("Relative deviation that limits leave, mean"), mm(self.after)
            yield phrase("Relative deviation that limits leave, largest"), mm(self.after_max)

    def show(self) -> Iterable[Block]:
        """Return the deviation before and after, and what limits leave."""
        yield Facts(self.facts())
        if self.limited:
            yield Paragraph(
                phrase(
                    "Rows at which the limits of both arms leave a part of the deviation: {rows}.",
                    rows=self.limited,
                ),
                "sentence",
            )


def relative_deviation(
    models: tuple[CalibratedModel, CalibratedModel],
    T_first_second: FloatArray,
    q: tuple[FloatArray, FloatArray],
    force: FloatArray,
) -> Deviation:
    """Return how far the tools yield from each other.

    Parameters
    ----------
    models : tuple of CalibratedModel
        Of one calibration, draw by draw.
    T_first_second : ndarray, shape (4, 4)
        Base of the second robot in that of the first.
    q : tuple of ndarray, shape (row, joint)
        Joints of each arm, in rad or m.
    force : ndarray, shape (row, 3)
        Force on the first robot in its base, in N.
    """
    first, second = models
    O = relative_blocks((first.model, second.model), T_first_second[:3, :3], q, force)  # noqa: E741
    e = O @ np.concatenate([first.compliance, second.compliance])
    count = min(len(first.draws), len(second.draws))
    drawn = O @ np.concatenate([first.draws[:count], second.draws[:count]], axis=1).T
    low, high = interval(np.moveaxis(drawn, -1, 0))
    return Deviation(np.asarray(e), np.minimum(low, e), np.maximum(high, e))


def share_correction(
    e: FloatArray, weights: tuple[float, float], limits: tuple[float, float]
) -> SharedCorrection:
    """Return the shifts of both tools that take a deviation back.

    Parameters
    ----------
    e : ndarray, shape (row, 3)
        Relative deviation, in m.
    weights : tuple of float
        Parts of each arm; only their ratio counts.
    limits : tuple of float
        Largest shift of each arm, in m.

    Raises
    ------
    CompensationError
        If a weight or a limit is below zero or no number, or both weights are zero.
    """
    for name, values in (("weights", weights), ("limits", limits)):
        if not all(0.0 <= each < np.inf for each in values):
            raise CompensationError(f"{name} {values[0]:g}, {values[1]:g}: each must be 0 or more")
    if not sum(weights) > 0.0:
        raise CompensationError("weights 0, 0: one of them must be above 0")
    size = np.linalg.norm(e, axis=1)
    wanted = np.array(weights) / sum(weights) * size[:, None]
    own = np.minimum(wanted, limits)
    spare = np.array(limits) - own
    own = own + np.minimum(spare, (wanted - own)[:, ::-1])
    unit = np.divide(e, size[:, None], out=np.zeros_like(e), where=size[:, None] > 0.0)
    left = size - own.sum(axis=1)
    limited = int(np.count_nonzero(left > 1e-9))
    return SharedCorrection(-own[:, :1] * unit, own[:, 1:] * unit, limited)


@brief_repr
@dataclass(frozen=True, eq=False)
class CorrectedPair:
    """Corrected paths of both arms."""

    q: tuple[FloatArray, FloatArray]
    """Joints of each arm, shape (row, joint), in rad or m."""
    correction: SharedCorrection
    before: Deviation
    left: FloatArray
    """Relative deviation that is left at the corrected joints, predicted, shape (row, 3), in m."""


def correct_pair(
    models: tuple[CalibratedModel, CalibratedModel],
    T_first_second: FloatArray,
    q: tuple[FloatArray, FloatArray],
    force: FloatArray,
    weights: tuple[float, float],
    limits: tuple[float, float],
) -> CorrectedPair:
    """Return the paths of both arms with the deviation of their tools shared and taken back.

    Parameters
    ----------
    models, T_first_second, q, force
        As for `relative_deviation`.
    weights, limits
        As for `share_correction`.

    Raises
    ------
    PathError
        If a corrected pose is out of reach.
    """
    before = relative_deviation(models, T_first_second, q, force)
    R, deviation, moved = T_first_second[:3, :3], before.e, q
    for _ in range(_ROUNDS):
        shared = share_correction(deviation, weights, limits)
        moved = (
            _shifted(models[0].model.robot, q[0], shared.first),
            _shifted(models[1].model.robot, q[1], shared.second @ R),
        )
        deviation = relative_deviation(models, T_first_second, moved, force).e
    left = deviation + shared.first - shared.second
    return CorrectedPair(moved, shared, before, left)


def _shifted(robot: Robot, q: FloatArray, shift: FloatArray) -> FloatArray:
    """Return joints whose tcp is shifted in base, its orientation and the posture kept."""
    T = robot.forward(q)
    T[:, :3, 3] += shift
    return joints_beside(robot, T, q, lambda row: f"row {row + 1}")


def cooperation_summary(
    arms: tuple[str, str],
    found: CorrectedPair,
    weights: tuple[float, float],
    limits: tuple[float, float],
) -> CooperationSummary:
    """Return the figures of a corrected pair of paths."""
    before, after = (np.linalg.norm(each, axis=1) for each in (found.before.e, found.left))
    shifts = [
        np.linalg.norm(each, axis=1) for each in (found.correction.first, found.correction.second)
    ]
    first, second = (each / sum(weights) for each in weights)
    return CooperationSummary(
        arms=arms,
        rows=len(before),
        before=float(before.mean()),
        before_max=float(before.max()),
        after=float(after.mean()),
        after_max=float(after.max()),
        uncertainty=float(np.mean(found.before.high - found.before.low) / 2.0),
        weights=(first, second),
        limits=limits,
        largest=(float(shifts[0].max()), float(shifts[1].max())),
        limited=found.correction.limited,
    )
