"""The kinds of file that ``elastocal check`` knows, by suffix."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.codec import read_codec, read_verdicts
from elastocal.dataset.netcdf import read_netcdf
from elastocal.elastic.layouts import read_springs
from elastocal.errors import DatasetError, RobotError, SchemaError
from elastocal.files import read_text
from elastocal.identification.model_file import read_model
from elastocal.planning.plan_file import read_plan
from elastocal.planning.pool_file import read_pool
from elastocal.robot import Robot
from elastocal.robot.urdf import leaf_links, parse_urdf

Facts = dict[str, Any]
Described = tuple[str, Facts]
"""The kind of a file and what it holds."""
Describe = Callable[[Path], Described]

_PLAN = re.compile(r'"schema":\s*"elastocal\.plan/')
_CODEC = re.compile(r'"schema":\s*"elastocal\.codec_verdicts/')
_SCHEMA_LINE = re.compile(r"^schema:\s*[\"']?elastocal\.cell/", re.MULTILINE)


def describe_file(path: Path) -> Described:
    """Return the kind of a file and what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours.
    ElastocalError
        If the contents are not valid.
    """
    known: dict[str, Describe] = {
        ".nc": _netcdf,
        ".csv": _dataset,
        ".json": _json,
        ".urdf": _robot,
        ".yaml": _settings,
        ".yml": _settings,
    }
    describe = known.get(path.suffix.lower())
    if describe is None:
        raise SchemaError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(known)}")
    return describe(path)


def _netcdf(path: Path) -> Described:
    """Describe a NetCDF file by the schema that it states."""
    try:
        stated = read_netcdf(path).attrs.get("schema")
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error
    if str(stated).startswith("elastocal.codec/"):
        return _codec(path)
    return _pool(path) if str(stated).startswith("elastocal.pool/") else _dataset(path)


def _json(path: Path) -> Described:
    """Describe a JSON file by the schema that it states; what states none is read as a model."""
    start = read_text(path)[:200]
    if _CODEC.search(start):
        return _verdicts(path)
    return _plan(path) if _PLAN.search(start) else _model(path)


def _dataset(path: Path) -> Described:
    data = dataset.read(path)
    return "dataset", {
        "readings": len(data.readings(data.joint_names)),
        "poses": len(data.poses),
        "load_cases": list(data.load_cases),
        "joints": list(data.joint_names),
        "robot": data.robot_name or None,
        "tcp": data.tcp_frame,
    }


def _model(path: Path) -> Described:
    calibrated = read_model(path)
    seen = calibrated.observability
    return "calibrated model", {
        "robot": calibrated.model.robot.name,
        "tcp": calibrated.model.robot.tip,
        "springs": seen.springs,
        "rank": seen.rank,
        "draws": len(calibrated.draws),
        "provenance": calibrated.provenance,
    }


def _robot(path: Path) -> Described:
    text = read_text(path)
    leaves = leaf_links(parse_urdf(text))
    if not leaves:
        raise RobotError(f"{path}: URDF has no link at the end of a chain")
    robots = [Robot.from_urdf(text, leaf) for leaf in leaves]
    return "robot description", {
        "robot": robots[0].name,
        "tips": leaves,
        "joints": list(max(robots, key=lambda robot: len(robot.joint_names)).joint_names),
        "assumptions": [f"{a.field}: {a.reason}" for a in robots[0].assumptions],
    }


def _settings(path: Path) -> Described:
    """Describe a YAML file by the schema that it states."""
    if _SCHEMA_LINE.search(read_text(path)):
        return _cell(path)
    file = read_springs(path)
    facts = {
        "schema": "elastocal.springs/1",
        "include": file.include,
        "springs": len(file.springs),
    }
    return "spring file", facts


def _cell(path: Path) -> Described:
    cell = load_cell(path)
    return "cell file", {
        "schema": "elastocal.cell/1",
        "cell": cell.name,
        "robot": cell.robot.name,
        "load_cases": list(cell.file.load_cases.cases),
        "trackers": [tracker.name for tracker in cell.file.trackers],
    }


def _plan(path: Path) -> Described:
    plan = read_plan(path)
    return "plan", {
        "schema": "elastocal.plan/1",
        "cell": plan.cell.name,
        "robot": plan.robot.name,
        "poses": len(plan.poses),
        "load_cases": list(plan.contact.load_cases),
        "technique": plan.search.name,
        "covering_radius": plan.search.covering_radius,
    }


def _pool(path: Path) -> Described:
    pool = read_pool(path)
    return "pool of candidates", {
        "schema": "elastocal.pool/1",
        "candidates": len(pool),
        "sampled": len(pool.sampled),
        "checks": list(pool.check_names),
    }


def _codec(path: Path) -> Described:
    data = read_codec(path)
    return "codec", {
        "schema": "elastocal.codec/1",
        "robot": data.robot,
        "variants": [each.name for each in data.variants],
        "poses": len(data.contact),
        "splits": len(data.seed_pose),
        "training": len(data.n_train),
    }


def _verdicts(path: Path) -> Described:
    record = read_verdicts(path)
    return "verdicts of a codec", {
        "schema": "elastocal.codec_verdicts/1",
        "robot": record.robot,
        "variants": list(record.variants),
        "saturation": record.saturation,
    }
