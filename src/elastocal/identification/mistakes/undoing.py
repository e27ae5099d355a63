"""Mistakes that a fit shows: undone one by one, and errors at left-out poses compared.

Forces, marker displacements and the order of rows may be read otherwise than stated; each reading
is fitted with the same springs (`bearing`). Of sound readings every other one leaves more
unexplained, model error and noise staying whichever way they are read. So a mistake is named where
undoing it leaves clearly less, at poses left out as well, with a paired difference that is far
beyond its standard error.

Rows are linear in the force: with the rows of three unit forces at each reading, a force that is
turned, exchanged or scaled costs a product, not a new model. What is a number, such as a constant
in the force or a drift, is estimated beside the springs, linearised about their fit and repeated.
Thresholds are measured on sound campaigns (docs/decisions/0105-mistakes-undone.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.mistakes._readings import other_readings
from elastocal.identification.mistakes._rows import OtherReading, Rows, apart, fitted
from elastocal.identification.problem import Problem
from elastocal.identification.uncertainty import leave_poses_out
from elastocal.robot import Robot

_TRIMMED = 0.9
"""Part of the readings, those with the smallest residuals, that rank readings of the data."""
_FEWEST = 6
"""With fewer poses another reading may fit better by chance."""
_FEWEST_ESTIMATED = 8
"""With fewer poses an estimated number explains what the springs miss of a sound arm."""
_FEWEST_PARTED = 12
_PARTS = (0.33, 0.5, 0.67)
_LEFT_APART = 0.55
"""Part of the error that springs of both parts may leave: regions of the tooling differ, too."""
_TRIED = 5
"""Readings that are judged at left-out poses, the best first."""
_SURE = ((0.75, 2e-3), (1.0, 1e-4))
"""Part that is left of the error, and likelihood that the gain is chance below which it counts.
Estimated numbers explain part of what springs miss, in sound data too: the less they explain, the
surer it has to be. Without estimated numbers the first holds for every gain."""
_MATTERS = 0.03
"""Part of the deflections that an estimated number has to move to be worth a word."""
_CERTAIN = 0.5
_FITS_WELL = 0.2
_EQUAL = 1.1
"""Ratio of residuals below which two readings explain the data alike; the plainer is said first."""
_ALIKE = 1.25
"""The same of readings with estimated numbers, which explain part of each other's."""


def find_undone(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None = None
) -> tuple[Finding, ...]:
    """Return the mistake whose undoing explains readings far better; none of sound readings.

    Parameters
    ----------
    robot : Robot
        The robot.
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    """
    poses = len(np.unique(readings.pose))
    if poses < _FEWEST:
        return ()
    try:
        rows = Rows.of(robot, readings, marker_offset)
    except IdentificationError:
        return ()
    stated = rows.problem.take(rows.kept)
    before = _residual(stated)
    if not before > 1e-6 * float(np.linalg.norm(stated.d, axis=1).mean()):
        return ()
    compliance = fitted(stated)
    ranked = [
        (_residual(rows.read(each)) * max(each.louder, 1.0) / before, number, each)
        for number, each in enumerate(other_readings(rows, compliance))
        if poses >= _FEWEST_ESTIMATED or not each.estimated
    ]
    possible = sorted(each for each in ranked if each[0] < each[2].least)[:_TRIED]
    tried = (_plainest(possible[number:]) for number in range(len(possible)))
    undone = next(filter(None, (_judged(stated, rows, *each) for each in tried)), None)
    changed = _parted(stated, readings.pose[rows.kept])
    found = [each for each in (undone, changed) if each is not None]
    return (min(found, key=lambda each: each.left).mistake,) if found else ()


_Ranked = tuple[float, int, OtherReading]


READ_SO = Kind(
    "mistakes.read-so",
    "{mistake}: read so, the error at poses left out falls from {before} to {after} mm",
    shown=dict.fromkeys(("before", "after"), as_number(".3f", 1e3)),
)
CERTAINLY_READ_SO = replace(READ_SO, name="mistakes.certainly-read-so", grade=Grade.REFUSAL)
PARTED = Kind(
    "mistakes.parted",
    "readings from pose {pose} on are not like those before: fitted apart, the error at poses"
    " left out falls from {before} to {after} mm; was a sensor or tracker plugged, turned or"
    " set otherwise there?",
    shown=dict.fromkeys(("before", "after"), as_number(".3f", 1e3)),
)


