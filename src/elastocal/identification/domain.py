"""Domain of a calibration: its postures and loads, as the model file holds them.

`elastocal.identification.production` decides which rows lie within it. Presses held by friction
never point as far sideways as a cutter's force, but deflections of small forces superpose. So a
force, in the tool's frame, is within the calibrated loads when the tool was pushed as hard in its
directions, one by one:

    hypot(fx / Fx, fy / Fy) <= 1,   0 <= -fz / Fz <= 1,

with ``Fx`` the largest calibrated force to the side that ``fx`` points to, and so on; the larger of
the two is the *level* of the force. A side to which nothing was pushed has no level; a hundredth
of the largest calibrated force is nothing, since no sensor reads zero. A moment, where rows have
one, is within them when its torque about each joint is within the largest that a
calibrated load made there.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import SchemaError
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot

LEVEL_REACH = 1.05
"""Largest level of a covered force: forces are never met exactly."""
_SIDES = ("+x", "-x", "+y", "-y", "press")
_LEAST = 1e-3
"""Force in N below which there is none."""
_LEAST_SHARE = 0.01
"""Part of the largest calibrated force below which nothing is pushed to a side."""
_LEAST_TORQUE = 0.05
"""Part of the largest calibrated torque that every joint is taken to have met: no force presses
about the axis on which the tool sits."""


@brief_repr
@record(eq=False)
class CalibrationDomain:
    """Poses, loads and speeds of a calibration."""

    joint_position: FloatArray
    """Calibrated poses, shape (pose, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base of every reading, shape (reading, 3), in N."""
    moment: FloatArray | None
    """Moment on the robot about the tcp in base, shape (reading, 3), in N·m; none: no moment."""
    torque_low: FloatArray
    """Smallest torque of a load about each joint, or 0, shape (joint,), in N·m or N."""
    torque_high: FloatArray
    """Largest, or 0."""
    reading_pose: IndexArray
    """Row of `joint_position` of every reading, shape (reading,)."""
    speed: FloatArray | None = None
    """Largest speed of each joint while a reading was taken, shape (joint,), in rad/s or m/s;
    none: not known, as of datasets, whose readings are taken at rest."""

    def __post_init__(self) -> None:
        """Refuse arrays that do not belong together.

        Raises
        ------
        SchemaError
            By the name of the array.
        """
        poses, joints = self.joint_position.shape if self.joint_position.ndim == 2 else (0, 0)
        if not poses:
            raise SchemaError("domain.joint_position must have a row for each pose")
        rows = (len(self.force), 3)
        shapes = {"force": rows, "moment": rows, "reading_pose": rows[:1]}
        shapes |= dict.fromkeys(("torque_low", "torque_high", "speed"), (joints,))
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array is not None and array.shape != shape:
                raise SchemaError(f"domain.{name} has shape {array.shape}, not {shape}")
        if not np.all((self.reading_pose >= 0) & (self.reading_pose < poses)):
            raise SchemaError(f"domain.reading_pose must name one of {poses} poses")

    @classmethod
    def of(cls, robot: Robot, readings: Readings, block: IndexArray) -> "CalibrationDomain":
        """Return the domain of readings.

        Parameters
        ----------
        readings : Readings
            Those that entered the fit.
        block : ndarray, shape (reading,)
            Pose block of each (`pose_blocks`).
        """
        _, pose, counts = np.unique(block, return_inverse=True, return_counts=True)
        q = np.zeros((len(counts), readings.joint_position.shape[1]))
        np.add.at(q, pose, readings.joint_position)
        torque = _load_torques(robot, readings.joint_position, readings.force, readings.moment)
        return cls(
            joint_position=q / counts[:, None],
            force=np.array(readings.force),
            moment=None if readings.moment is None else np.array(readings.moment),
            torque_low=np.minimum(torque.min(axis=0), 0.0),
            torque_high=np.maximum(torque.max(axis=0), 0.0),
            reading_pose=np.asarray(pose, dtype=np.intp),
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class CalibratedLoads:
    """Calibrated postures, and how hard was pushed at each."""

    joint_position: FloatArray
    """Shape (pose, joint), in rad or m."""
    largest: FloatArray
    """Largest force on the robot towards +x, -x, +y, -y and -z of the tcp, (pose, 5), in N."""
    direction: FloatArray
    """Unit vectors along the forces on the robot, tcp frame, shape (load, 3)."""
    torque: FloatArray
    """Largest torque of a load about each joint, in size, shape (joint,), in N·m or N."""
    least: float
    """Force up to which nothing is pushed to a side, in N."""

    @classmethod
    def of_domain(cls, robot: Robot, domain: CalibrationDomain) -> "CalibratedLoads":
        """Return the loads of a domain."""
        q, pose = domain.joint_position, domain.reading_pose
        torque = np.maximum(domain.torque_high, -domain.torque_low)
        return cls._of(q, force_in_tcp(robot, q[pose], domain.force), pose, torque)

    @classmethod
    def of_forces(
        cls, robot: Robot, q: FloatArray, force_tcp: FloatArray, pose: IndexArray
    ) -> "CalibratedLoads":
        """Return the loads of readings.

        Parameters
        ----------
        robot : Robot
            The robot, with its tool.
        q : ndarray, shape (pose, joint)
            Postures, in rad or m.
        force_tcp : ndarray, shape (reading, 3)
            Force on the robot in the tcp frame, in N.
        pose : ndarray of int, shape (reading,)
            Posture of each reading.
        """
        force = np.einsum("rij,rj->ri", robot.forward(q)[pose, :3, :3], force_tcp)
        torque = np.abs(_load_torques(robot, q[pose], force, None)).max(axis=0)
        return cls._of(q, force_tcp, pose, torque)

    @classmethod
    def _of(
        cls, q: FloatArray, force_tcp: FloatArray, pose: IndexArray, torque: FloatArray
    ) -> "CalibratedLoads":
        size = np.linalg.norm(force_tcp, axis=1, keepdims=True)
        least = max(_LEAST, _LEAST_SHARE * float(size.max(initial=0.0)))
        pushed = _sides(force_tcp)
        largest = np.zeros((len(q), len(_SIDES)))
        np.maximum.at(largest, pose, pushed)
        # Lateral loads may point between the axes of the tool: each is within what was pressed.
        own = _aside(_parts(pushed, largest[pose], least))
        beyond = np.ones(len(q))
        np.maximum.at(beyond, pose, np.where(np.isfinite(own), own, 1.0))
        largest[:, :4] *= beyond[:, None]
        units = (force_tcp / np.maximum(size, _LEAST))[size[:, 0] > _LEAST]
        # Readings of one load case at all poses have nearly the same direction: one of them is
        # enough.
        _, first = np.unique(np.round(units, 1), axis=0, return_index=True)
        return cls(q, largest, units[first], torque, least)

    def levels(self, force_tcp: FloatArray) -> FloatArray:
        """Return the level of forces at each posture, shape (row, pose).

        Parameters
        ----------
        force_tcp : ndarray, shape (row, 3)
            Force on the robot in the tcp frame, in N.
        """
        part = _parts(_sides(force_tcp)[:, None], self.largest, self.least)
        pull = np.maximum(force_tcp[:, 2:3], 0.0) / np.maximum(self.largest[:, 4], _LEAST)
        pulls = np.where(pull > LEVEL_REACH - 1.0, np.inf, 0.0)
        return np.asarray(np.maximum(np.maximum(_aside(part), part[..., 4]), pulls))

    def moment_levels(self, robot: Robot, q: FloatArray, moment: FloatArray) -> FloatArray:
        """Return the torques of moments in parts of those calibrated, the largest, shape (row,).

        Parameters
        ----------
        robot : Robot
            The robot, with its tool.
        q : ndarray, shape (row, joint)
            Joint positions, in rad or m.
        moment : ndarray, shape (row, 3)
            Moment on the robot about the tcp in base, in N·m.
        """
        torque = np.abs(_load_torques(robot, q, np.zeros_like(moment), moment))
        known = np.maximum(self.torque, max(_LEAST_TORQUE * self.torque.max(), _LEAST))
        return np.asarray((torque / known).max(axis=1))


def _parts(pushed: FloatArray, largest: FloatArray, least: float) -> FloatArray:
    """Return forces to each side in parts of the largest there; infinite where nothing was."""
    with np.errstate(divide="ignore", invalid="ignore"):
        part = pushed / np.where(largest > least, largest, 0.0)
    return np.where(pushed > least, part, 0.0)


def _aside(part: FloatArray) -> FloatArray:
    """Return the level of the lateral forces, shape (...), of their parts (..., 5)."""
    return np.asarray(np.hypot(part[..., :2].max(axis=-1), part[..., 2:4].max(axis=-1)))


def _sides(force_tcp: FloatArray) -> FloatArray:
    """Return the part of forces towards each of `_SIDES`, shape (row, 5), in N."""
    x, y, z = force_tcp.T
    return np.asarray(np.maximum(np.stack([x, -x, y, -y, -z], axis=1), 0.0))


def force_in_tcp(robot: Robot, q: FloatArray, force: FloatArray) -> FloatArray:
    """Return forces in the tcp frame, shape (row, 3), in N.

    Parameters
    ----------
    robot : Robot
        The robot, with its tool.
    q : ndarray, shape (row, joint)
        Joint positions, in rad or m.
    force : ndarray, shape (row, 3)
        In base, in N.
    """
    return np.asarray(np.einsum("rji,rj->ri", robot.forward(q)[:, :3, :3], force))


def _load_torques(
    robot: Robot, q: FloatArray, force: FloatArray, moment: FloatArray | None
) -> FloatArray:
    return ElasticModel(robot, actuated(robot)).load_torques(q, force, moment)
