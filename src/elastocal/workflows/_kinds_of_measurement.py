"""What the files hold by which a cell is described, planned and measured, as ``check`` says."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elastocal import dataset
from elastocal.cell import load_cell
from elastocal.errors import RobotError, SchemaError
from elastocal.files import read_text
from elastocal.planning import (
    cell_surface,
    collision_scene,
    read_plan,
    read_pool,
    require_possible_search,
    surface_findings,
)
from elastocal.planning.motion import mover_for, require_free_home
from elastocal.procedure import (
    STREAMS_SCHEMA as STREAMS,
    RunFolder,
    RunSummary,
    commits,
    read_journal,
    read_streams,
    read_summary,
)
from elastocal.records import schema_of
from elastocal.robot import Robot, leaf_links, parse_urdf


class FileDescription(NamedTuple):
    """The kind of a file and what it holds."""

    kind: str
    facts: Mapping[str, object]
    """Figures by name, JSON-ready."""

    @classmethod
    def of(cls, kind: str, /, **facts: object) -> "FileDescription":
        """Return the description of a file of a kind."""
        return cls(kind, facts)


def _cell_facts(path: Path) -> dict[str, object]:
    """Return what a cell file describes.

    Every mesh is read, the surface is held against the robot's reach, and HOME against the
    solids; no candidate is made.

    Raises
    ------
    ElastocalError
        If the cell cannot be planned for whatever the candidates: its file, a file that it names,
        the search technique, the place of the surface, or a collision at HOME.
    """
    cell = load_cell(path)
    search = cell.file.search
    require_possible_search(cell)
    surface = cell_surface(cell)
    findings = surface_findings(cell, surface, np.random.default_rng(search.seed))
    require_free_home(cell.home, mover_for(cell, collision_scene(cell, surface)))
    return {
        "schema": "elastocal.cell/1",
        "cell": cell.name,
        "robot": cell.robot.name,
        "load_cases": list(cell.file.load_cases.cases),
        "trackers": [tracker.name for tracker in cell.file.trackers],
        "technique": search.technique,
        "faces": len(surface.mesh.faces),
        "findings": [finding.message for finding in findings],
    }


def cell_file(path: Path) -> FileDescription:
    """Describe a cell file."""
    return FileDescription("cell file", _cell_facts(path))


def plan_file(path: Path) -> FileDescription:
    """Describe a plan."""
    plan = read_plan(path)
    return FileDescription.of(
        "plan",
        schema="elastocal.plan/1",
        cell=plan.cell.name,
        robot=plan.robot.name,
        poses=len(plan.poses),
        load_cases=list(plan.contact.load_cases),
        technique=plan.search.name,
        covering_radius=plan.search.covering_radius,
    )


def pool_file(path: Path) -> FileDescription:
    """Describe a pool of candidates."""
    pool = read_pool(path)
    return FileDescription.of(
        "pool of candidates",
        schema="elastocal.pool/1",
        candidates=len(pool),
        sampled=len(pool.sampled),
        checks=list(pool.check_names),
    )


def run_folder(path: Path) -> FileDescription:
    """Describe a run; its cell, plan and dataset are validated, its raw streams are not."""
    run = RunFolder(path)
    entries = read_journal(run.journal)
    start = entries[0].run if entries else None
    if start is None:
        raise SchemaError(f"{run.journal} has no entry: nothing has moved in this run")
    cell, plan = load_cell(run.cell / start.cell_file), read_plan(run.plan)
    return FileDescription.of(
        "run",
        schema=start.schema_name,
        cell=cell.name,
        robot=cell.robot.name,
        started=start.started,
        poses=len(plan.poses),
        committed=[log.pose for log in commits(entries)],
        readings=dataset_file(run.dataset)[1]["readings"] if run.dataset.exists() else None,
    )


def journal_file(path: Path) -> FileDescription:
    """Describe a journal."""
    entries = read_journal(path)
    start = entries[0].run if entries else None
    if start is None:
        raise SchemaError(f"{path} has no entry: nothing has moved in this run")
    return FileDescription.of(
        "journal of a run",
        schema=start.schema_name,
        started=start.started,
        entries=len(entries),
        committed=[log.pose for log in commits(entries)],
        last_entry=f"{entries[-1].event.value} at {entries[-1].time:.1f} s",
    )


def streams_file(path: Path) -> FileDescription:
    """Describe a recording of raw streams."""
    streams = read_streams(path)
    return FileDescription.of(
        "recording of raw streams",
        schema=STREAMS,
        joints=list(streams.joint_names),
        arm_states=len(streams.arm.time),
        wrenches=len(streams.wrench.time),
        marker_points=len(streams.points.time),
    )


def summary_file(path: Path) -> FileDescription:
    """Describe a summary of a run."""
    summary = read_summary(path)
    return FileDescription.of(
        "summary of a run",
        schema=schema_of(RunSummary),
        readings=summary.readings.counts,
        warnings=len(summary.warnings),
    )


def dataset_file(path: Path) -> FileDescription:
    """Describe a dataset."""
    data = dataset.read(path)
    return FileDescription.of(
        "dataset",
        readings=len(data.readings(data.joint_names)),
        poses=len(data.poses),
        load_cases=list(data.load_cases),
        joints=list(data.joint_names),
        robot=data.robot_name or None,
        tcp=data.tcp_frame,
    )


def robot_file(path: Path) -> FileDescription:
    """Describe a robot description."""
    text = read_text(path)
    leaves = leaf_links(parse_urdf(text))
    if not leaves:
        raise RobotError(f"{path}: URDF has no link at the end of a chain")
    robots = [Robot.from_urdf(text, leaf) for leaf in leaves]
    return FileDescription.of(
        "robot description",
        robot=robots[0].name,
        tips=leaves,
        joints=list(max(robots, key=lambda robot: len(robot.joint_names)).joint_names),
        assumptions=[f"{a.field}: {a.reason}" for a in robots[0].assumptions],
    )
