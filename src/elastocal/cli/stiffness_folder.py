"""The files that ``elastocal stiffness`` writes."""

from pathlib import Path
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cli.stiffness_answer import Answer
from elastocal.compensation.offline import posture_jumps
from elastocal.compensation.stiffness import (
    PathPostures,
    directional_stiffness,
    write_choice,
    write_survey,
)
from elastocal.files import write_json
from elastocal.identification import CalibratedModel
from elastocal.report import Curve, write_stiffness_figure
from elastocal.robot import Robot

SCHEMA = "elastocal.stiffness/1"


def write_folder(folder: Path, calibrated: CalibratedModel, found: Answer) -> dict[str, Any]:
    """Write tables, figures and key figures; return the last.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    robot = calibrated.model.robot
    curves = [_curve(calibrated, found, postures) for postures in found.postures]
    paths = [
        write_survey(folder / "postures.csv", robot, found.stations, found.survey),
        write_choice(
            folder / "choice.csv", calibrated, found.stations, found.direction, found.postures
        ),
    ]
    for name in ("stiffness.svg", "stiffness.png"):
        title = f"{robot.name}: stiffness along {found.along}"
        paths.append(
            write_stiffness_figure(folder / name, title, found.stations, found.survey, curves)
        )
    figures = _figures(robot, found, curves) | {
        "files": [*(path.name for path in paths), "stiffness.json"]
    }
    write_json(folder / "stiffness.json", figures)
    return figures


def _curve(calibrated: CalibratedModel, found: Answer, postures: PathPostures) -> Curve:
    there = np.flatnonzero(np.isfinite(postures.q).all(axis=1))
    k = directional_stiffness(calibrated, postures.q[there], found.direction[there])
    stiffness, low, high = (np.full(len(postures.q), np.nan) for _ in range(3))
    stiffness[there], low[there], high[there] = k.stiffness, k.low, k.high
    railed = calibrated.model.robot.external_axes > 0
    rail = postures.q[:, 0] if railed else np.full(len(postures.q), np.nan)
    return Curve(postures.name, stiffness, low, high, postures.spin, rail)


def _jumps(robot: Robot, postures: PathPostures) -> int:
    """Return at how many stations a joint turns by more than 90 deg from the one before."""
    q = postures.q[np.isfinite(postures.q).all(axis=1)]
    return len(posture_jumps(robot, q, q[0])) if len(q) else 0


def _figures(robot: Robot, found: Answer, curves: list[Curve]) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "direction": found.question.direction,
        "stations": len(found.stations),
        "external_axes": [
            {"name": name, "unit": "rad" if turns else "m"}
            for name, turns in zip(robot.joint_names, robot.revolute, strict=True)
        ][: robot.external_axes],
        "postures": {
            "tried": found.survey.stiffness.size,
            "allowed": int(np.sum(~np.isnan(found.survey.stiffness))),
            "refused": found.survey.refused,
        },
        "choices": [
            _choice(curve, _jumps(robot, postures))
            for curve, postures in zip(curves, found.postures, strict=True)
        ],
    }


def _choice(curve: Curve, turns: int) -> dict[str, Any]:
    k = curve.stiffness[np.isfinite(curve.stiffness)]

    def only(values: FloatArray) -> float | None:
        found = np.unique(values[np.isfinite(values)])
        return float(found[0]) if len(found) == 1 else None

    return {
        "name": curve.name,
        "stations": len(k),
        "softest": float(k.min()) if len(k) else 0.0,
        "mean": float(k.mean()) if len(k) else 0.0,
        "spin": only(curve.spin),
        "stand": only(curve.rail),
        "posture_jumps": turns,
    }
