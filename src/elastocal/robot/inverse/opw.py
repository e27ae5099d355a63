"""Analytic inverse kinematics of OPW arms: the closed form, safe at its singularities.

The position problem is that of Brandstötter et al. (2014, see `OpwParameters`), with two
changes that keep every digit where the published formulas lose half of them: joint 2 follows
from joint 3 (so that the errors of a stretched elbow cancel), and joint 6 from joint 4 (so
that those of a straight wrist do).
"""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.results import brief_repr
from elastocal.robot.inverse.arm import AxisLines, arm_axes, arm_base, arm_joints
from elastocal.robot.inverse.solver import InverseKinematics
from elastocal.robot.robot import Robot
from elastocal.robot.transforms import inverse_transform

_EXACT = 1e-9
"""Largest deviation of an axis (rad, m) and of the forward kinematics (rad, m) from OPW."""
_ROUND_OFF = 1e-12
_SAMPLES = 16
_BRANCHES = 8
_SINGULAR = 1e-10
"""Nearer than this (m, or sine of joint 5) a singular pose is taken as exactly singular.

A tenth of what a solution may miss its pose by, and far above round-off.
"""


EDGE = 30.0
"""Distance beyond the reach of a closed form, in deviations of an arm from it, that the arm may
reach."""


class NotOrthoParallelError(RobotError):
    """An arm that has no analytic solution of the OPW kind; the message says why."""


@brief_repr
@dataclass(frozen=True)
class OpwParameters:
    """Lengths of the OPW arm in m, named as in its paper, and its joint conventions.

    M. Brandstötter, A. Angerer, M. Hofbaur, "An analytical solution of the inverse kinematics
    problem of industrial serial manipulators with an ortho-parallel basis and a spherical wrist",
    Austrian Robotics Workshop 2014 (OPW). Its zero pose is the arm stretched straight up: axes 1,
    4 and 6 along z, axes 2, 3 and 5 along y.
    """

    a1: float
    """Axis 1 to axis 2; never negative."""
    a2: float
    """Axis 3 to axis 4, along the forearm's x axis: positive when below a level forearm."""
    b: float
    """Wrist centre beside axis 1, along axis 2."""
    c1: float
    """Arm frame's origin to axis 2, along axis 1; never negative, that is what up means here."""
    c2: float
    """Axis 2 to axis 3; positive."""
    c3: float
    """Axis 3 to the wrist centre, along axis 4; never negative."""
    c4: float
    """Wrist centre to the tool centre point, along axis 6; never negative."""
    signs: tuple[int, ...]
    """Sense of each joint, +1 or -1: ``theta = signs * q + offsets``."""
    offsets: tuple[float, ...]
    """OPW angle of each joint at q = 0, in rad."""

    def forward(self, theta: FloatArray) -> FloatArray:
        """Return T_opw_flange of OPW angles, shape (..., 6) in rad -> (..., 4, 4) in m."""
        T = _turn(2, theta[..., 0]) @ _shift(self.a1, 0.0, self.c1) @ _turn(1, theta[..., 1])
        T = T @ _shift(0.0, 0.0, self.c2) @ _turn(1, theta[..., 2])
        T = T @ _shift(self.a2, self.b, self.c3) @ _turn(2, theta[..., 3])
        T = T @ _turn(1, theta[..., 4]) @ _turn(2, theta[..., 5])
        return T @ _shift(0.0, 0.0, self.c4)


@brief_repr
@dataclass(frozen=True)
class OpwGeometry:
    """An arm as an OPW arm between two constant transforms.

    ``T_arm_tcp(q) = T_arm_opw @ forward(signs * q + offsets) @ T_flange_tcp``
    """

    parameters: OpwParameters
    T_arm_opw: FloatArray
    """OPW base in the arm frame, shape (4, 4), in m."""
    T_flange_tcp: FloatArray
    """Tool centre point in the OPW flange, shape (4, 4), in m."""
    deviation: float
    """Largest difference to `Robot.forward` over seeded configurations, in m and rad."""


