"""Static postures: raw wrenches of a sensor that carries nothing but its tool.

A CSV file of them has ``force_x[N] … moment_x[N*m] …`` in the sensor's frame, and either the
robot's joints, or the flange's orientation in base as ``a[deg] b[deg] c[deg]`` (KUKA Z-Y'-X'') or
``qx qy qz qw``.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import PathTable, find_posture_columns, in_file
from elastocal.errors import CompensationError, PathError, present
from elastocal.files import Limit
from elastocal.results import brief_repr
from elastocal.robot import GRAVITY, Robot

LEAST_POSTURES = 3
"""Fewest postures; with fewer, nothing is left to test the fit."""
_QUATERNION = 4
"""Columns of an orientation as a quaternion."""

_MOST_POSTURES = Limit("ELASTOCAL_MAX_POSTURES", 500, "static postures")
"""A tool is weighed at some dozen; fits of left-out ones hold a number for each pair of rows."""


@brief_repr
@dataclass(frozen=True, eq=False)
class StaticPostures:
    """Raw wrenches with the flange's orientation, nothing touching the tool."""

    R_base_flange: FloatArray
    """Rotation of the flange in base, shape (posture, 3, 3)."""
    force: FloatArray
    """In the sensor's frame, shape (posture, 3), in N."""
    moment: FloatArray
    """In the sensor's frame, about its origin, shape (posture, 3), in N·m."""
    gravity: FloatArray
    """Acceleration of gravity in base, shape (3,), in m/s²."""
    course: FloatArray
    """When each was taken: rises by 1 from first to last, mean 0, shape (posture,)."""
    quaternions: bool = False
    """Whether the orientations came as quaternions, of which there are two orders."""

    def __len__(self) -> int:
        """Return the number of postures."""
        return len(self.force)

    @property
    def gravity_flange(self) -> FloatArray:
        """Gravity in the flange's axes, shape (posture, 3), in m/s²."""
        return self.gravity @ self.R_base_flange

    @property
    def spread(self) -> float:
        """Largest angle between gravity in two postures, as the flange sees it, in rad."""
        directions = self.gravity_flange / np.linalg.norm(self.gravity)
        return float(np.arccos(np.clip((directions @ directions.T).min(), -1.0, 1.0)))

    def chosen(self, kept: BoolArray) -> "StaticPostures":
        """Return some of the postures, in their order, at the times that they have."""
        return replace(
            self,
            R_base_flange=self.R_base_flange[kept],
            force=self.force[kept],
            moment=self.moment[kept],
            course=self.course[kept],
        )

    def read_as(
        self,
        force: FloatArray | None = None,
        moment: FloatArray | None = None,
        R_base_flange: FloatArray | None = None,
    ) -> "StaticPostures":
        """Return the same postures with numbers that are read otherwise."""
        return replace(
            self,
            force=self.force if force is None else force,
            moment=self.moment if moment is None else moment,
            R_base_flange=self.R_base_flange if R_base_flange is None else R_base_flange,
        )


def static_postures(
    R_base_flange: FloatArray,
    force: FloatArray,
    moment: FloatArray,
    gravity: FloatArray | None = None,
    time: FloatArray | None = None,
) -> StaticPostures:
    """Return checked postures in the order of time, at any ``time`` or evenly one by one.

    See `StaticPostures`.

    Raises
    ------
    CompensationError
        If there are fewer than three, shapes differ, or a number is not finite.
    """
    gravity = np.array(GRAVITY) if gravity is None else gravity
    n = len(force)
    taken = np.arange(n, dtype=float) if time is None else np.array(time, dtype=float)
    course = (taken - taken.mean()) / (np.ptp(taken) or 1.0) if n else taken
    R, F, M, g = (np.array(x, dtype=float) for x in (R_base_flange, force, moment, gravity))
    made = StaticPostures(R, F, M, g, course)
    if n < LEAST_POSTURES:
        raise CompensationError(
            f"{n} postures: the tool's weight needs at least {LEAST_POSTURES}, and better 8 or more"
            " that turn the sensor about two axes"
        )
    shapes = (made.R_base_flange.shape, made.force.shape, made.moment.shape, made.gravity.shape)
    if shapes != ((n, 3, 3), (n, 3), (n, 3), (3,)):
        raise CompensationError(f"postures of shapes {shapes}: rotation, force, moment and gravity")
    for name in ("R_base_flange", "force", "moment", "gravity"):
        if not np.all(np.isfinite(getattr(made, name))):
            raise CompensationError(f"{name} of the postures holds a value that is not finite")
    return made


def read_postures(
    path: Path, robot: Robot | None = None, gravity: FloatArray | None = None
) -> StaticPostures:
    """Return the postures of a CSV file.

    Parameters
    ----------
    path : Path
        The file.
    robot : Robot, optional
        To the link that the sensor sits on; needed where the file has joints.
    gravity : ndarray, shape (3,), optional
        In base, in m/s²; straight down by default.

    Raises
    ------
    CompensationError
        If there is neither joints nor orientations, too few rows, or a number that cannot be meant.
    FileAccessError
        If the file cannot be read.
    """
    with in_file(path):
        table = PathTable.open(path, lambda header: find_posture_columns(header, robot))
        rows = table.rows()
        if rows.force is None or rows.moment is None:
            raise PathError(
                "columns moment_x[N*m] … are missing: the centre of mass and three biases come"
                " from them"
            )
        T = rows.T_base_tcp
        if T is None:
            robot = present(robot, "robot")
            T = robot.forward(rows.joints)
    try:
        postures = static_postures(T[:, :3, :3], rows.force, rows.moment, gravity)
    except CompensationError as error:
        raise CompensationError(f"{path}: {error}") from error
    _MOST_POSTURES.require(len(postures), f"{path}: {len(postures)} rows")
    return replace(postures, quaternions=len(table.columns.orientation) == _QUATERNION)
