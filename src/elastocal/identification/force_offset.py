"""A constant left in the forces: tool weight, or a sensor zeroed at the wrong moment.

With a force that is too large by a constant ``w`` (in base: a weight) or ``b`` (in the tcp frame:
a sensor bias), the deflection is ``O c - C(q) (w + R_base_tcp b)``. The six components are
estimated together with the compliances by least squares, linearised at the fit.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification.problem import Problem

_SIGNIFICANT = 6.0
"""Number of standard errors from which an offset is named."""
_SMALLEST = 0.03
"""Part of the median force below which an offset is not worth naming."""
_REDUCTION = 0.3
"""Part of the sum of squared residuals that the offset must explain to be named."""


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


def force_offset(
    model: ElasticModel, readings: Readings, problem: Problem, compliance: FloatArray
) -> ForceOffset | None:
    """Return the constant that the forces contain, if there is a significant one."""
    C = model.cartesian_compliance(compliance, readings.joint_position).translation
    R_base_tcp = model.robot.forward(readings.joint_position)[:, :3, :3]
    found = [
        _estimate(problem, columns, frame)
        for frame, columns in (("base", -C), ("tcp", -C @ R_base_tcp))
    ]
    median = float(np.median(np.linalg.norm(readings.force, axis=1)))
    explained, offset = max(found, key=lambda pair: pair[0])
    large = float(np.linalg.norm(offset.force)) > _SMALLEST * median
    significant = bool(np.any(np.abs(offset.force) > _SIGNIFICANT * offset.sigma))
    return offset if large and significant and explained > _REDUCTION else None


def _estimate(problem: Problem, columns: FloatArray, frame: str) -> tuple[float, ForceOffset]:
    """Fit compliances and offset together; return the explained part and the offset."""
    w = problem.weight[..., None]
    O = (problem.O / problem.scale * w).reshape(-1, problem.springs)  # noqa: E741
    A = (columns * w).reshape(-1, 3)
    d = (problem.d * problem.weight).ravel()
    Q, s, _ = np.linalg.svd(O, full_matrices=False)
    Q = Q[:, s > 1e-6 * s[0]]
    # What the compliances cannot explain, of the offset's columns and of the data.
    A, d = A - Q @ (Q.T @ A), d - Q @ (Q.T @ d)
    size = np.where(np.linalg.norm(A, axis=0) > 0.0, np.linalg.norm(A, axis=0), 1.0)
    inverse = np.linalg.pinv(A / size, rcond=1e-6)
    x = inverse @ d
    left = d - (A / size) @ x
    freedom = max(len(d) - Q.shape[1] - 3, 1)
    variance = float(left @ left) / freedom
    sigma = np.sqrt(variance * np.square(inverse).sum(axis=1)) / size
    before = float(d @ d)
    explained = 1.0 - float(left @ left) / before if before > 0.0 else 0.0
    return explained, ForceOffset(frame, x / size, sigma)