@dataclass(frozen=True, eq=False, repr=False)
class OpwInverse(InverseKinematics):
    """All eight branches of a six-axis arm with ortho-parallel basis and spherical wrist.

    Branch slots: ``4 * wrist + 2 * shoulder + elbow``, in OPW angles: elbow 0 bends by plus, 1 by
    minus the same angle; shoulder 0 faces the wrist centre, 1 reaches backwards; wrist 1 is wrist 0
    with joint 4 half a turn on and joint 5 of the other sign. The numbering is that of
    py-opw-kinematics.

    Singular poses have a defined answer:

    * straight wrist (axes 4 and 6 in one line; only their sum counts): joint 4 is at zero, or as
      near as its limits allow, joint 6 has the rest; wrist 0 and 1 are equal;
    * wrist centre on axis 1 with ``b = 0`` (any joint 1 will do): joint 1 of shoulder 0 is at
      zero, or as near as its limits allow, that of shoulder 1 half a turn from it;
    * stretched or folded elbow, and wrist centre at distance ``b`` from axis 1: the two
      branches that meet there are equal.

    Where such a choice takes another joint outside its limits, other members of the family may be
    inside: they are not searched.

    Raises
    ------
    NotOrthoParallelError
        If the arm is not of this kind.
    """

    tolerance: float = _EXACT
    """Largest deviation of an axis and of the forward kinematics from OPW, in m and rad. Branches
    of an arm that is only nearly OPW miss their poses: `NearInverse` takes them from there."""
    geometry: OpwGeometry = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "geometry", derive_opw(self.robot, self.tolerance))

    @property
    def branches(self) -> int:
        """Number of slots a pose has: eight."""
        return _BRANCHES

    @property
    def method(self) -> str:
        """Closed form."""
        return "closed form of arms with a spherical wrist"

    def candidates(self, T_base_tcp: FloatArray, external: FloatArray) -> FloatArray:
        """Return the eight branches whatever the limits; see `InverseKinematics.candidates`."""
        geometry, parameters = self.geometry, self.geometry.parameters
        T_opw_base = inverse_transform(arm_base(self.robot, external) @ geometry.T_arm_opw)
        T_opw_flange = T_opw_base @ T_base_tcp @ inverse_transform(geometry.T_flange_tcp)
        signs, offsets = np.array(parameters.signs), np.array(parameters.offsets)
        edge = max(_SINGULAR, EDGE * geometry.deviation)
        theta = opw_branches(parameters, T_opw_flange, signs * self._rest() + offsets, edge)
        return np.asarray(signs * (theta - offsets))

    def _rest(self) -> FloatArray:
        """Return the arm configuration nearest to zero within the limits, shape (6,)."""
        limits = self.robot.limits
        return np.asarray(np.clip(0.0, limits.lower[-6:], limits.upper[-6:]))


