"""Static postures for ``elastocal tool``: from a CSV file, or the unloaded references of a run."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, load_cell
from elastocal.compensation.conditioning import (
    SensorMount,
    StaticPostures,
    read_postures,
    static_postures,
)
from elastocal.errors import CompensationError, ProcedureError
from elastocal.procedure import (
    PoseReadings,
    RunFolder,
    commits,
    read_journal,
    read_streams,
    reduce_pose,
)
from elastocal.robot import GRAVITY, Robot


@dataclass(frozen=True, eq=False)
class ToolSource:
    """Postures, and what is known of the sensor beside them."""

    postures: StaticPostures
    mount: SensorMount
    R_nominal: FloatArray
    """Of the sensor in the flange, as mounted."""
    expected_centre: FloatArray | None
    """Of mass, in the sensor's frame, in m."""
    points: dict[str, FloatArray]
    """Points that moments may be about by mistake, in the sensor's frame, in m."""


def from_table(
    path: Path, robot: Robot | None, flange: str, T_flange_sensor: FloatArray, down: FloatArray
) -> ToolSource:
    """Return the postures of a CSV file.

    Parameters
    ----------
    path : Path
        The file.
    robot : Robot, optional
        To any link; for a file with joints.
    flange : str
        Link that the sensor sits on.
    T_flange_sensor : ndarray, shape (4, 4)
        The sensor as mounted.
    down : ndarray, shape (3,)
        Direction of gravity in base, any length but 0.
    """
    length = float(np.linalg.norm(down))
    if not 0.0 < length < np.inf:
        raise CompensationError(f"direction of gravity {down.tolist()} must be finite and not zero")
    gravity = down * (-GRAVITY[2] / length)
    arm = None if robot is None else Robot.from_urdf(robot.urdf, flange, robot.base)
    R, origin = T_flange_sensor[:3, :3], T_flange_sensor[:3, 3]
    points = {} if not np.any(origin) else {"flange": -origin @ R}
    mount = SensorMount(flange, origin, gravity)
    return ToolSource(read_postures(path, arm, gravity), mount, R, None, points)


def from_run(run: Path) -> ToolSource:
    """Return the unloaded references of a run as postures, the cell's sensor as mounted.

    Raises
    ------
    ProcedureError
        If no pose is committed or the cell has no sensor.
    CompensationError
        If there are fewer than three.
    """
    folder = RunFolder(run)
    entries = read_journal(folder.journal)
    latest = {log.pose: log for log in commits(entries)}
    if not entries or entries[0].run is None or not latest:
        raise ProcedureError(f"{folder.journal}: no pose is committed")
    cell = load_cell(folder.cell / entries[0].run.cell_file)
    sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
    if sensor is None or T_sensor_tcp is None:
        raise ProcedureError(f"cell {cell.name!r} has no force sensor (key 'sensor')")
    poses = [
        reduce_pose(
            log,
            read_streams(folder.streams / log.streams, [(w.start, w.end) for w in log.windows]),
        )
        for log in latest.values()
    ]
    T = sensor.T_flange_sensor
    centre = (cell.file.tool.centre - T[:3, 3]) @ T[:3, :3]
    points = {"tool centre point": T_sensor_tcp[:3, 3], "flange": -T[:3, 3] @ T[:3, :3]}
    mount = SensorMount(cell.file.robot.flange, T[:3, 3], cell.gravity_base)
    return ToolSource(_unloaded(poses, cell), mount, T[:3, :3], centre, points)


def _unloaded(poses: list[PoseReadings], cell: Cell) -> StaticPostures:
    states = [r.tool for pose in poses if (r := pose.reference) and r.tool]
    R_base_tcp = np.array([state.T_base_tcp[:3, :3] for state in states]).reshape(-1, 3, 3)
    return static_postures(
        R_base_tcp @ cell.T_flange_tcp[:3, :3].T,
        np.array([state.force.value for state in states]).reshape(-1, 3),
        np.array([state.moment.value for state in states]).reshape(-1, 3),
        cell.gravity_base,
    )
