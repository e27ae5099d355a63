"""The best postures of a survey, and the tables of all postures and of the chosen ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.posture_survey import (
    PathStations,
    PostureSurvey,
    directional_stiffness,
    principal_stiffness,
)
from elastocal.identification import CalibratedModel
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, NumericalInverse
from elastocal.tables import write_table


@brief_repr
@dataclass(frozen=True, eq=False)
class PathPostures:
    """Postures along the path, one a station."""

    name: str
    q: FloatArray
    """Shape (station, joint), in rad or m; NaN where there is none."""
    spin: FloatArray
    """From the programmed orientation, shape (station,), in rad."""


@dataclass(frozen=True, eq=False)
class PostureChoice:
    """The postures to choose from."""

    one: PathPostures | None
    """One spin, external position and branch that are allowed at every station, and of these the
    one whose softest station is stiffest; None: there is none."""
    each: PathPostures
    """The stiffest posture of each station, however far from that of its neighbour."""


def choose_postures(survey: PostureSurvey, solver: InverseKinematics) -> PostureChoice:
    """Return the best postures of a survey.

    Parameters
    ----------
    survey : PostureSurvey
        All postures.
    solver : InverseKinematics
        Solver that found them. Only the branches of the closed form continue from station to
        station; for another solver, the stiffest posture of each station represents all.
    """
    stiffness = np.where(np.isnan(survey.stiffness), -np.inf, survey.stiffness)
    flat = stiffness.reshape(len(stiffness), -1)
    each = _path_postures(survey, "stiffest at each station", flat.argmax(axis=1))
    follows = not isinstance(solver, NumericalInverse)
    kept = stiffness if follows else stiffness.max(axis=-1, keepdims=True)
    softest = kept.min(axis=0)
    best = int(softest.argmax())
    if not softest.max() > 0.0:
        return PostureChoice(None, each)
    if follows:
        one = np.full(len(stiffness), best)
    else:
        stiffest = stiffness.argmax(axis=-1).reshape(len(stiffness), -1)
        one = stiffness.shape[-1] * best + stiffest[:, best]
    return PostureChoice(_path_postures(survey, "one posture for the path", one), each)


def _path_postures(survey: PostureSurvey, name: str, index: np.ndarray) -> PathPostures:
    stations = np.arange(len(survey.q))
    spin = np.unravel_index(index, survey.stiffness.shape[1:])[0]
    joints = survey.q.shape[-1]
    q = survey.q.reshape(len(stations), -1, joints)[stations, index].copy()
    refused = np.isnan(survey.stiffness.reshape(len(stations), -1)[stations, index])
    q[refused] = np.nan
    return PathPostures(name, q, np.where(~refused, survey.grid.spins[spin], np.nan))


def write_survey(path: Path, robot: Robot, stations: PathStations, survey: PostureSurvey) -> Path:
    """Write the stiffest branch of each station, spin and external position; return the path.

    Columns: line of the path, spin, external axes, stiffness along the direction, joints. Where no
    posture is allowed, stiffness and joints are empty.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    names, count = _headers(robot), robot.external_axes
    header = ["line", "spin[deg]", *names[:count], "stiffness[N/m]", *names[count:]]
    filled = np.where(np.isnan(survey.stiffness), -np.inf, survey.stiffness)
    rows: list[list[str]] = []
    for index in np.ndindex(*survey.stiffness.shape[:3]):
        station, spin, place = index
        branch = int(filled[index].argmax())
        k = float(survey.stiffness[(*index, branch)])
        q = np.where(np.isnan(k), np.nan, survey.q[(*index, branch)])
        held = _shown(robot, survey.grid.external[place])
        turned = _cell(float(np.degrees(survey.grid.spins[spin])))
        line = str(stations.lines[station])
        rows.append([line, turned, *held, _cell(k), *_shown(robot, q)[count:]])
    write_table(path, header, rows)
    return path


def write_choice(
    path: Path,
    calibrated: CalibratedModel,
    stations: PathStations,
    direction: FloatArray,
    choices: Sequence[PathPostures],
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
        *_headers(robot),
        *(f"stiffness{end}[N/m]" for end in ("", "_low", "_high")),
        *(f"principal_{number}[N/m]" for number in (1, 2, 3)),
        *(f"axis_{number}_{axis}" for number in (1, 2, 3) for axis in "xyz"),
    ]
    rows: list[list[str]] = []
    for postures in choices:
        there = np.flatnonzero(np.isfinite(postures.q).all(axis=1))
        k = directional_stiffness(calibrated, postures.q[there], direction[there])
        shape = principal_stiffness(calibrated, postures.q[there])
        for place, station in enumerate(there.tolist()):
            numbers = [k.stiffness[place], k.low[place], k.high[place], *shape.stiffness[place]]
            rows.append(
                [
                    *(postures.name, str(stations.lines[station])),
                    _cell(np.degrees(postures.spin[station])),
                    *_shown(robot, postures.q[station]),
                    *map(_cell, numbers),
                    *map(_cell, shape.axes[place].T.ravel()),
                ]
            )
    write_table(path, header, rows)
    return path


def _headers(robot: Robot) -> list[str]:
    joints = zip(robot.joint_names, robot.revolute, strict=True)
    return [f"{name}[{'deg' if turns else 'mm'}]" for name, turns in joints]


def _shown(robot: Robot, q: FloatArray) -> list[str]:
    """Return positions of the robot's first joints in deg or mm."""
    scale = np.where(robot.revolute, 180.0 / np.pi, 1e3)[: len(q)]
    return [_cell(value) for value in (q * scale).tolist()]


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.9g}"
