"""Models, what they rest on and what is made of them, as ``elastocal check`` tells of them."""

from pathlib import Path
from typing import Any

from elastocal.compensation import read_settings
from elastocal.compensation.conditioning import read_tool
from elastocal.compensation.process import TABLE, read_process, read_table
from elastocal.elastic import read_springs
from elastocal.errors import RobotError
from elastocal.files import read_text
from elastocal.identification import read_model
from elastocal.identification.recertification import CompareSummary
from elastocal.records import read_json
from elastocal.robot import Robot, leaf_links, parse_urdf

Described = tuple[str, dict[str, Any]]
"""The kind of a file and what it holds."""


def springs_file(path: Path) -> Described:
    """Describe a file of springs."""
    file = read_springs(path)
    return "spring file", {
        "schema": "elastocal.springs/1",
        "include": file.include,
        "springs": len(file.springs),
    }


def model_file(path: Path) -> Described:
    """Describe a calibrated model."""
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


def robot_file(path: Path) -> Described:
    """Describe a robot description."""
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


def tool_file(path: Path) -> Described:
    """Describe a tool file."""
    record = read_tool(path)
    return "tool file", {
        "schema": "elastocal.tool/1",
        "flange": record.flange,
        "mass": record.mass,
        "postures": record.postures,
        "undetermined": list(record.undetermined),
    }


def compensator_file(path: Path) -> Described:
    """Describe a settings of a compensator."""
    settings = read_settings(path)
    return "settings of a compensator", {
        "schema": "elastocal.compensator/1",
        "cycle": settings.cycle,
        "filter_delay": float(settings.chain.delay()),
        "correction": settings.limits.correction,
        "rate": settings.limits.rate,
    }


def process_table(path: Path) -> Described:
    """Describe a table of a simulated process."""
    table = read_table(path)
    last = table.lines[-1]
    return "simulated process", {
        "schema": "elastocal.process/1",
        "cell": table.cell,
        "process": table.process,
        "seeds": [run.seed for run in table.runs],
        "points": last.points,
        "mean_after": last.after.mean,
        "max_after": last.after.max,
    }


def comparison_file(path: Path) -> Described:
    """Describe a comparison of two calibrations."""
    record = read_json(path, CompareSummary)
    return "comparison of two calibrations", {
        "schema": "elastocal.comparison/1",
        "robot": record.robot,
        "compared": len(record.springs),
        "moved": list(record.moved),
        "rows": 0 if record.deflection is None else record.deflection.rows,
        "limit": record.limit,
        "verdict": record.verdict,
    }


def process_folder(path: Path) -> Described:
    """Describe the folder of a simulated process; its deviations are validated, too."""
    record = read_process(path)
    kind, facts = process_table(path / TABLE)
    return kind, {**facts, "courses": len(record.courses)}
