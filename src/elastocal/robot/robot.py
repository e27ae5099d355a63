"""The rigid robot: kinematics, limits and gravity torques of a serial chain."""

from __future__ import annotations  # signatures show ArrayLike by its name

import reprlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, IndexArray, as_numbers
from elastocal.errors import RobotError, require_type
from elastocal.files import as_path, sha256
from elastocal.results import brief_repr
from elastocal.robot.chain import ChainJoint, ChainModel, SerialChain, build_model
from elastocal.robot.urdf import (
    Assumption,
    assumptions,
    parse_urdf,
    read_chain,
    read_urdf,
    refusals_naming,
    robot_name,
)

GRAVITY = (0.0, 0.0, -9.80665)
"""Standard gravity in the base frame of an upright robot, in m/s² (ISO 80000-3)."""
_ARM, _REDUNDANT = 6, 7
"""Numbers of joints of an arm."""
_CROSSED = 0.1
"""Sine of the angle from which on two axes cross; calibrated parallel axes are nearer."""
_JOINTS_SHOWN = 12
"""Most joints that the `repr` of a robot lists."""


@dataclass(frozen=True)
class Jacobian:
    """Velocity of a point per unit joint velocity, in base axes (paper Eq. 1-2).

    The paper stacks rotation over translation, Pinocchio translation over rotation; here the two
    parts have names.
    """

    translation: FloatArray
    """Rows of the linear velocity, shape (..., 3, joint), in m/rad or m/m."""
    rotation: FloatArray
    """Rows of the angular velocity, shape (..., 3, joint), in rad/rad or rad/m."""

    def __repr__(self) -> str:
        return f"Jacobian(translation and rotation of shape {self.translation.shape})"


@brief_repr
@dataclass(frozen=True)
class JointLimits:
    """Limits of the joints, in SI units; unknown ones are infinite or NaN."""

    lower: FloatArray
    """Shape (joint,), in rad or m; -inf if there is none."""
    upper: FloatArray
    """Shape (joint,), in rad or m; inf if there is none."""
    velocity: FloatArray
    """Shape (joint,), in rad/s or m/s; NaN when not known."""
    effort: FloatArray
    """Shape (joint,), in N·m or N; NaN when not known."""

    def margin(self, q: ArrayLike) -> FloatArray:
        """Return the distance of each joint to its nearer limit; negative when outside.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        """
        q = np.asarray(q, dtype=float)
        margin: FloatArray = np.minimum(q - self.lower, self.upper - q)
        return margin


