"""Mistakes found by fitting: other interpretations of the readings are fitted and compared.

Forces, marker displacements and the order of rows may be interpreted otherwise than stated; each
interpretation is fitted with the same springs (`bearing`). For correct readings any other
interpretation leaves more unexplained, because model error and noise remain. So a mistake is named
where undoing it leaves clearly less, also at left-out poses, with a paired difference far beyond
its standard error.

`_interpretations` yields those that need no numbers, `_unknowns` those whose numbers are estimated;
here they are ranked, judged at left-out poses, and told. Thresholds are measured on correct
campaigns (docs/decisions/0105-mistakes-undone.md).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.contact import Contact
from elastocal.identification.mistakes._interpretations import interpretations
from elastocal.identification.mistakes._rows import (
    PARTS,
    OtherReading,
    Rows,
    fitted,
    residuals,
    trimmed,
)
from elastocal.identification.mistakes._unknowns import estimates
from elastocal.identification.problem import Problem
from elastocal.identification.uncertainty import leave_poses_out
from elastocal.robot import Robot

_FEWEST = 6
"""Fewest poses; with fewer, another interpretation may fit better by chance."""
_FEWEST_ESTIMATED = 8
"""Fewest poses for estimated numbers, which otherwise absorb the model error of a correct arm."""
_FEWEST_PARTED = 12
_LEFT_APART = 0.55
"""Part of the error that springs of both parts may leave: regions of the tooling differ, too."""
_TRIED = 5
"""Readings that are judged at left-out poses, the best first."""
_BY_CHANCE = 2e-3
"""Likelihood below which a gain is not chance."""
_SURE = (
    (0.75, _BY_CHANCE, 0.03),
    (0.85, 1e-8, 0.03),
    (0.85, 1e-4, 0.05),
    (np.inf, 1e-5, 0.05),
)
"""Ways to believe estimated numbers: the part of the error below which they leave it, the
likelihood of chance below which they do, and the part of the deflections above which they change.
They explain part of the model error, in correct data too: the less they explain, the smaller the
likelihood or the larger the change has to be."""
_CERTAIN = 0.5
_FITS_WELL = 0.2
_EQUAL = 1.1
"""Ratio of residuals below which two readings explain the data alike; the plainer is said first."""
_ALIKE = 1.25
"""The same of readings with estimated numbers, which explain part of each other's."""


def other_readings(rows: Rows) -> Iterator[OtherReading]:
    """Yield the other readings of the data that may explain them, the plainest first.

    Those of markers where there are any.
    """
    seen = not rows.readings.by_contact.any()
    for readings, of_marker in chain(interpretations(rows), estimates(rows)):
        if seen or not of_marker:
            yield from readings


def find_undone(
    robot: Robot,
    readings: Readings,
    marker_offset: ArrayLike | None = None,
    contact: Contact | None = None,
) -> tuple[Finding, ...]:
    """Return the mistake whose undoing explains readings far better; none of sound readings.

    Parameters
    ----------
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    contact : Contact, optional
        What is known of the tooling that holds the tool, where no tracker measured.
    """
    poses = len(np.unique(readings.pose))
    if poses < _FEWEST:
        return ()
    try:
        rows = Rows.of(robot, readings, marker_offset, contact)
    except IdentificationError:
        return ()
    before = trimmed(rows.residual)
    if not before > 1e-6 * float(np.linalg.norm(rows.stated.d, axis=1).mean()):
        return ()
    others = [
        each for each in other_readings(rows) if poses >= _FEWEST_ESTIMATED or not each.estimated
    ]
    left = residuals(rows.read(each) for each in others)
    ranked = [
        (residual * max(each.louder, 1.0) / before, number, each)
        for number, (residual, each) in enumerate(zip(left, others, strict=True))
    ]
    possible = sorted(each for each in ranked if each[0] < each[2].least)[:_TRIED]
    tried = (_plainest(possible[number:]) for number in range(len(possible)))
    undone = next(filter(None, (_judged(rows, *each) for each in tried)), None)
    changed = _parted(rows, readings.pose[rows.kept])
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
    near = [each for each in possible if each[0] <= (_EQUAL if each[2].certain else _ALIKE) * least]
    if first.certain:
        near = sorted((each for each in near if each[2].certain), key=lambda each: each[1])
    plainest, *others = (each for _, _, each in near)
    told = [each.message for each in others if not each.cause or each.cause != plainest.cause]
    return plainest, told[:1]


