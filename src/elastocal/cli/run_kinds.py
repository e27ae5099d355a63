"""Cells, plans, runs and their files, as ``elastocal check`` tells of them."""

from pathlib import Path
from typing import Any

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.cli.cell_facts import cell_facts
from elastocal.errors import SchemaError
from elastocal.planning import read_plan, read_pool
from elastocal.procedure import (
    STREAMS_SCHEMA as STREAMS,
    RunFolder,
    commits,
    read_journal,
    read_streams,
    read_summary,
)

Described = tuple[str, dict[str, Any]]
"""The kind of a file and what it holds."""


def cell_file(path: Path) -> Described:
    """Describe a cell file."""
    return "cell file", cell_facts(path)


def plan_file(path: Path) -> Described:
    """Describe a plan."""
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


def pool_file(path: Path) -> Described:
    """Describe a pool of candidates."""
    pool = read_pool(path)
    return "pool of candidates", {
        "schema": "elastocal.pool/1",
        "candidates": len(pool),
        "sampled": len(pool.sampled),
        "checks": list(pool.check_names),
    }


def run_folder(path: Path) -> Described:
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
        "readings": dataset_file(run.dataset)[1]["readings"] if run.dataset.exists() else None,
    }


def journal_file(path: Path) -> Described:
    """Describe a journal."""
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


def streams_file(path: Path) -> Described:
    """Describe a recording of raw streams."""
    streams = read_streams(path)
    return "recording of raw streams", {
        "schema": STREAMS,
        "joints": list(streams.joint_names),
        "arm_states": len(streams.arm.time),
        "wrenches": len(streams.wrench.time),
        "marker_points": len(streams.points.time),
    }


def summary_file(path: Path) -> Described:
    """Describe a summary of a run."""
    summary = read_summary(path)
    return "summary of a run", {
        "schema": summary["schema"],
        "readings": summary["readings"]["counts"],
        "warnings": len(summary["warnings"]),
    }


def dataset_file(path: Path) -> Described:
    """Describe a dataset."""
    data = dataset.read(path)
    return "dataset", {
        "readings": len(data.readings(data.joint_names)),
        "poses": len(data.poses),
        "load_cases": list(data.load_cases),
        "joints": list(data.joint_names),
        "robot": data.robot_name or None,
        "tcp": data.tcp_frame,
    }
