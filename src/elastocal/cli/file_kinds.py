"""The kinds of file that ``elastocal check`` knows, by suffix."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.cli import codec_kinds, study_kinds
from elastocal.cli.cell_facts import cell_facts
from elastocal.compensation.conditioning.tool_file import read_tool
from elastocal.compensation.process.folder import TABLE, read_process, read_table
from elastocal.compensation.settings import read_settings
from elastocal.dataset.netcdf import read_netcdf
from elastocal.elastic.layouts import read_springs
from elastocal.errors import DatasetError, RobotError, SchemaError
from elastocal.files import read_text
from elastocal.identification.model_file import read_model
from elastocal.identification.recertification import read_comparison
from elastocal.planning.plan_file import PLAN, read_plan
from elastocal.planning.pool_file import read_pool
from elastocal.procedure.journal import commits, read_journal
from elastocal.procedure.pose_recorder import SCHEMA as STREAMS
from elastocal.procedure.run_folder import JOURNAL, RunFolder
from elastocal.procedure.streams import read_streams
from elastocal.procedure.summary import read_summary
from elastocal.robot import Robot
from elastocal.robot.urdf import leaf_links, parse_urdf

Facts = dict[str, Any]
Described = tuple[str, Facts]
"""The kind of a file and what it holds."""
Describe = Callable[[Path], Described]

_IN_JSON = re.compile(r'"schema":\s*"(elastocal\.[\w-]+)/')
_IN_YAML = re.compile(r"^schema:\s*[\"']?(elastocal\.[\w-]+)/", re.MULTILINE)


def describe_file(path: Path) -> Described:
    """Return the kind of a file, or of a folder that a command made, and what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours, or a folder holds nothing of ours.
    ElastocalError
        If the contents are not valid.
    """
    if path.is_dir():
        return _folder(path)
    known: dict[str, Describe] = {
        ".nc": _netcdf,
        ".csv": _table,
        ".json": _json,
        ".urdf": _robot,
        ".jsonl": _journal,
        ".mcap": _streams,
        ".yaml": _settings,
        ".yml": _settings,
    }
    describe = known.get(path.suffix.lower())
    if describe is None:
        raise SchemaError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(known)}")
    return describe(path)


def _folder(path: Path) -> Described:
    """Describe the folder of a plan, a run, a simulated process, a codec or a study."""
    if (path / PLAN).is_file():
        return _plan(path / PLAN)
    if (path / JOURNAL).is_file():
        return _run(path)
    if (path / TABLE).is_file():
        record = read_process(path)
        kind, facts = _process(path / TABLE)
        return kind, {**facts, "courses": len(record.traces)}
    if study_kinds.is_study(path):
        return study_kinds.study_folder(path)
    if codec_kinds.is_codec(path):
        return codec_kinds.codec_folder(path)
    raise SchemaError(
        f"{path} is a folder with none of {PLAN}, {JOURNAL}, {TABLE} in it, nor the files of a"
        " codec or a study"
    )


def _run(path: Path) -> Described:
    """Describe a run; its cell, plan and dataset are validated, its raw streams are not."""
    run = RunFolder(path)
    entries = read_journal(run.journal)
    start = entries[0].run if entries else None
    if start is None:
        raise SchemaError(f"{run.journal} has no entry: nothing has moved in this run")
    cell, plan = load_cell(run.cell / start.cell_file), read_plan(run.plan)
    return "run", {
        "schema": start.schema_name,
        "cell": cell.name,
        "robot": cell.robot.name,
        "started": start.started,
        "poses": len(plan.poses),
        "committed": [log.pose for log in commits(entries)],
        "readings": _dataset(run.dataset)[1]["readings"] if run.dataset.exists() else None,
    }


def _journal(path: Path) -> Described:
    entries = read_journal(path)
    start = entries[0].run if entries else None
    if start is None:
        raise SchemaError(f"{path} has no entry: nothing has moved in this run")
    return "journal of a run", {
        "schema": start.schema_name,
        "started": start.started,
        "entries": len(entries),
        "committed": [log.pose for log in commits(entries)],
        "last_entry": f"{entries[-1].event.value} at {entries[-1].time:.1f} s",
    }


def _streams(path: Path) -> Described:
    streams = read_streams(path)
    return "recording of raw streams", {
        "schema": STREAMS,
        "joints": list(streams.joint_names),
        "arm_states": len(streams.arm.time),
        "wrenches": len(streams.wrench.time),
        "marker_points": len(streams.points.time),
    }


def _netcdf(path: Path) -> Described:
    """Describe a NetCDF file by the schema that it states."""
    try:
        stated = read_netcdf(path).attrs.get("schema")
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error
    kinds: dict[str, Describe] = {"elastocal.codec": codec_kinds.arrays, "elastocal.pool": _pool}
    return kinds.get(str(stated).partition("/")[0], _dataset)(path)


def _json(path: Path) -> Described:
    """Describe a JSON file by the schema that it states; what states none is read as a model."""
    kinds: dict[str, Describe] = {
        "elastocal.plan": _plan,
        "elastocal.run-summary": _summary,
        "elastocal.tool": _tool,
        "elastocal.codec_verdicts": codec_kinds.verdicts,
        "elastocal.study": study_kinds.study_record,
        "elastocal.study_settings": study_kinds.study_settings,
        "elastocal.study_samples": study_kinds.study_samples,
        "elastocal.process": _process,
        "elastocal.comparison": _comparison,
    }
    return kinds.get(_stated(_IN_JSON, read_text(path)[:200]), _model)(path)


def _table(path: Path) -> Described:
    return codec_kinds.table(path) if codec_kinds.is_table(path) else _dataset(path)


def _stated(pattern: re.Pattern[str], text: str) -> str:
    """Return the schema that a text states, without its version; empty when it states none."""
    found = pattern.search(text)
    return found[1] if found else ""


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
    kinds: dict[str, Describe] = {
        "elastocal.cell": _cell,
        "elastocal.compensator": _compensator,
    }
    return kinds.get(_stated(_IN_YAML, read_text(path)), _springs)(path)


def _springs(path: Path) -> Described:
    file = read_springs(path)
    return "spring file", {
        "schema": "elastocal.springs/1",
        "include": file.include,
        "springs": len(file.springs),
    }


def _cell(path: Path) -> Described:
    return "cell file", cell_facts(path)


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


def _summary(path: Path) -> Described:
    summary = read_summary(path)
    return "summary of a run", {
        "schema": summary["schema"],
        "readings": summary["readings"]["counts"],
        "warnings": len(summary["warnings"]),
    }


def _tool(path: Path) -> Described:
    record = read_tool(path)
    return "tool file", {
        "schema": "elastocal.tool/1",
        "flange": record.flange,
        "mass": record.mass,
        "postures": record.postures,
        "undetermined": list(record.undetermined),
    }


def _compensator(path: Path) -> Described:
    settings = read_settings(path)
    return "settings of a compensator", {
        "schema": "elastocal.compensator/1",
        "cycle": settings.cycle,
        "filter_delay": float(settings.chain.delay()),
        "correction": settings.limits.correction,
        "rate": settings.limits.rate,
    }


def _process(path: Path) -> Described:
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


def _comparison(path: Path) -> Described:
    record = read_comparison(path)
    return "comparison of two calibrations", {
        "schema": "elastocal.comparison/1",
        "robot": record.robot,
        "compared": len(record.springs),
        "moved": list(record.moved),
        "rows": 0 if record.deflection is None else record.deflection.rows,
        "limit": record.limit,
        "verdict": record.verdict,
    }
