"""The verdict on signs and frames.

A force with the wrong sign, in the wrong frame, or joints counted the other way round still make
a solvable system; only the fit is worse. So the usual mistakes are undone one by one, and if the
data are explained far better without one of them, the fit is refused with that message (spec
sections 2 and 6; docs/decisions/0006-conventions-verdict.md).
"""

from dataclasses import replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import ConventionError, IdentificationError
from elastocal.identification.mistakes import mistakes_of
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import solve

POOR = 0.35
"""Part of the median deflection that may stay unexplained without a warning."""
DECISIVE = 0.6
"""A mistake is named when undoing it leaves at most this part of what was unexplained. Model
errors and noise stay whichever way correct data are read, so that for correct data every
mistake leaves more, not less."""
EXPLAINED = 0.2
"""Part that a mistake's undoing may leave unexplained to be named: it has to fit well itself.
Springs that the model lacks can make a wrong reading of good data fit less badly, never well."""
EXACT = 1e-8
"""Unexplained part below which data are exact and comparing remainders compares round-off."""
NOTHING = 0.5
"""Unexplained part above which a mistake is named even when there are fewer than four equations a
spring; with so few, another reading may fit better by chance."""


def check_conventions(
    model: ElasticModel, readings: Readings, marker_offset: ArrayLike | None = None
) -> float:
    """Return the part of the median deflection that a robust fit leaves unexplained.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        What was measured.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    ConventionError
        If the data are explained far better with a sign or a frame read otherwise.
    IdentificationError
        If most deflections are zero.
    """
    problem = build(model, readings, FitOptions(), marker_offset)
    if not np.median(np.linalg.norm(problem.d, axis=1)) > 0.0:
        raise IdentificationError("most deflections are zero: there is nothing to identify")
    robust = solve(problem, "huber")
    stated = _unexplained(problem.reweighted(robust.reading_weight))
    found = []
    for mistake in mistakes_of(model.robot):
        undone = mistake.undo(model.robot, readings)
        q, force, moment = undone.joint_position, undone.force, undone.moment
        blocks = model.observation_blocks(q, force, moment, marker_offset)
        # The weights of the stated reading keep a blunder out of every other one, too.
        other = replace(problem, O=blocks, d=undone.deflection).reweighted(robust.reading_weight)
        found.append((_unexplained(other), mistake.message))
    best, message = min(found, key=itemgetter(0))
    few = problem.d.size < 4 * problem.columns
    enough = stated > (NOTHING if few else EXACT)
    if enough and best <= min(DECISIVE * stated, EXPLAINED):
        raise ConventionError(
            f"{message}: read that way the fit leaves {best:.1%} of the median deflection"
            f" unexplained, as stated {stated:.1%}"
        )
    return stated


def _unexplained(problem: Problem) -> float:
    """Return the median residual of a non-negative fit over the median deflection."""
    residual = np.linalg.norm(problem.residuals(solve(problem).compliance), axis=1)
    return float(np.median(residual) / np.median(np.linalg.norm(problem.d, axis=1)))