def _judged(rows: Rows, reading: OtherReading, others: Sequence[str]) -> _Found | None:
    """Return the mistake if errors at left-out poses say so too, with one that says the same."""
    undone, before = rows.read(reading), rows.held_out.error
    after = leave_poses_out(undone).error * max(reading.louder, 1.0)
    left, chance = _left(rows.stated, before, after)
    if not (left < reading.least and chance < _BY_CHANCE):
        return None
    if reading.estimated and not _believed(left, chance, _change(rows, undone)):
        return None
    deflection = float(np.linalg.norm(undone.d, axis=1).mean()) * max(reading.louder, 1.0)
    certain = reading.certain and left < _CERTAIN and float(after.mean()) < _FITS_WELL * deflection
    found = (CERTAINLY_READ_SO if certain else READ_SO)(
        mistake="; or ".join((reading.message, *others)),
        before=float(before.mean()),
        after=float(after.mean()) / max(reading.louder, 1.0),
    )
    return _Found(left, found)


def _change(rows: Rows, undone: Problem) -> float:
    """Return the relative change of the deflections by the springs of the other interpretation."""
    blocks, before = rows.stated.O, rows.compliance
    moved = np.linalg.norm(blocks @ (fitted(undone) - before), axis=1).mean()
    return float(moved / max(np.linalg.norm(blocks @ before, axis=1).mean(), 1e-12))


def _believed(left: float, chance: float, change: float) -> bool:
    """Return whether estimated numbers explain enough to be believed; see `_SURE`."""
    return any(left < part and chance < odds and change > least for part, odds, least in _SURE)


def _left(problem: Problem, before: FloatArray, after: FloatArray) -> tuple[float, float]:
    """Return the part of errors that is left, and how likely as much were gained by chance.

    By Student's distribution of the mean gain over poses.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    gain = np.bincount(index, before - after) / np.bincount(index)
    error = float(gain.std(ddof=1)) / np.sqrt(len(blocks))
    chance = float(stdtr(len(blocks) - 1, -gain.mean() / error)) if error > 0.0 else 0.0
    return float(after.mean() / before.mean()), chance


def _parted(rows: Rows, pose: IndexArray) -> _Found | None:
    """Return a finding that readings change midway, where the springs of both parts differ."""
    blocks, first = np.unique(rows.stated.block, return_index=True)
    if len(blocks) < _FEWEST_PARTED:
        return None
    order = blocks[np.argsort(first)]
    place = np.argsort(np.argsort(first))[np.searchsorted(blocks, rows.stated.block)]
    # What is known beforehand would count for one fit and not for the other.
    is_known = len(rows.stated.prior_rows) > 0
    free = rows.stated.without_prior() if is_known else rows.stated
    before = (leave_poses_out(free) if is_known else rows.held_out).error
    found = []
    for part in PARTS:
        late = place >= round(part * len(order))
        halves = [(mine, free.take(mine)) for mine in (late, ~late)]
        if any(_loaded_poses(half) < 2 for _, half in halves):
            continue
        after = np.empty_like(before)
        # No fit is better at a pose that it leaves out than at the same pose fitted.
        for mine, half in halves:
            after[mine] = np.linalg.norm(half.residuals(fitted(half)), axis=1)
        if not after.mean() < _LEFT_APART * before.mean():
            continue
        for mine, half in halves:
            after[mine] = leave_poses_out(half).error
        left, chance = _left(free, before, after)
        if left < _LEFT_APART and chance < _BY_CHANCE:
            found.append((left, late, after))
    if not found:
        return None
    left, late, after = min(found, key=itemgetter(0))
    parted = PARTED(pose=int(pose[late][0]), before=float(before.mean()), after=float(after.mean()))
    return _Found(left * _ALIKE, parted)


def _loaded_poses(problem: Problem) -> int:
    """Return the number of pose blocks whose readings load a spring."""
    return len(np.unique(problem.block[np.any(problem.O, axis=(1, 2))]))
