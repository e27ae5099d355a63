"""Static postures from a CSV file: joints or orientations, and raw wrenches.

``force_x[N] … moment_x[N*m] …`` in the sensor's frame, and either the robot's joints, or the
flange's orientation in base as ``a[deg] b[deg] c[deg]`` (KUKA Z-Y'-X'') or ``qx qy qz qw``.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures, static_postures
from elastocal.compensation.path import beyond_a_turn
from elastocal.dataset import LoadRows, joint_dimensions, read_load_rows
from elastocal.errors import CompensationError
from elastocal.files import read_text
from elastocal.robot import Robot, T_from_xyzabc

_ANGLES = ("a", "b", "c")
_QUATERNION = ("qx", "qy", "qz", "qw")
_UNIT = 1e-2
"""How far the length of a quaternion may be from 1."""


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
        If there is neither joints nor orientations, too few rows, or an orientation that is none.
    DatasetError, FileAccessError
        If the file cannot be read.
    """
    header = [name.split("[")[0].strip() for name in _header(path)]
    if set(_QUATERNION) <= set(header):
        rows = read_load_rows(path, {})
        R = _from_quaternions(path, rows, header)
    elif set(_ANGLES) <= set(header):
        rows = read_load_rows(path, dict.fromkeys(_ANGLES, "angle"))
        found = beyond_a_turn(rows.joint_position)
        if found is not None:
            row, k = found
            raise CompensationError(
                f"{path}: posture {row + 1}: {_ANGLES[k]} of"
                f" {np.degrees(rows.joint_position[row, k]):.4g} deg is more than a turn: is it in"
                " degrees?"
            )
        zero = np.zeros(len(rows.force))
        R = T_from_xyzabc(zero, zero, zero, *rows.joint_position.T)[:, :3, :3]
    elif robot is not None:
        rows = read_load_rows(path, joint_dimensions(robot.joint_names, robot.revolute))
        R = robot.forward(rows.joint_position)[:, :3, :3]
    else:
        raise CompensationError(
            f"{path}: no orientation of the flange (a[deg] b[deg] c[deg], or qx qy qz qw): give"
            " --robot for a file with joints"
        )
    if rows.moment is None:
        raise CompensationError(
            f"{path}: columns moment_x[N*m] … are missing: the centre of mass"
            " and three biases come from them"
        )
    try:
        return static_postures(R, rows.force, rows.moment, gravity)
    except CompensationError as error:
        raise CompensationError(f"{path}: {error}") from error


def _header(path: Path) -> list[str]:
    """Return the cells of the first line that is no comment."""
    lines = (line for line in read_text(path).splitlines() if line.strip())
    first = next((line for line in lines if not line.startswith("#")), "")
    return first.replace(";", ",").replace("\t", ",").split(",")


def _from_quaternions(path: Path, rows: LoadRows, header: list[str]) -> FloatArray:
    columns = [header.index(name) for name in _QUATERNION]
    try:
        quaternions = np.array([[float(cells[k]) for k in columns] for cells in rows.cells])
    except ValueError as error:
        raise CompensationError(f"{path}: a quaternion is not four numbers: {error}") from error
    off = np.abs(np.linalg.norm(quaternions, axis=1) - 1.0)
    if not off.max() <= _UNIT:
        row = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        raise CompensationError(
            f"{path}: quaternion {quaternions[row].tolist()} of posture {row + 1} has not length 1"
        )
    rotations: FloatArray = Rotation.from_quat(quaternions).as_matrix()
    return rotations
