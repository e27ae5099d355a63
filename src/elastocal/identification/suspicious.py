"""Suspicious data: single readings that look wrong, and a constant in all forces.

Each reading's residual is taken from a fit that gross errors hardly pull (Cauchy loss), divided
by the robust standard deviation and by ``sqrt(1 - leverage)``, since a reading that pulls the
fit towards itself shows a smaller residual (Rousseeuw and Leroy, *Robust Regression and Outlier
Detection*, 1987, chapter 6).

With forces that are too large by a constant ``w`` (in base: tool weight) or ``b`` (in the tcp
frame: a sensor zeroed at the wrong moment), the deflection is

    d = O(f - w) c,    with the derivative  -C(q)  with respect to ``w``.

Offset and compliances are fitted in turn (Gauss-Newton in the offset, with the compliances
projected out; a bounded fit in the compliances) until the offset stands still.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification._least_squares import RANK_TOLERANCE, rank
from elastocal.identification.problem import Problem
from elastocal.identification.solve import Solution, normalised_residuals, solve
from elastocal.results import brief_repr
from elastocal.wording import phrase

_FALSE_ALARM = 0.01
"""Probability that a data set with normal noise and no blunder names any reading."""

BLUNDER_SCORE = 25.0
"""Robust score above which a reading may be set aside ..."""
_BLUNDER_SIZE = 0.25
"""... if its residual is also above this part of the median deflection. Both together are
beyond any model error: a broken beam, a marker knocked off, a reading of another pose."""
_MOST_BLUNDERS = 0.1
"""Largest part of the readings that may be set aside; more is a bad campaign, not blunders."""

_REDUNDANCY = 1.5
"""Fewest equations for each determined direction; with fewer, residuals say nothing."""
_MOST_LEVERAGE = 0.99
_SIGNIFICANT = 6.0
"""Number of standard errors from which an offset is named."""
_SMALLEST = 0.03
"""Part of the median force below which an offset is not worth naming."""
_REDUCTION = 0.3
"""Part of the sum of squared residuals that the offset must explain to be named."""
_FEWEST_POSES = 10
"""With fewer poses, what the springs miss at one of them may pass for an offset."""
_ROWS_A_SPRING = 2.0
"""Fewest equations for each unknown, offset included."""
_ROUNDS = 20
_SETTLED = 1e-3
"""Step at which the offset stands still, relative to its size."""


@brief_repr
@dataclass(frozen=True)
class Screening:
    """How each reading looks to a robust fit."""

    score: FloatArray
    """Leverage-corrected residual norm in robust standard deviations, shape (reading,)."""
    residual: FloatArray
    """Residual norm of the robust fit, shape (reading,), in m."""
    leverage: FloatArray
    """Mean leverage of a reading's three rows, shape (reading,), 0 to 1."""
    threshold: float
    """Score above which a reading is named."""
    blunder: BoolArray
    """Whether the reading cannot be a measurement of this robot, shape (reading,), bool."""

    @property
    def suspicious(self) -> BoolArray:
        """Whether each reading is named, shape (reading,), bool."""
        return np.asarray(self.score > self.threshold)


def screen(problem: Problem) -> Screening:
    """Return how the readings of a problem look to a robust fit."""
    robust = solve(problem, "cauchy")
    weighted = problem.reweighted(robust.reading_weight)
    h = leverage(weighted, robust)
    if problem.d.size < _REDUNDANCY * rank(robust.factored.s):
        nothing = np.zeros(len(problem))
        return Screening(nothing, nothing, h, np.inf, nothing > 0.0)
    score = normalised_residuals(problem, robust.compliance, np.sqrt(1.0 - h))
    residual = np.linalg.norm(problem.residuals(robust.compliance), axis=1)
    typical = float(np.median(np.linalg.norm(problem.d, axis=1)))
    blunder = (score > BLUNDER_SCORE) & (residual > _BLUNDER_SIZE * typical)
    if blunder.mean() > _MOST_BLUNDERS:
        blunder = np.zeros_like(blunder)
    # The scale is a median itself, about half as good as a variance of all that is left over.
    freedom = 0.5 * max(problem.d.size - rank(robust.factored.s), 2)
    threshold = float(np.sqrt(3.0 * fdtri(3, freedom, 1.0 - _FALSE_ALARM / len(problem))))
    return Screening(score, residual, h, threshold, blunder)


def leverage(problem: Problem, solution: Solution) -> FloatArray:
    """Return the mean leverage of each reading's rows over the observable directions.

    The diagonal of the hat matrix, shape (reading,), at most 0.99.
    """
    system = solution.factored
    seen = rank(system.s)
    basis = system.Vt[:seen] / system.s[:seen, None]
    rows = problem.scaled().rows @ basis.T
    return np.asarray(np.minimum(np.square(rows).sum(axis=2).mean(axis=1), _MOST_LEVERAGE))


