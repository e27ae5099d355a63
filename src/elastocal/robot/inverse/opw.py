"""Analytic inverse kinematics of OPW arms: the closed form, safe at its singularities.

The position problem is that of Brandstötter et al. (2014, see `opw_geometry`), with two
changes that keep every digit where the published formulas lose half of them: joint 2 follows
from joint 3 (so that the errors of a stretched elbow cancel), and joint 6 from joint 4 (so
that those of a straight wrist do).
"""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.robot.inverse.branch_solver import BranchSolver
from elastocal.robot.inverse.frames import arm_base, inverse_transform
from elastocal.robot.inverse.opw_geometry import OpwGeometry, OpwParameters, derive_opw

BRANCHES = 8
_SINGULAR = 1e-10
"""Nearer than this (m, or sine of joint 5) a singular pose is taken as exactly singular.

A tenth of what a solution may miss its pose by, and far above round-off.
"""


@dataclass(frozen=True, eq=False)
class OpwInverse(BranchSolver):
    """All eight branches of a six-axis arm with ortho-parallel basis and spherical wrist.

    Branch slots: ``4 * wrist + 2 * shoulder + elbow``, in OPW angles: elbow 0 bends by plus,
    1 by minus the same angle; shoulder 0 faces the wrist centre, 1 reaches back over the
    head; wrist 1 is wrist 0 with joint 4 half a turn on and joint 5 of the other sign. The
    numbering is that of py-opw-kinematics.

    Singular poses have a defined answer:

    * straight wrist (axes 4 and 6 in one line; only their sum counts): joint 4 is at zero,
      or as near as its limits allow, joint 6 takes the rest; wrist 0 and 1 are equal;
    * wrist centre on axis 1 with ``b = 0`` (any joint 1 will do): joint 1 of shoulder 0 is at
      zero, or as near as its limits allow, that of shoulder 1 half a turn from it;
    * stretched or folded elbow, and wrist centre at distance ``b`` from axis 1: the two
      branches that meet there are equal.

    Where such a choice puts another joint outside its limits, other members of the family may
    still be inside: they are not searched.

    Parameters
    ----------
    robot : Robot
        The robot.

    Raises
    ------
    NotOrthoParallelError
        If the arm is not of this kind.
    """

    geometry: OpwGeometry = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "geometry", derive_opw(self.robot))

    @property
    def branches(self) -> int:
        """Number of slots a pose has: eight."""
        return BRANCHES

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return the eight branches whatever the limits; see `BranchSolver.candidates`."""
        geometry, parameters = self.geometry, self.geometry.parameters
        T_opw_base = inverse_transform(arm_base(self.robot, external) @ geometry.T_arm_opw)
        T_opw_flange = T_opw_base @ T_base_tcp @ inverse_transform(geometry.T_flange_tcp)
        signs, offsets = np.array(parameters.signs), np.array(parameters.offsets)
        theta = opw_branches(parameters, T_opw_flange, signs * self._rest() + offsets)
        return np.asarray(signs * (theta - offsets))

    def _rest(self) -> FloatArray:
        """Return the arm configuration nearest to zero within the limits, shape (6,)."""
        limits = self.robot.limits
        return np.asarray(np.clip(0.0, limits.lower[-6:], limits.upper[-6:]))


def opw_branches(
    parameters: OpwParameters, T_opw_flange: FloatArray, rest: FloatArray
) -> FloatArray:
    """Return the OPW angles of all eight branches.

    Parameters
    ----------
    parameters : OpwParameters
        The arm.
    T_opw_flange : ndarray, shape (pose, 4, 4)
        Poses of the OPW flange in the OPW base, in m.
    rest : ndarray, shape (6,)
        Angles that joint 1 and joint 4 take where any would do, in rad.

    Returns
    -------
    ndarray, shape (pose, 8, 6)
        OPW angles in rad, not normalised; NaN where the wrist centre is out of reach.
    """
    rotation = T_opw_flange[:, :3, :3]
    centre = T_opw_flange[:, :3, 3] - parameters.c4 * rotation[:, :, 2]
    theta = np.empty((len(centre), BRANCHES, 6))
    for shoulder in (0, 1):
        theta1, reach = _shoulder(parameters, centre, shoulder, float(rest[0]))
        for elbow in (0, 1):
            slot = 2 * shoulder + elbow
            height = centre[:, 2] - parameters.c1
            theta2, theta3 = _elbow(parameters, reach - parameters.a1, height, elbow)
            R_forearm_flange = _forearm(theta1, theta2 + theta3) @ rotation
            for wrist in (0, 1):
                theta[:, 4 * wrist + slot, 0] = theta1
                theta[:, 4 * wrist + slot, 1] = theta2
                theta[:, 4 * wrist + slot, 2] = theta3
                theta[:, 4 * wrist + slot, 3:] = _wrist(R_forearm_flange, wrist, float(rest[3]))
    return theta


def _shoulder(
    parameters: OpwParameters, centre: FloatArray, shoulder: int, rest: float
) -> tuple[FloatArray, FloatArray]:
    """Return joint 1, and how far the wrist centre is in front of axis 1 after it."""
    radius = np.hypot(centre[:, 0], centre[:, 1])
    b = parameters.b
    bearing = np.arctan2(centre[:, 1], centre[:, 0])
    bearing = np.where(radius <= _SINGULAR, rest, bearing)
    reach = np.sqrt(np.maximum(radius**2 - b**2, 0.0)) * (1 - 2 * shoulder)
    # atan2 tells a reach of -0.0 from 0.0: the two shoulders stay half a turn apart.
    theta1 = bearing - np.arctan2(b, reach)
    return np.where(radius >= abs(b) - _SINGULAR, theta1, np.nan), reach


def _elbow(
    parameters: OpwParameters, x: FloatArray, z: FloatArray, elbow: int
) -> tuple[FloatArray, FloatArray]:
    """Return joints 2 and 3 that put the wrist centre at (x, z) from axis 2."""
    c2, forearm = parameters.c2, np.hypot(parameters.a2, parameters.c3)
    distance = np.hypot(x, z)
    cosine = (distance**2 - c2**2 - forearm**2) / (2.0 * c2 * forearm)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0)) * (1 - 2 * elbow)
    lift = np.arctan2(forearm * np.sin(bend), c2 + forearm * np.cos(bend))
    within = (distance <= c2 + forearm + _SINGULAR) & (distance >= abs(c2 - forearm) - _SINGULAR)
    theta2 = np.where(within, np.arctan2(x, z) - lift, np.nan)
    return theta2, bend - np.arctan2(parameters.a2, parameters.c3)


def _forearm(theta1: FloatArray, theta23: FloatArray) -> FloatArray:
    """Return R_forearm_opw = (Rz(theta1) Ry(theta23))ᵀ, shape (pose, 3, 3)."""
    s1, c1, s23, c23 = np.sin(theta1), np.cos(theta1), np.sin(theta23), np.cos(theta23)
    rows = [c1 * c23, s1 * c23, -s23, -s1, c1, np.zeros_like(s1), c1 * s23, s1 * s23, c23]
    return np.stack(rows, axis=-1).reshape(-1, 3, 3)


def _wrist(R: FloatArray, wrist: int, rest: float) -> FloatArray:
    """Return joints 4, 5, 6 of R = Rz(theta4) Ry(theta5) Rz(theta6), shape (pose, 3).

    Rz(-theta4) R = Ry(theta5) Rz(theta6) has theta6 alone in its second row, and theta5 alone
    in its last column, whatever theta4 was.
    """
    straight = np.hypot(R[:, 0, 2], R[:, 1, 2]) <= _SINGULAR
    theta4 = np.arctan2(R[:, 1, 2], R[:, 0, 2]) + wrist * np.pi
    theta4 = np.where(straight, rest, theta4)
    s4, c4 = np.sin(theta4), np.cos(theta4)
    theta5 = np.arctan2(c4 * R[:, 0, 2] + s4 * R[:, 1, 2], R[:, 2, 2])
    theta6 = np.arctan2(c4 * R[:, 1, 0] - s4 * R[:, 0, 0], c4 * R[:, 1, 1] - s4 * R[:, 0, 1])
    return np.stack([theta4, theta5, theta6], axis=-1)