@dataclass(frozen=True, eq=False)
class Robot:
    """A serial robot from its base link to its tool centre point.

    Joints before the arm's six or seven are *external axes*: a rail, a turntable. Make one with
    `from_urdf`, `from_file` or `elastocal.robot.catalogue.load`.
    """

    name: str
    urdf: str
    """The URDF text that the robot was made from."""
    chain: SerialChain
    assumptions: tuple[Assumption, ...] = ()
    """Numbers of the description that have no source."""
    meshes: tuple[tuple[str, Path], ...] = ()
    """Files of its collision shapes by their names in the URDF, where they were looked for
    (`find_meshes`)."""
    gravity: tuple[float, float, float] = GRAVITY
    """Acceleration of gravity in base, in m/s²; the default is that of an upright robot."""
    _rigid: ChainModel = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_rigid", build_model(self.chain))

    def __repr__(self) -> str:
        lines = [f"Robot {self.name!r}: {self.chain!r}"]
        lines += [f"  {_joint_row(joint)}" for joint in self.chain.joints[:_JOINTS_SHOWN]]
        if len(self.chain.joints) > _JOINTS_SHOWN:
            lines.append(f"  and {len(self.chain.joints) - _JOINTS_SHOWN} more joints")
        if self.assumptions:
            fields = ", ".join(assumption.field for assumption in self.assumptions)
            lines.append(f"  without a source: {fields}")
        return "\n".join(lines)

    @classmethod
    def from_urdf(
        cls, text: str, tip: str, base: str | None = None, meshes: tuple[tuple[str, Path], ...] = ()
    ) -> Robot:
        """Return the robot that a URDF text describes.

        Parameters
        ----------
        text : str
            The URDF.
        tip : str
            Link at the tool centre point, its z axis out of the tool.
        base : str, optional
            Link that positions and forces are expressed in; the root link by default.
        meshes : tuple of (str, Path)
            Files of the collision shapes; see `elastocal.robot.find_meshes`.

        Raises
        ------
        RobotError
            If the URDF cannot be read or has no such links.
        """
        require_type(text, str, "text", "text of a URDF; from_file reads a file")
        chain = read_chain(text, tip, base)
        root = parse_urdf(text)
        return cls(robot_name(root), text, chain, assumptions(root, chain), meshes)

    @classmethod
    def from_file(cls, path: Path | str, tip: str, base: str | None = None) -> Robot:
        """Return the robot that a URDF file describes; see `from_urdf`."""
        if isinstance(path, str) and path.lstrip().startswith("<"):
            raise RobotError(
                f"a file is expected, not {reprlib.repr(path)} (Robot.from_urdf reads a text)"
            )
        path = as_path(path, "path")
        text = read_urdf(path)
        with refusals_naming(path):
            return cls.from_urdf(text, tip, base)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the movable joints, from base to tip."""
        return tuple(joint.name for joint in self.chain.joints)

    @property
    def base(self) -> str:
        """Name of the link that positions and forces are expressed in."""
        return self.chain.base

    @property
    def tip(self) -> str:
        """Name of the link at the tool centre point."""
        return self.chain.tip

    @cached_property
    def external_axes(self) -> int:
        """Number of joints before the arm, which has six joints, or seven.

        Seven revolute joints are one arm, unless the last six are: then their second and third
        axes are parallel (shoulder and elbow), as they are on no arm with a redundant joint, whose
        axes cross one after the other. A turntable under six joints stays an external axis.
        """
        last = self.chain.joints[-_REDUNDANT:]
        if len(last) == _REDUNDANT and all(joint.revolute for joint in last):
            shoulder, elbow = last[2], last[3]
            across = np.cross(shoulder.axis, elbow.placement[:3, :3] @ elbow.axis)
            if float(np.linalg.norm(across)) > _CROSSED:
                return len(self.chain.joints) - _REDUNDANT
        return max(0, len(self.chain.joints) - _ARM)

    @property
    def revolute(self) -> tuple[bool, ...]:
        """Whether each joint is revolute (else prismatic)."""
        return tuple(joint.revolute for joint in self.chain.joints)

    @property
    def urdf_hash(self) -> str:
        """SHA-256 of the URDF text."""
        return sha256(self.urdf)

    @property
    def limits(self) -> JointLimits:
        """Limits of the joints."""
        joints = self.chain.joints
        return JointLimits(
            *(
                np.array([getattr(joint, name) for joint in joints], dtype=float)
                for name in ("lower", "upper", "velocity", "effort")
            )
        )

    def forward(self, q: ArrayLike) -> FloatArray:
        """Return T_base_tcp.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (..., 4, 4)
            Pose of the tool centre point in base; translation in m.
        """
        q = self.check_positions(q)
        model, data = self._rigid.model, self._rigid.model.createData()
        flat = q.reshape(-1, q.shape[-1])
        poses = np.empty((len(flat), 4, 4))
        for pose, configuration in zip(poses, flat, strict=True):
            pin.forwardKinematics(model, data, configuration)
            pose[:] = pin.updateFramePlacement(model, data, self._rigid.tip_frame).homogeneous
        return poses.reshape(*q.shape[:-1], 4, 4)

    def joint_points(self, q: ArrayLike) -> FloatArray:
        """Return the origin of each joint's frame in base.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (..., joint, 3)
            In m; that of a joint that slides moves with it.
        """
        q = self.check_positions(q)
        model, data = self._rigid.model, self._rigid.model.createData()
        flat = q.reshape(-1, q.shape[-1])
        points = np.empty((*flat.shape, 3))
        for own, configuration in zip(points, flat, strict=True):
            pin.forwardKinematics(model, data, configuration)
            own[:] = [placement.translation for placement in data.oMi[1:]]
        return points.reshape(*q.shape, 3)

    def jacobian(self, q: ArrayLike) -> Jacobian:
        """Return the geometric Jacobian of the tool centre point (paper Eq. 1-2).

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        """
        q = self.check_positions(q)
        return evaluate_jacobian(self._rigid, q, self._rigid.joint_columns)

    def foot(self, q: ArrayLike) -> FloatArray:
        """Return where the arm stands: the origin of its first joint in base, external axes moved.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (..., 3)
            In m.
        """
        q = self.check_positions(q)
        before, first = (
            self.chain.joints[: self.external_axes],
            self.chain.joints[self.external_axes],
        )
        place = np.broadcast_to(first.placement[:3, 3], (*q.shape[:-1], 3))
        for number, joint in reversed(list(enumerate(before))):
            travel = q[..., number, None] * joint.axis
            if joint.revolute:
                turn = Rotation.from_rotvec(travel.reshape(-1, 3)).as_matrix()
                place = (turn @ place.reshape(-1, 3, 1)).reshape(place.shape)
            else:
                place = place + travel
            place = place @ joint.placement[:3, :3].T + joint.placement[:3, 3]
        return np.array(place)

    @property
    def has_masses(self) -> bool:
        """Whether any link has a mass, so that gravity torques are known."""
        return any(joint.mass > 0.0 for joint in self.chain.joints)

    def gravity_torques(self, q: ArrayLike, gravity: ArrayLike | None = None) -> FloatArray:
        """Return the joint torques that hold the robot still under its own weight.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        gravity : array_like, shape (3,), optional
            Acceleration of gravity in base, in m/s². Default: the robot's own.

        Returns
        -------
        ndarray, shape (..., joint)
            Torques in N·m, forces in N for prismatic joints.

        Raises
        ------
        RobotError
            If no link of the robot has a mass.
        """
        if not self.has_masses:
            raise RobotError(f"robot {self.name!r} has no link masses: gravity torques unknown")
        acceleration = self.gravity if gravity is None else gravity
        q = self.check_positions(q)
        return -evaluate_weight(self._rigid, q, self._rigid.joint_columns, acceleration)

    def payload_wrench(
        self, q: ArrayLike, mass: float, centre: ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return the load of a mass that hangs at the tool: a load case's force and moment.

        The weight acts where it hangs: moved to the tool centre point it is a force, and a moment
        by its lever arm.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.
        mass : float
            In kg.
        centre : array_like, shape (3,)
            Centre of the mass in the tcp frame, in m.

        Returns
        -------
        force : ndarray, shape (..., 3)
        moment : ndarray, shape (..., 3)
            On the robot at the tool centre point, in base, in N and N·m.
        """
        R_base_tcp = self.forward(q)[..., :3, :3]
        lever = R_base_tcp @ np.asarray(centre, dtype=float)
        force = np.broadcast_to(mass * np.asarray(self.gravity), lever.shape)
        return np.array(force), np.cross(lever, force)

    def check_positions(self, q: ArrayLike) -> FloatArray:
        """Return ``q`` as a float array, or refuse it by shape or value.

        Raises
        ------
        RobotError
            If the last axis is not the number of joints or a value is not finite.
        """
        array = as_numbers(q, "joint positions")
        count = len(self.chain.joints)
        if array.ndim == 0 or array.shape[-1] != count:
            raise RobotError(
                f"joint positions of shape {array.shape}: the last axis must be the {count} joints"
                f" of {self.name} ({', '.join(self.joint_names)})"
            )
        if not np.all(np.isfinite(array)):
            raise RobotError(f"joint positions of {self.name} hold a value that is not finite")
        return array


