"""The kinds of file that ``elastocal check`` knows, by suffix."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.elastic.layouts import read_springs
from elastocal.errors import RobotError, SchemaError
from elastocal.files import read_text
from elastocal.identification.model_file import read_model
from elastocal.robot import Robot
from elastocal.robot.urdf import leaf_links, parse_urdf

Facts = dict[str, Any]

_SCHEMA_LINE = re.compile(r"^schema:\s*[\"']?elastocal\.cell/", re.MULTILINE)


def describe_file(path: Path) -> tuple[str, Facts]:
    """Return the kind of a file and what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours.
    ElastocalError
        If the contents are not valid.
    """
    known = {
        ".nc": ("dataset", _dataset),
        ".csv": ("dataset", _dataset),
        ".json": ("calibrated model", _model),
        ".urdf": ("robot description", _robot),
        ".yaml": ("settings file", _settings),
        ".yml": ("settings file", _settings),
    }
    found: tuple[str, Callable[[Path], Facts]] | None = known.get(path.suffix.lower())
    if found is None:
        raise SchemaError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(known)}")
    kind, describe = found
    return kind, describe(path)


def _dataset(path: Path) -> Facts:
    data = dataset.read(path)
    return {
        "readings": len(data.readings(data.joint_names)),
        "poses": len(data.poses),
        "load_cases": list(data.load_cases),
        "joints": list(data.joint_names),
        "robot": data.robot_name or None,
        "tcp": data.tcp_frame,
    }


def _model(path: Path) -> Facts:
    calibrated = read_model(path)
    seen = calibrated.observability
    return {
        "robot": calibrated.model.robot.name,
        "tcp": calibrated.model.robot.tip,
        "springs": seen.springs,
        "rank": seen.rank,
        "draws": len(calibrated.draws),
        "provenance": calibrated.provenance,
    }


def _robot(path: Path) -> Facts:
    text = read_text(path)
    leaves = leaf_links(parse_urdf(text))
    if not leaves:
        raise RobotError(f"{path}: URDF has no link at the end of a chain")
    robots = [Robot.from_urdf(text, leaf) for leaf in leaves]
    return {
        "robot": robots[0].name,
        "tips": leaves,
        "joints": list(max(robots, key=lambda robot: len(robot.joint_names)).joint_names),
        "assumptions": [f"{a.field}: {a.reason}" for a in robots[0].assumptions],
    }


def _settings(path: Path) -> Facts:
    """Describe a YAML file by the schema that it states."""
    if _SCHEMA_LINE.search(read_text(path)):
        return _cell(path)
    file = read_springs(path)
    return {"schema": "elastocal.springs/1", "include": file.include, "springs": len(file.springs)}


def _cell(path: Path) -> Facts:
    cell = load_cell(path)
    return {
        "schema": "elastocal.cell/1",
        "cell": cell.name,
        "robot": cell.robot.name,
        "load_cases": list(cell.file.load_cases.cases),
        "trackers": [tracker.name for tracker in cell.file.trackers],
    }