@dataclass(frozen=True)
class _Found:
    """A mistake, and the part of the error that is left with it undone."""

    left: float
    mistake: Finding


def _plainest(possible: Sequence[_Ranked]) -> tuple[OtherReading, Sequence[str]]:
    """Return the plainest of the readings that explain about as much as the best, and another."""
    least, _, first = possible[0]
    near = [each for each in possible if each[0] < (_EQUAL if each[2].certain else _ALIKE) * least]
    if first.certain:
        near = sorted((each for each in near if each[2].certain), key=lambda each: each[1])
    return near[0][2], [each.message for _, _, each in near[1:2]]


def _judged(
    stated: Problem, rows: Rows, reading: OtherReading, others: Sequence[str]
) -> _Found | None:
    """Return the mistake if errors at left-out poses say so too, with one that says the same."""
    undone = rows.read(reading)
    before, after = (leave_poses_out(each).error for each in (stated, undone))
    after = after * max(reading.louder, 1.0)
    left, chance = _left(stated, before, after)
    if not (left < reading.least and chance < _believed(left, reading.estimated)):
        return None
    if reading.estimated and not _change(stated, undone) > _MATTERS:
        return None
    deflection = float(np.linalg.norm(undone.d, axis=1).mean()) * max(reading.louder, 1.0)
    certain = reading.certain and left < _CERTAIN and float(after.mean()) < _FITS_WELL * deflection
    found = (CERTAINLY_READ_SO if certain else READ_SO)(
        mistake="; or ".join((reading.message, *others)),
        before=float(before.mean()),
        after=float(after.mean()) / max(reading.louder, 1.0),
    )
    return _Found(left, found)


def _change(stated: Problem, undone: Problem) -> float:
    """Return how far the springs of the other reading move the deflections, over their size."""
    before, after = fitted(stated), fitted(undone)
    moved = np.linalg.norm(stated.O @ (after - before), axis=1).mean()
    return float(moved / max(np.linalg.norm(stated.O @ before, axis=1).mean(), 1e-12))


def _believed(left: float, estimated: bool) -> float:
    """Return the likelihood of chance below which a gain that leaves a part of errors counts."""
    return next(sure for part, sure in _SURE if not estimated or left < part)


def _left(problem: Problem, before: FloatArray, after: FloatArray) -> tuple[float, float]:
    """Return the part of errors that is left, and how likely as much were gained by chance.

    By Student's distribution of the mean gain over poses.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    gain = np.bincount(index, before - after) / np.bincount(index)
    error = float(gain.std(ddof=1)) / np.sqrt(len(blocks))
    chance = float(stdtr(len(blocks) - 1, -gain.mean() / error)) if error > 0.0 else 0.0
    return float(after.mean() / before.mean()), chance


def _parted(stated: Problem, pose: IndexArray) -> _Found | None:
    """Return that readings change on the way, where springs of both parts differ."""
    blocks, first = np.unique(stated.block, return_index=True)
    if len(blocks) < _FEWEST_PARTED:
        return None
    order = blocks[np.argsort(first)]
    place = np.argsort(np.argsort(first))[np.searchsorted(blocks, stated.block)]
    before = leave_poses_out(stated).error
    found = []
    for part in _PARTS:
        late = place >= round(part * len(order))
        after = leave_poses_out(apart(stated, late)).error
        left, chance = _left(stated, before, after)
        if left < _LEFT_APART and chance < _believed(left, True):
            found.append((left, late, after))
    if not found:
        return None
    left, late, after = min(found, key=itemgetter(0))
    parted = PARTED(pose=int(pose[late][0]), before=float(before.mean()), after=float(after.mean()))
    return _Found(left * _ALIKE, parted)


def _residual(problem: Problem) -> float:
    """Return the trimmed mean residual of a fit, in m."""
    size = np.sort(np.linalg.norm(problem.residuals(fitted(problem)), axis=1))
    return float(size[: max(1, int(_TRIMMED * len(size)))].mean())
