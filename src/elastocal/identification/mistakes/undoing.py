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

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.identification.mistakes._readings import other_readings
from elastocal.identification.mistakes._rows import OtherReading, Rows
from elastocal.identification.mistakes._suspicion import Suspicion
from elastocal.identification.problem import Problem
from elastocal.identification.solve import solve
from elastocal.identification.uncertainty import leave_poses_out
from elastocal.robot import Robot
from elastocal.wording import phrase

_TRIMMED = 0.9
"""Part of the readings, those with the smallest residuals, that rank readings of the data."""
_FEWEST = 6
"""With fewer poses another reading may fit better by chance."""
_CERTAIN = 0.5
_FITS_WELL = 0.2
_EQUAL = 1.03
"""Ratio of residuals below which two readings explain the data alike; the plainer is said first."""
_ALIKE = 1.25
"""The same of readings with estimated numbers, which explain part of each other's."""


def find_undone(
    robot: Robot, readings: Readings, marker_offset: ArrayLike | None = None
) -> tuple[Suspicion, ...]:
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
    if len(np.unique(readings.pose)) < _FEWEST:
        return ()
    try:
        rows = Rows.of(robot, readings, marker_offset)
    except IdentificationError:
        return ()
    stated = rows.problem.take(rows.kept)
    before = _residual(stated)
    if not before > 1e-6 * float(np.linalg.norm(stated.d, axis=1).mean()):
        return ()
    compliance = solve(stated).compliance
    ranked = [
        (_residual(rows.read(each)) * max(each.louder, 1.0) / before, number, each)
        for number, each in enumerate(other_readings(rows, compliance))
    ]
    possible = sorted(each for each in ranked if each[0] < each[2].least)
    if not possible:
        return ()
    least, _, first = possible[0]
    near = [each for each in possible if each[0] < (_EQUAL if each[2].certain else _ALIKE) * least]
    if first.certain:
        # The plainest of those that say the same comes first.
        near = sorted((each for each in near if each[2].certain), key=lambda each: each[1])
    best = near[0][2]
    others = [each.message for _, _, each in near[1:2]]
    return _judged(stated, rows.read(best), best, others)


def _judged(
    stated: Problem, undone: Problem, reading: OtherReading, others: Sequence[str]
) -> tuple[Suspicion, ...]:
    """Return the mistake if errors at left-out poses say so too, with one that says the same."""
    before, after = (leave_poses_out(each).error for each in (stated, undone))
    blocks, index = np.unique(stated.block, return_inverse=True)
    gain = np.bincount(index, before - after * max(reading.louder, 1.0)) / np.bincount(index)
    error = float(gain.std(ddof=1)) / np.sqrt(len(blocks))
    if not gain.mean() > _SURE * error:
        return ()
    left = float(after.mean() * max(reading.louder, 1.0) / before.mean())
    if not left < reading.least:
        return ()
    deflection = float(np.linalg.norm(undone.d, axis=1).mean())
    certain = reading.certain and left < _CERTAIN and float(after.mean()) < _FITS_WELL * deflection
    text = phrase(
        "{mistake}: read so, the error at poses left out falls from {before} to {after} mm",
        mistake="; or ".join((reading.message, *others)),
        before=f"{1e3 * before.mean():.3f}",
        after=f"{1e3 * after.mean():.3f}",
    )
    return (Suspicion(text, certain),)


_SURE = 3.0
"""Standard errors by which the errors at left-out poses have to fall."""


def _residual(problem: Problem) -> float:
    """Return the trimmed mean residual of a fit, in m."""
    size = np.sort(np.linalg.norm(problem.residuals(solve(problem).compliance), axis=1))
    return float(size[: max(1, int(_TRIMMED * len(size)))].mean())
