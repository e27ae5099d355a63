"""Stiffness of a posture: in one direction, and in all.

With the Cartesian compliance ``C = J diag(c) J^T`` of the tool centre point (paper Eq. 10), a force
of 1 N along the unit vector ``u`` moves the tool by ``u^T C u`` along ``u``. The directional
stiffness is its inverse,

    k(u) = 1 / (u^T C u),    u^T C u = sum_i (J_i^T u)^2 c_i,

while the tool is free to yield sideways. The second form is a row of the observation matrix
(Eq. 11) times the compliances: of springs that cannot be told apart only the sum counts, which is
determined. The principal stiffnesses are the inverse eigenvalues of C.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.identification import CalibratedModel, interval
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class DirectionalStiffness:
    """Directional stiffness with its 95 % interval (bootstrap draws of the model)."""

    stiffness: FloatArray
    """Shape (row,), in N/m; infinite where nothing yields."""
    low: FloatArray
    high: FloatArray


@brief_repr
@dataclass(frozen=True, eq=False)
class PrincipalStiffness:
    """Principal stiffnesses of the tool centre point."""

    stiffness: FloatArray
    """Softest first, shape (row, 3), in N/m; infinite where nothing yields."""
    axes: FloatArray
    """Unit vectors in base as columns, in the same order, shape (row, 3, 3)."""


def directional_stiffness(
    calibrated: CalibratedModel, q: ArrayLike, direction: ArrayLike
) -> DirectionalStiffness:
    """Return the stiffness along a direction.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    q : array_like, shape (row, joint)
        Joint positions in rad or m.
    direction : array_like, shape (3,) or (row, 3)
        Unit vectors in base.
    """
    rows = _squared_torques(calibrated, q, direction)
    with np.errstate(divide="ignore"):
        low, high = interval((rows @ calibrated.draws.T).T)
        # What is most compliant is least stiff.
        return DirectionalStiffness(1.0 / (rows @ calibrated.compliance), 1.0 / high, 1.0 / low)


def stiffness_along(calibrated: CalibratedModel, q: ArrayLike, direction: ArrayLike) -> FloatArray:
    """Return the stiffness along a direction without its interval; see `directional_stiffness`."""
    with np.errstate(divide="ignore"):
        stiffness: FloatArray = 1.0 / (
            _squared_torques(calibrated, q, direction) @ calibrated.compliance
        )
    return stiffness


def _squared_torques(calibrated: CalibratedModel, q: ArrayLike, direction: ArrayLike) -> FloatArray:
    """Return the squares ``(J_i^T u)^2``, shape (row, spring): times ``c`` they are ``u^T C u``."""
    q = calibrated.model.robot.check_positions(q)
    return calibrated.model.directional_rows(q, np.broadcast_to(direction, (len(q), 3)))


def principal_stiffness(calibrated: CalibratedModel, q: ArrayLike) -> PrincipalStiffness:
    """Return the principal stiffnesses and their axes.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model.
    q : array_like, shape (row, joint)
        Joint positions in rad or m.
    """
    C = calibrated.model.cartesian_compliance(calibrated.compliance, q).translation
    values, axes = np.linalg.eigh(C)
    # Of a compliance with bounds at zero, round-off may leave an eigenvalue just below.
    values = np.maximum(values[..., ::-1], 0.0)
    with np.errstate(divide="ignore"):
        return PrincipalStiffness(1.0 / values, axes[..., ::-1])
