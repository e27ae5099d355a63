"""Where a calibration was made: its poses and loads, and which rows lie outside.

Intervals speak of poses and forces like those of the calibration. Elsewhere the arm does what
springs cannot express, and nothing in the data says how much. So a model keeps where it was
calibrated, and a row lies outside by its *pose* when the nearest calibrated pose is farther than
`REACH` times the median distance of the calibrated poses from their nearest neighbours; by its
*load* when the torque about a joint leaves the range from rest to the calibrated torques.
"""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import SchemaError
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import counted

REACH = 2.0
"""Largest distance from a calibrated pose, in usual distances of these from one another."""
_TORQUE_ALLOWANCE = 0.05
"""Part of the largest calibrated torque by which every range is wider: forces are never met
exactly, and a joint that no force loads has no range of its own."""
_CHUNK = 2000
"""Rows whose distances are taken at a time."""


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
        """Return where readings were taken.

        Parameters
        ----------
        robot : Robot
            The robot.
        readings : Readings
            Those that entered the fit.
        block : ndarray, shape (reading,)
            Pose block of each (`pose_blocks`).
        """
        _, pose, counts = np.unique(block, return_inverse=True, return_counts=True)
        q = np.zeros((len(counts), readings.joint_position.shape[1]))
        np.add.at(q, pose, readings.joint_position)
        torque = _torques(robot, readings.joint_position, readings.force, readings.moment)
        return cls(
            joint_position=q / counts[:, None],
            force=np.array(readings.force),
            moment=None if readings.moment is None else np.array(readings.moment),
            torque_low=np.minimum(torque.min(axis=0), 0.0),
            torque_high=np.maximum(torque.max(axis=0), 0.0),
            reading_pose=np.asarray(pose, dtype=np.intp),
        )

    def spacing(self, robot: Robot) -> float:
        """Return the median distance of the poses from their nearest neighbours."""
        q = self.joint_position
        if len(q) < 2:
            return 0.0
        apart = _distances(robot, q, q)
        np.fill_diagonal(apart, np.inf)
        return float(np.median(apart.min(axis=1)))

    def outside(
        self, robot: Robot, q: FloatArray, force: FloatArray, moment: FloatArray | None = None
    ) -> "OutsideRows":
        """Return which rows lie outside.

        Parameters
        ----------
        robot : Robot
            The robot that was calibrated.
        q : ndarray, shape (row, joint)
            Joint positions, in rad or m.
        force, moment : ndarray, shape (row, 3)
            Load on the robot at the tcp in base, in N and N·m.
        """
        distance = [
            _distances(robot, q[start : start + _CHUNK], self.joint_position).min(axis=1)
            for start in range(0, len(q), _CHUNK)
        ]
        torque = _torques(robot, q, force, moment)
        spare = _TORQUE_ALLOWANCE * max(self.torque_high.max(), -self.torque_low.min())
        inside = (torque >= self.torque_low - spare) & (torque <= self.torque_high + spare)
        far = np.concatenate([np.zeros(0), *distance]) > REACH * self.spacing(robot)
        return OutsideRows(far, np.asarray(~inside.all(axis=1)))

    def share_inside(
        self, other: "CalibrationDomain", robot: Robot, *, any_load: bool = False
    ) -> float:
        """Return the share of this calibration's readings that another one covers.

        Parameters
        ----------
        other : CalibrationDomain
            The other one.
        robot : Robot
            The robot with the tool of this calibration.
        any_load : bool
            Whether the pose alone decides.
        """
        q = self.joint_position[self.reading_pose]
        found = other.outside(robot, q, self.force, self.moment)
        return float(np.mean(~(found.pose if any_load else found.any)))


@brief_repr
@dataclass(frozen=True, eq=False)
class OutsideRows:
    """Which rows lie outside of where a model was calibrated."""

    pose: BoolArray
    """Whether it is too far from every calibrated pose, shape (row,)."""
    load: BoolArray
    """Whether a torque leaves the calibrated range, shape (row,)."""

    @property
    def any(self) -> BoolArray:
        """Whether a row lies outside by its pose or its load, shape (row,)."""
        return np.asarray(self.pose | self.load)

    def summary(self) -> "OutsideSummary":
        """Return the figures that files and messages show."""
        rows = np.flatnonzero(self.any)
        return OutsideSummary(
            rows=len(rows),
            of=len(self.pose),
            pose=int(self.pose.sum()),
            load=int(self.load.sum()),
            first=int(rows[0]) if len(rows) else None,
        )


@record()
class OutsideSummary:
    """How many rows lie outside of where a model was calibrated."""

    rows: int
    """Number of rows that lie outside."""
    of: int
    """Number of rows."""
    pose: int
    """Number of those too far from every calibrated pose."""
    load: int
    """Number of those with a torque beyond the calibrated range."""
    first: int | None
    """The first of them, counted from 0."""

    def plus(self, other: "OutsideSummary") -> "OutsideSummary":
        """Return the figures of these rows and those that follow them."""
        first = self.first
        if first is None and other.first is not None:
            first = self.of + other.first
        return OutsideSummary(
            self.rows + other.rows, self.of + other.of, self.pose + other.pose,
            self.load + other.load, first,
        )  # fmt: skip

    def sentence(self, rows: str = "row") -> str:
        """Return the figures in a line; empty where no row lies outside.

        Parameters
        ----------
        rows : str
            The noun for a row.
        """
        if self.first is None:
            return ""
        parts = [
            f"{count} {text}"
            for count, text in (
                (self.pose, f"farther than {REACH:g} usual distances from every calibrated pose"),
                (self.load, "with a torque about a joint beyond those calibrated"),
            )
            if count
        ]
        return (
            f"{self.rows} of {counted(self.of, rows)} lie outside of what was calibrated"
            f" ({', '.join(parts)}; first: {rows} {self.first + 1}): no interval covers them"
        )


def _distances(robot: Robot, q: FloatArray, poses: FloatArray) -> FloatArray:
    """Return distances in joint space, shape (row, pose): 1 m of a rail counts as 1 rad."""
    apart = q[:, None] - poses
    turns = np.round(apart / (2.0 * np.pi)) * 2.0 * np.pi
    apart -= np.where(robot.revolute, turns, 0.0)
    return np.asarray(np.linalg.norm(apart, axis=2))


def _torques(
    robot: Robot, q: FloatArray, force: FloatArray, moment: FloatArray | None
) -> FloatArray:
    return ElasticModel(robot, actuated(robot)).load_torques(q, force, moment)