def _joint_row(joint: ChainJoint) -> str:
    """Return name, range, speed and torque of a joint as a row to read."""
    one, unit, torque = (180.0 / np.pi, "deg", "N·m") if joint.revolute else (1e3, "mm", "N")
    figures = ((joint.velocity * one, f"{unit}/s"), (joint.effort, torque))
    known = [f"{value:.4g} {name}" for value, name in figures if not np.isnan(value)]
    ends = f"{one * joint.lower:.5g} to {one * joint.upper:.5g} {unit}"
    return ", ".join([f"{joint.name}: {ends}", *known])


def evaluate_weight(
    chain: ChainModel, q: FloatArray, columns: IndexArray, gravity: ArrayLike
) -> FloatArray:
    """Return the torques that the weight of the links exerts about named columns of a chain.

    Parameters
    ----------
    chain : ChainModel
        The model; inserted joints stay at zero.
    q : ndarray, shape (..., joint)
        Positions of the chain's own joints in rad or m.
    columns : ndarray of int, shape (column,)
        Which columns of the model to return, in which order.
    gravity : array_like, shape (3,)
        Acceleration of gravity in base, in m/s².

    Returns
    -------
    ndarray, shape (..., column)
        In N·m; forces in N along prismatic joints.
    """
    model = chain.model.copy()
    model.gravity.linear = np.asarray(gravity, dtype=float)
    data = model.createData()
    held = [
        pin.computeGeneralizedGravity(model, data, configuration).copy()
        for configuration in _configurations(chain, q)
    ]
    torques: FloatArray = -np.array(held).reshape(-1, model.nv)[:, columns]
    return torques.reshape(*q.shape[:-1], len(columns))


def _configurations(chain: ChainModel, q: FloatArray) -> FloatArray:
    """Return the positions of all joints of a model, those inserted at zero, as rows."""
    flat = q.reshape(-1, q.shape[-1])
    full = np.zeros((len(flat), chain.model.nq))
    full[:, chain.joint_columns] = flat
    return full


def evaluate_jacobian(chain: ChainModel, q: FloatArray, columns: IndexArray) -> Jacobian:
    """Return the named columns of a chain model's tip Jacobian in base axes.

    Parameters
    ----------
    chain : ChainModel
        The model; inserted joints stay at zero.
    q : ndarray, shape (..., joint)
        Positions of the chain's own joints in rad or m.
    columns : ndarray of int, shape (column,)
        Which columns of the model to return, in which order.
    """
    model, data = chain.model, chain.model.createData()
    full = _configurations(chain, q)
    rows = np.empty((len(full), 6, model.nv))
    # A chain of one joint comes back from Pinocchio flat.
    targets = rows if model.nv > 1 else rows[:, :, 0]
    frame, axes = chain.tip_frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobian = pin.computeFrameJacobian
    for target, configuration in zip(targets, full, strict=True):
        target[:] = jacobian(model, data, configuration, frame, axes)
    picked = np.take(rows, columns, axis=2).reshape(*q.shape[:-1], 6, len(columns))
    return Jacobian(picked[..., :3, :], picked[..., 3:, :])
