"""A constant left in the forces: tool weight, or a sensor zeroed at the wrong moment.

With forces that are too large by a constant ``w`` (in base: a weight) or ``b`` (in the tcp frame:
a sensor bias), the deflection is

    d = O(f - w) c,    with the derivative  -C(q)  with respect to ``w``.

Offset and compliances are fitted in turn (Gauss-Newton in the offset, with the compliances
projected out; a bounded fit in the compliances) until the offset stands still.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification._least_squares import RANK_TOLERANCE
from elastocal.identification.problem import Problem
from elastocal.identification.solve import solve

_SIGNIFICANT = 6.0
"""Number of standard errors from which an offset is named."""
_SMALLEST = 0.03
"""Part of the median force below which an offset is not worth naming."""
_REDUCTION = 0.3
"""Part of the sum of squared residuals that the offset must explain to be named."""
_FEWEST_POSES = 10
"""With fewer poses, what the springs miss at one of them may pass for an offset."""
_SPARE = 2.0
"""Fewest equations for each unknown, offset included."""
_ROUNDS = 20
_SETTLED = 1e-3
"""Step at which the offset stands still, relative to its size."""


@dataclass(frozen=True)
class ForceOffset:
    """A constant that the forces seem to contain."""

    frame: str
    """``base`` (weight) or ``tcp`` (bias)."""
    force: FloatArray
    """Shape (3,), in N."""
    sigma: FloatArray
    """Standard errors, shape (3,), in N."""

    def message(self) -> str:
        """Return the offset as a warning."""
        x, y, z = self.force
        kind = "tool weight left in?" if self.frame == "base" else "zeroed at the wrong moment?"
        return (
            f"the forces seem to contain a constant of ({x:.0f}, {y:.0f}, {z:.0f}) N in the"
            f" {self.frame} frame: {kind}"
        )


@dataclass(frozen=True)
class _Step:
    """One linearised estimate."""

    force: FloatArray
    sigma: FloatArray
    explained: float
    """Part of the sum of squared residuals that the step removes."""


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
    if len(np.unique(problem.block)) < _FEWEST_POSES or problem.d.size < _SPARE * unknowns:
        return None
    T_base_tcp = model.robot.forward(readings.joint_position)
    turns = {
        "base": np.broadcast_to(np.eye(3), (len(readings), 3, 3)),
        "tcp": T_base_tcp[:, :3, :3],
    }
    yields = _yield(model, readings, compliance, marker_offset)
    first = {frame: _step(problem, -yields @ R) for frame, R in turns.items()}
    median = float(np.median(np.linalg.norm(readings.force, axis=1)))
    frame = max(first, key=lambda name: first[name].explained)
    if not first[frame].explained > _REDUCTION:
        return None
    found = _settle(model, readings, problem, compliance, turns[frame], marker_offset)
    if found is None:
        return None
    large = _SMALLEST * median < float(np.linalg.norm(found.force)) < median
    significant = bool(np.any(np.abs(found.force) > _SIGNIFICANT * found.sigma))
    return ForceOffset(frame, found.force, found.sigma) if large and significant else None


def _settle(
    model: ElasticModel,
    readings: Readings,
    problem: Problem,
    compliance: FloatArray,
    R: FloatArray,
    marker_offset: ArrayLike | None,
) -> _Step | None:
    """Fit offset and compliances in turn; None when the offset does not come to rest."""
    offset = np.zeros(3)
    for _ in range(_ROUNDS):
        force = readings.force - R @ offset
        blocks = model.observation_blocks(
            readings.joint_position, force, readings.moment, marker_offset
        )
        corrected = replace(problem, O=blocks)
        compliance = solve(corrected).compliance
        step = _step(corrected, -_yield(model, readings, compliance, marker_offset) @ R)
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


def _step(problem: Problem, columns: FloatArray) -> _Step:
    """Fit an offset's columns to what no compliances can explain."""
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
    return _Step(x / size, sigma, explained)
