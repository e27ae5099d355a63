"""Poses and forces that ``elastocal compare`` looks at."""

from pathlib import Path

from elastocal import dataset
from elastocal.arrays import FloatArray
from elastocal.dataset import joint_dimensions, read_load_rows
from elastocal.errors import DatasetError
from elastocal.identification import read_model
from elastocal.identification.recertification import check_same_robot
from elastocal.robot import Robot

Loads = tuple[FloatArray, FloatArray, FloatArray | None]
"""Joint positions, forces, and moments if there are any, a row each."""


def read_rows(path: Path, model: Path) -> Loads:
    """Return the rows of a CSV file or the readings of a dataset.

    Parameters
    ----------
    path : Path
        CSV as for `elastocal predict`, or a dataset.
    model : Path
        Model file whose robot the rows are for.

    Raises
    ------
    DatasetError
        If there are no rows, a column is missing, or the dataset is of another robot.
    SchemaError, IdentificationError
        If the model is none, or the dataset's robot is another.
    FileAccessError
        If a file cannot be read.
    """
    robot = read_model(model).model.robot
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".nc"):
        raise DatasetError(f"{path}: suffix {path.suffix!r} is not one of .csv, .nc")
    loads = _of_dataset(path, robot, model) if suffix == ".nc" else _of_table(path, robot)
    if not len(loads[0]):
        raise DatasetError(f"{path} holds no row")
    return loads


def measured_rows(provenance: str) -> Path | None:
    """Return the dataset that a model says it was calibrated on, if it is there."""
    path = Path(provenance.partition(";")[0].strip())
    return path if path.suffix.lower() in (".nc", ".csv") and path.is_file() else None


def _of_table(path: Path, robot: Robot) -> Loads:
    rows = read_load_rows(path, joint_dimensions(robot.joint_names, robot.revolute))
    return rows.joint_position, rows.force, rows.moment


def _of_dataset(path: Path, robot: Robot, model: Path) -> Loads:
    data = dataset.read(path)
    if data.robot_urdf is not None and data.tcp_frame is not None:
        base = robot.base if data.robot_urdf == robot.urdf else None
        measured = Robot.from_urdf(data.robot_urdf, data.tcp_frame, base)
        check_same_robot(measured, robot, (str(path), str(model)))
    try:
        readings = data.readings(robot.joint_names)
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error
    return readings.joint_position, readings.force, readings.moment
