"""The tables of a survey: every spin and stand, and the postures to choose from."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.stiffness.choose import Hold
from elastocal.compensation.stiffness.directional import directional, ellipsoid
from elastocal.compensation.stiffness.stations import Stations
from elastocal.compensation.stiffness.survey import Survey
from elastocal.files import write_text
from elastocal.identification import CalibratedModel
from elastocal.robot import Robot


def write_survey(path: Path, robot: Robot, stations: Stations, survey: Survey) -> Path:
    """Write a row for each station, spin and stand: its stiffest branch; return the path.

    Columns: line of the path, spin, external axes, stiffness along the direction, joints. Where no
    posture is allowed, stiffness and joints are empty.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    spins, stands = survey.grid.spins, survey.grid.external
    external = robot.joint_names[: robot.external_axes]
    names = [_header(robot, name) for name in external]
    header = ["line", "spin[deg]", *names, "stiffness[N/m]", *_arm_headers(robot)]
    filled = np.where(np.isnan(survey.stiffness), -np.inf, survey.stiffness)
    rows: list[list[str]] = []
    for index in np.ndindex(*survey.stiffness.shape[:3]):
        station, spin, stand = index
        branch = int(filled[index].argmax())
        k = float(survey.stiffness[(*index, branch)])
        q = (
            survey.q[(*index, branch)]
            if not np.isnan(k)
            else np.full(len(robot.joint_names), np.nan)
        )
        held = _shown(robot, stands[stand])
        arm = _shown(robot, q)[robot.external_axes :]
        line = str(stations.lines[station])
        rows.append([line, _number(float(np.degrees(spins[spin]))), *held, _number(k), *arm])
    return _write(path, header, rows)


def write_choice(
    path: Path,
    calibrated: CalibratedModel,
    stations: Stations,
    direction: FloatArray,
    holds: Sequence[Hold],
) -> Path:
    """Write a row for each chosen posture at each station; return the path.

    Columns: choice, line, spin, joints, stiffness along the direction with its 95 % interval, and
    the principal stiffnesses, softest first, with their axes in base.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    robot = calibrated.model.robot
    header = [
        *("choice", "line", "spin[deg]"),
        *(_header(robot, name) for name in robot.joint_names),
        *(f"stiffness{end}[N/m]" for end in ("", "_low", "_high")),
        *(f"principal_{number}[N/m]" for number in (1, 2, 3)),
        *(f"axis_{number}_{axis}" for number in (1, 2, 3) for axis in "xyz"),
    ]
    rows: list[list[str]] = []
    for hold in holds:
        there = np.flatnonzero(np.isfinite(hold.q).all(axis=1))
        k = directional(calibrated, hold.q[there], direction[there])
        shape = ellipsoid(calibrated, hold.q[there])
        for place, station in enumerate(there.tolist()):
            numbers = [k.stiffness[place], k.low[place], k.high[place], *shape.stiffness[place]]
            rows.append(
                [
                    *(hold.name, str(stations.lines[station])),
                    _number(np.degrees(hold.spin[station])),
                    *_shown(robot, hold.q[station]),
                    *map(_number, numbers),
                    *map(_number, shape.axes[place].T.ravel()),
                ]
            )
    return _write(path, header, rows)


def _write(path: Path, header: list[str], rows: list[list[str]]) -> Path:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([header, *rows])
    write_text(path, text.getvalue())
    return path


def _arm_headers(robot: Robot) -> list[str]:
    return [_header(robot, name) for name in robot.joint_names[robot.external_axes :]]


def _header(robot: Robot, name: str) -> str:
    return f"{name}[{'deg' if robot.revolute[robot.joint_names.index(name)] else 'mm'}]"


def _shown(robot: Robot, q: FloatArray) -> list[str]:
    """Return positions of the robot's first joints in deg or mm."""
    scale = np.where(robot.revolute, 180.0 / np.pi, 1e3)[: len(q)]
    return [_number(value) for value in (q * scale).tolist()]


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.9g}"