def opw_branches(
    parameters: OpwParameters, T_opw_flange: FloatArray, rest: FloatArray, edge: float = _SINGULAR
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
    edge : float
        Distance beyond reach, in m, that counts as at its edge.

    Returns
    -------
    ndarray, shape (pose, 8, 6)
        OPW angles in rad, not normalised; NaN where the wrist centre is out of reach.
    """
    rotation = T_opw_flange[:, :3, :3]
    centre = T_opw_flange[:, :3, 3] - parameters.c4 * rotation[:, :, 2]
    theta = np.empty((len(centre), _BRANCHES, 6))
    for shoulder in (0, 1):
        theta1, reach = _shoulder(parameters, centre, shoulder, float(rest[0]), edge)
        for elbow in (0, 1):
            slot = 2 * shoulder + elbow
            height = centre[:, 2] - parameters.c1
            theta2, theta3 = _elbow(parameters, reach - parameters.a1, height, elbow, edge)
            R_forearm_flange = _forearm(theta1, theta2 + theta3) @ rotation
            for wrist in (0, 1):
                theta[:, 4 * wrist + slot, 0] = theta1
                theta[:, 4 * wrist + slot, 1] = theta2
                theta[:, 4 * wrist + slot, 2] = theta3
                theta[:, 4 * wrist + slot, 3:] = _wrist(R_forearm_flange, wrist, float(rest[3]))
    return theta


def _shoulder(
    parameters: OpwParameters, centre: FloatArray, shoulder: int, rest: float, edge: float
) -> tuple[FloatArray, FloatArray]:
    """Return joint 1, and how far the wrist centre is in front of axis 1 after it."""
    radius = np.hypot(centre[:, 0], centre[:, 1])
    b = parameters.b
    bearing = np.arctan2(centre[:, 1], centre[:, 0])
    bearing = np.where(radius <= _SINGULAR, rest, bearing)
    reach = np.sqrt(np.maximum(radius**2 - b**2, 0.0)) * (1 - 2 * shoulder)
    # atan2 distinguishes a reach of -0.0 from 0.0: the two shoulders stay half a turn apart.
    theta1 = bearing - np.arctan2(b, reach)
    return np.where(radius >= abs(b) - edge, theta1, np.nan), reach


def _elbow(
    parameters: OpwParameters, x: FloatArray, z: FloatArray, elbow: int, edge: float
) -> tuple[FloatArray, FloatArray]:
    """Return joints 2 and 3 that put the wrist centre at (x, z) from axis 2."""
    c2, forearm = parameters.c2, np.hypot(parameters.a2, parameters.c3)
    distance = np.hypot(x, z)
    cosine = (distance**2 - c2**2 - forearm**2) / (2.0 * c2 * forearm)
    # Where the arm is only nearly this one the two elbows stay apart.
    most = 1.0 - (edge - _SINGULAR) / forearm
    bend = np.arccos(np.clip(cosine, -most, most)) * (1 - 2 * elbow)
    lift = np.arctan2(forearm * np.sin(bend), c2 + forearm * np.cos(bend))
    within = (distance <= c2 + forearm + edge) & (distance >= abs(c2 - forearm) - edge)
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


def derive_opw(robot: Robot, tolerance: float = _EXACT) -> OpwGeometry:
    """Return the OPW geometry of a robot's arm, certified against its forward kinematics.

    Only the lines of the joint axes at q = 0 count: not the frames, their names, how the arm
    is mounted, nor what it rides on.

    Parameters
    ----------
    robot : Robot
        A robot whose last six joints are the arm.
    tolerance : float
        Largest deviation of an axis and of the forward kinematics, in m and rad.

    Raises
    ------
    NotOrthoParallelError
        If the arm is not of this kind; the message names the axes and how far they are off.
    """
    joints = arm_joints(robot)
    if len(joints) != 6 or not all(joint.revolute for joint in joints):
        kinds = ", ".join("revolute" if joint.revolute else "prismatic" for joint in joints)
        raise NotOrthoParallelError(f"{robot.name}: the arm must be six revolute joints: {kinds}")
    axes = arm_axes(robot)
    centre = _wrist_centre(robot, axes, tolerance)
    T_arm_opw = _opw_base(axes)
    parameters = _parameters(axes, centre, T_arm_opw)
    T_arm_flange = T_arm_opw @ parameters.forward(np.array(parameters.offsets))
    T_flange_tcp = inverse_transform(T_arm_flange) @ axes.T_arm_tcp
    deviation = _deviation(robot, parameters, T_arm_opw, T_flange_tcp)
    if not deviation <= tolerance:
        raise NotOrthoParallelError(
            f"{robot.name}: its OPW model differs from the robot by {deviation:.3g} m or rad"
            f" (allowed {tolerance:g})"
        )
    return OpwGeometry(parameters, T_arm_opw, T_flange_tcp, deviation)


def _wrist_centre(robot: Robot, axes: AxisLines, tolerance: float) -> FloatArray:
    """Check every geometric condition of an OPW arm and return its wrist centre."""
    p, d = axes.point, axes.direction
    names = [joint.name for joint in arm_joints(robot)]

    def require(off: float, condition: str, *which: int) -> None:
        if not off <= tolerance:
            axes_named = ", ".join(names[index - 1] for index in which)
            raise NotOrthoParallelError(
                f"{robot.name}: the axes of {axes_named} must {condition}: off by {off:.3g} m or"
                f" rad (allowed {tolerance:g})"
            )

    require(float(np.linalg.norm(np.cross(d[1], d[2]))), "be parallel", 2, 3)
    for i, j in ((1, 2), (3, 4), (4, 5), (5, 6)):
        require(float(abs(d[i - 1] @ d[j - 1])), "be perpendicular", i, j)
    # Axes 4 and 5 are perpendicular: this is the foot of their common perpendicular.
    centre: FloatArray = p[3] + ((p[4] - p[3]) @ d[3]) * d[3]
    off = max(_distance(centre, p[4], d[4]), _distance(centre, p[5], d[5]))
    require(off, "meet in one point (spherical wrist)", 4, 5, 6)
    for i, what in ((1, p[2]), (2, centre)):
        if not _distance(what, p[i], d[i]) > tolerance:
            ends = f"{names[i]} and {names[i + 1]}" if i == 1 else f"{names[i]} and the wrist"
            raise NotOrthoParallelError(f"{robot.name}: the link between {ends} has no length")
    return centre


def _opw_base(axes: AxisLines) -> FloatArray:
    """Return T_arm_opw: z along axis 1 to the shoulder, y along axis 2, x to the shoulder."""
    (p1, p2), (z, y) = axes.point[:2], axes.direction[:2]
    height = z @ p2
    if height < -_EXACT:
        z = -z
    x = np.cross(y, z)
    if x @ (p2 - p1) < -_EXACT:
        x, y = -x, -y
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, y, z])
    T[:3, 3] = p1 - (p1 @ z) * z
    return T


def _parameters(axes: AxisLines, centre: FloatArray, T_arm_opw: FloatArray) -> OpwParameters:
    """Read lengths, senses and zero angles off the axes in the OPW base frame."""
    R, origin = T_arm_opw[:3, :3], T_arm_opw[:3, 3]
    p, d = (axes.point - origin) @ R, axes.direction @ R
    centre, tip = (centre - origin) @ R, (axes.T_arm_tcp[:3, 3] - origin) @ R
    y = np.array([0.0, 1.0, 0.0])
    upper_arm = p[2] - p[1]
    theta2 = np.arctan2(upper_arm[0], upper_arm[2])
    forearm = _toward(d[3], centre - p[2])
    theta23 = np.arctan2(forearm[0], forearm[2])
    across = np.cross(y, forearm)
    # Of the two senses of axis 5, the one that needs less than a quarter turn of joint 4.
    bend = _toward(d[4], y)
    theta4 = np.arctan2(-bend @ across, bend[1])
    tool = _toward(d[5], tip - centre)
    theta5 = np.arctan2(tool @ np.cross(bend, forearm), tool @ forearm)
    senses = (np.array([0.0, 0.0, 1.0]), y, y, forearm, bend, tool)
    return OpwParameters(
        a1=_length(p[1][0]),
        a2=_length((centre - p[2]) @ across),
        b=_length(centre[1]),
        c1=_length(p[1][2]),
        c2=float(np.hypot(upper_arm[0], upper_arm[2])),
        c3=float((centre - p[2]) @ forearm),
        c4=float((tip - centre) @ tool),
        signs=tuple(1 if sense @ axis > 0 else -1 for sense, axis in zip(senses, d, strict=True)),
        offsets=(0.0, float(theta2), float(theta23 - theta2), float(theta4), float(theta5), 0.0),
    )


def _deviation(
    robot: Robot, parameters: OpwParameters, T_arm_opw: FloatArray, T_flange_tcp: FloatArray
) -> float:
    """Return the largest entry by which OPW and `Robot.forward` differ, in m and rad."""
    # Seeded here and not passed in, so that a certificate is the same for every caller.
    rng = np.random.default_rng(0)
    q = rng.uniform(-np.pi, np.pi, (_SAMPLES, len(robot.joint_names)))
    external, arm = q[:, : robot.external_axes], q[:, robot.external_axes :]
    theta = np.array(parameters.signs) * arm + np.array(parameters.offsets)
    T = arm_base(robot, external) @ T_arm_opw @ parameters.forward(theta) @ T_flange_tcp
    return float(np.abs(T - robot.forward(q)).max())


def _length(value: float) -> float:
    """Return a length without its round-off: a `b` of 1e-17 m would hide a singularity."""
    return 0.0 if abs(value) < _ROUND_OFF else float(value)


def _toward(direction: FloatArray, aim: FloatArray) -> FloatArray:
    """Return the sense of an axis that points to ``aim``; its own when it is across it."""
    return -direction if direction @ aim < -_EXACT else direction


def _distance(point: FloatArray, on_line: FloatArray, direction: FloatArray) -> float:
    return float(np.linalg.norm(np.cross(point - on_line, direction)))


def _turn(axis: int, angle: FloatArray) -> FloatArray:
    """Return rotations about y (1) or z (2) as transforms, shape (..., 4, 4)."""
    i, j = ((2, 0), (0, 1))[axis - 1]
    T = np.zeros((*angle.shape, 4, 4))
    T[...] = np.eye(4)
    T[..., i, i] = T[..., j, j] = np.cos(angle)
    T[..., j, i] = np.sin(angle)
    T[..., i, j] = -T[..., j, i]
    return T


def _shift(x: float, y: float, z: float) -> FloatArray:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T