@brief_repr
@dataclass(frozen=True)
class ForceOffset:
    """A constant that the forces seem to contain."""

    frame: str
    """``base`` (weight) or ``tcp`` (bias)."""
    force: FloatArray
    """Shape (3,), in N."""
    sigma: FloatArray
    """Standard errors, shape (3,), in N."""
    explained: float = 0.0
    """Part of the sum of squared residuals that the last step of the fit removed."""

    def message(self) -> str:
        """Return the offset as a warning."""
        x, y, z = self.force
        kind = (
            phrase("tool weight left in?")
            if self.frame == "base"
            else phrase("zeroed at the wrong moment?")
        )
        return phrase(
            "the forces seem to contain a constant of ({x}, {y}, {z}) N in the {frame} frame:"
            " {kind}",
            x=f"{x:.0f}",
            y=f"{y:.0f}",
            z=f"{z:.0f}",
            frame=self.frame,
            kind=kind,
        )


def force_offset(
    model: ElasticModel,
    readings: Readings,
    problem: Problem,
    compliance: FloatArray,
    marker_offset: ArrayLike | None = None,
) -> ForceOffset | None:
    """Return the constant that the forces contain, if there is a significant one.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        What was fitted.
    problem : Problem
        Its observation system.
    compliance : ndarray, shape (spring,)
        Its solution.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m, as the problem was built with.
    """
    unknowns = problem.columns + 3
    if len(np.unique(problem.block)) < _FEWEST_POSES or problem.d.size < _ROWS_A_SPRING * unknowns:
        return None
    T_base_tcp = model.robot.forward(readings.joint_position)
    turns = {
        "base": np.broadcast_to(np.eye(3), (len(readings), 3, 3)),
        "tcp": T_base_tcp[:, :3, :3],
    }
    yields = _yield(model, readings, compliance, marker_offset)
    steps = [_step(problem, -yields @ R, frame) for frame, R in turns.items()]
    first = max(steps, key=lambda step: step.explained)
    if not first.explained > _REDUCTION:
        return None
    found = _settle(model, readings, problem, turns[first.frame], marker_offset, first.frame)
    if found is None:
        return None
    median = float(np.median(np.linalg.norm(readings.force, axis=1)))
    large = _SMALLEST * median < float(np.linalg.norm(found.force)) < median
    significant = bool(np.any(np.abs(found.force) > _SIGNIFICANT * found.sigma))
    return found if large and significant else None


def _settle(
    model: ElasticModel,
    readings: Readings,
    problem: Problem,
    R: FloatArray,
    marker_offset: ArrayLike | None,
    frame: str,
) -> ForceOffset | None:
    """Fit offset and compliances in turn; None when the offset does not come to rest."""
    offset = np.zeros(3)
    for _ in range(_ROUNDS):
        force = readings.force - R @ offset
        blocks = model.observation_blocks(
            readings.joint_position, force, readings.moment, marker_offset
        )
        corrected = problem.with_springs(blocks)
        compliance = solve(corrected).compliance[problem.springs]
        step = _step(corrected, -_yield(model, readings, compliance, marker_offset) @ R, frame)
        offset = offset + step.force
        if np.linalg.norm(step.force) < _SETTLED * np.linalg.norm(offset):
            return replace(step, force=offset)
    return None


def _yield(
    model: ElasticModel, readings: Readings, compliance: FloatArray, marker_offset: ArrayLike | None
) -> FloatArray:
    """Return the displacement of the marker per force at the tcp, shape (reading, 3, 3)."""
    unit = model.observation_blocks(
        readings.joint_position[:, None], np.eye(3), marker_offset=marker_offset
    )
    return np.asarray(np.swapaxes(unit @ compliance, 1, 2))


def _step(problem: Problem, columns: FloatArray, frame: str) -> ForceOffset:
    """Return a linearised estimate: an offset's columns fitted to what no compliances explain."""
    w = problem.weight[..., None]
    O = problem.scaled().rows.reshape(-1, problem.columns)  # noqa: E741
    A = (columns * w).reshape(-1, 3)
    d = (problem.d * problem.weight).ravel()
    # What compliances can explain is projected out of columns and data, so that the small problem
    # in the offset alone has the solution of the joint one (Frisch, Waugh and Lovell).
    Q, s, _ = np.linalg.svd(O, full_matrices=False)
    Q = Q[:, s > RANK_TOLERANCE * s[0]]
    A, d = A - Q @ (Q.T @ A), d - Q @ (Q.T @ d)
    # An axis that no reading sees gets no offset: the pseudo-inverse of unit columns drops it.
    norms = np.linalg.norm(A, axis=0)
    size = np.where(norms > 0.0, norms, 1.0)
    inverse = np.linalg.pinv(A / size, rcond=RANK_TOLERANCE)
    x = inverse @ d
    left = d - (A / size) @ x
    freedom = max(len(d) - Q.shape[1] - 3, 1)
    variance = float(left @ left) / freedom
    sigma = np.sqrt(variance * np.square(inverse).sum(axis=1)) / size
    before = float(d @ d)
    exact = before <= (np.finfo(float).eps * float(np.abs(problem.d).max())) ** 2 * problem.d.size
    explained = 0.0 if exact else 1.0 - float(left @ left) / before
    return ForceOffset(frame, x / size, sigma, explained)
