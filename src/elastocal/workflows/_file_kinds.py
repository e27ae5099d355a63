"""Describe what files hold, as ``check`` says: a function a kind, which reads and so validates.

A new kind is a function here and its entry in a table of `elastocal.workflows.check`.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from elastocal import logs, planning, procedure, two_robots
from elastocal.cell import load_cell
from elastocal.codec import (
    ARRAYS_SCHEMA,
    VERDICTS_SCHEMA,
    CodecData,
    read_codec,
    read_codec_folder,
    read_codec_summary,
    study as studies,
)
from elastocal.compensation import read_settings
from elastocal.compensation.conditioning import read_tool
from elastocal.compensation.process import TABLE, read_process, read_table
from elastocal.drivers.kuka_rsi import CommissioningRecord
from elastocal.elastic import read_springs
from elastocal.errors import SchemaError
from elastocal.geometry import PositionPlan, read_geometry, read_position_map
from elastocal.identification import CONTACT_SCHEMA, read_contact, read_model
from elastocal.identification.recertification import CompareSummary
from elastocal.planning.motion import mover_for, require_free_home
from elastocal.planning.surface import load_surface, mesh_findings
from elastocal.records import read_json, read_yaml_data, schema_of
from elastocal.workflows._operator_and_devices import rig_of
from elastocal.workflows._table_kinds import dataset_file

FileDescription = tuple[str, dict[str, object]]
"""The kind of a file, and what it holds: figures by name, JSON-ready."""


def _pair_cell(path: Path) -> FileDescription:
    """Describe a cell file of two robots."""
    cell = two_robots.load_pair_cell(path)
    return "cell file of two robots", {
        "schema": two_robots.SCHEMA,
        "name": cell.name,
        "robots": [robot.name for robot in cell.robots],
        "arms": list(cell.arms),
        "load_cases": list(cell.file.presses.cases),
        "technique": cell.file.search.technique,
        "known": list(cell.models()),
    }


def cell_file(path: Path) -> FileDescription:
    """Describe a cell file.

    Every mesh is read, the surface is compared with the robot's reach, and HOME with the solids; no
    candidate is made.

    Raises
    ------
    ElastocalError
        If the cell cannot be planned for whatever the candidates: its file, a file that it names,
        the search technique, the place of the surface, or a collision at HOME.
    """
    if two_robots.is_pair_cell(read_yaml_data(path)):
        return _pair_cell(path)
    cell = load_cell(path)
    doors = rig_of(cell).warnings
    search = cell.file.search
    planning.require_possible_search(cell)
    surface = planning.cell_surface(cell)
    findings = planning.surface_findings(cell, surface, np.random.default_rng(search.seed))
    planning.require_loads_possible_anywhere(cell, surface)
    require_free_home(cell.home, mover_for(cell, planning.collision_scene(cell, surface)))
    unrunnable = procedure.refusal_of_forces(cell)
    refused = [] if unrunnable is None else [f"no run can begin: {unrunnable}"]
    return "cell file", {
        "schema": "elastocal.cell/1",
        "cell": cell.name,
        "robot": cell.robot.name,
        "load_cases": list(cell.file.presses),
        "trackers": [tracker.name for tracker in cell.file.trackers],
        "technique": cell.technique,
        "faces": len(surface.mesh.faces),
        "findings": [str(finding) for finding in findings] + doors + refused,
    }


def mesh_file(path: Path) -> FileDescription:
    """Describe a mesh in its own unit, which the file does not state; its place is a cell's.

    Raises
    ------
    SurfaceError
        If it is no mesh, or has no face.
    """
    mesh = load_surface(path, 1.0, np.eye(4))
    extent = np.ptp(mesh.mesh.vertices, axis=0)
    return "mesh", {
        "faces": len(mesh.mesh.faces),
        "extent": " x ".join(f"{length:.4g}" for length in extent),
        "unit": f"not in the file: --unit of `elastocal new --mesh {path}`, or surface.unit",
        "findings": [str(finding) for finding in mesh_findings(mesh)],
    }


def plan_file(path: Path) -> FileDescription:
    """Describe a plan."""
    plan = planning.read_plan(path)
    return "plan", {
        **schema_and(plan),
        "cell": plan.cell.name,
        "robot": plan.robot.name,
        "poses": len(plan.poses),
        "load_cases": list(plan.contact.load_cases),
        "technique": plan.search.name,
        "covering_radius": plan.search.covering_radius,
    }


def pool_file(path: Path) -> FileDescription:
    """Describe a pool of candidates."""
    pool = planning.read_pool(path)
    return "pool of candidates", {
        **schema_and(pool),
        "candidates": len(pool),
        "sampled": len(pool.sampled),
        "checks": list(pool.check_names),
    }


def run_folder(path: Path) -> FileDescription:
    """Describe a run; its cell, plan and dataset are validated, its raw streams are not."""
    run = procedure.RunFolder(path)
    entries, start = _journal(run.journal)
    cell, plan = load_cell(run.cell / start.cell_file), planning.read_plan(run.plan)
    return "run", {
        "schema": start.schema_name,
        "cell": cell.name,
        "robot": cell.robot.name,
        "started": start.started,
        "poses": len(plan.poses),
        "committed": [log.pose for log in procedure.commits(entries)],
        "readings": dataset_file(run.dataset)[1]["readings"] if run.dataset.exists() else None,
    }


def journal_file(path: Path) -> FileDescription:
    """Describe a journal."""
    entries, start = _journal(path)
    return "journal of a run", {
        "schema": start.schema_name,
        "started": start.started,
        "entries": len(entries),
        "committed": [log.pose for log in procedure.commits(entries)],
        "last_entry": f"{entries[-1].event.value} at {entries[-1].time:.1f} s",
    }


def streams_file(path: Path) -> FileDescription:
    """Describe a recording of raw streams."""
    streams = procedure.read_streams(path)
    return "recording of raw streams", {
        "schema": procedure.STREAMS_SCHEMA,
        "joints": list(streams.joint_names),
        "arm_states": len(streams.arm.time),
        "wrenches": len(streams.wrench.time),
        "marker_points": len(streams.points.time),
    }


def summary_file(path: Path) -> FileDescription:
    """Describe a summary of a run."""
    summary = procedure.read_summary(path)
    found = {"readings": summary.readings.counts, "warnings": len(summary.warnings)}
    return "summary of a run", schema_and(summary) | found


def springs_file(path: Path) -> FileDescription:
    """Describe a file of springs."""
    file = read_springs(path)
    schema = {"schema": "elastocal.springs/1"}
    return "spring file", schema | {"include": file.include, "springs": len(file.springs)}


def contact_file(path: Path) -> FileDescription:
    """Describe what is known of a contact."""
    found = read_contact(path)
    known = {name: getattr(found, name) for name in ("normal", "lateral")}
    free = {name: "free" if value is None else value for name, value in known.items()}
    return "contact file", {"schema": CONTACT_SCHEMA, **free, "uncertainty": found.uncertainty}


def log_map_file(path: Path) -> FileDescription:
    """Describe a map of logs; the cell or robot that it names is read, too."""
    found = logs.read_map(path)
    return "map of logs", {
        "schema": logs.SCHEMA,
        "robot": logs.site(path, found).robot.name,
        "logs": [each.log for each in found.logs],
        "load_cases": list(found.load_cases),
    }


def position_map_file(path: Path) -> FileDescription:
    """Describe a map of positions."""
    found = read_position_map(path)
    return "map of positions", {"columns": {n: c.column for n, c in found.columns.items()}}


def geometry_file(path: Path) -> FileDescription:
    """Describe a calibrated geometry."""
    found = read_geometry(path)
    return "calibrated geometry", {
        **schema_and(found),
        "robot": found.robot.name,
        "positions": found.positions,
        "held_out_mean_m": found.held_out.chosen.mean,
    }


def position_plan_file(path: Path) -> FileDescription:
    """Describe a plan of positions in free space."""
    found = read_json(path, PositionPlan)
    return "plan of positions", {
        **schema_and(found),
        "cell": found.cell.name,
        "poses": len(found.poses),
        **_picked(found, "technique", "errors"),
    }


def model_file(path: Path) -> FileDescription:
    """Describe a calibrated model."""
    calibrated = read_model(path)
    return "calibrated model", {
        "robot": calibrated.model.robot.name,
        "tcp": calibrated.model.robot.tip,
        **_picked(calibrated.observability, "springs", "rank"),
        "draws": len(calibrated.draws),
        "provenance": calibrated.provenance,
    }


def tool_file(path: Path) -> FileDescription:
    """Describe a tool file."""
    return "tool file", schema_and(read_tool(path), "flange", "mass", "postures", "undetermined")


def compensator_file(path: Path) -> FileDescription:
    """Describe settings of a compensator."""
    settings = read_settings(path)
    return "settings of a compensator", {
        "schema": "elastocal.compensator/1",
        "cycle": settings.cycle,
        "filter_delay": float(settings.chain.delay()),
        **_picked(settings.limits, "correction", "rate"),
    }


def process_table(path: Path) -> FileDescription:
    """Describe a table of a simulated process."""
    table = read_table(path)
    last = table.lines[-1]
    return "simulated process", {
        **schema_and(table),
        "cell": table.cell,
        "process": table.process,
        "seeds": [run.seed for run in table.runs],
        "points": last.points,
        "mean_after": last.after.mean,
        "max_after": last.after.max,
    }


def process_folder(path: Path) -> FileDescription:
    """Describe the folder of a simulated process; its deviations are validated, too."""
    courses = len(read_process(path).courses)
    kind, facts = process_table(path / TABLE)
    return kind, {**facts, "courses": courses}


def record_file(
    kind: str, record: Callable[[], type], *names: str
) -> Callable[[Path], FileDescription]:
    """Return the describer of files of a record, imported only then, by some of its figures."""

    def describe(path: Path) -> FileDescription:
        found: object = read_json(path, record())
        return kind, schema_and(found, *names)

    return describe


def commissioning_file(path: Path) -> FileDescription:
    """Describe the record of a delay from command to motion."""
    found = read_json(path, CommissioningRecord)
    return "commissioning record", {
        **schema_and(found, "cell", "robot", "controller", "made", "cycle", "delay"),
        "line": found.link.sentence(),
    }


def comparison_file(path: Path) -> FileDescription:
    """Describe a comparison of two calibrations."""
    found = read_json(path, CompareSummary)
    return "comparison of two calibrations", {
        **schema_and(found, "robot"),
        "compared": len(found.springs),
        "moved": list(found.moved),
        "rows": 0 if found.deflection is None else found.deflection.rows,
        **_picked(found, "limit", "verdict"),
    }


def codec_folder(path: Path) -> FileDescription:
    """Describe the folder of a codec; arrays and verdicts are validated and belong together."""
    data, found = read_codec_folder(path)
    return "folder of a codec", {**_codec_facts(data), "saturation": found.saturation}


def codec_arrays(path: Path) -> FileDescription:
    """Describe the arrays of a codec."""
    return "codec", _codec_facts(read_codec(path))


def codec_verdicts(path: Path) -> FileDescription:
    """Describe the verdicts of a codec."""
    found = read_codec_summary(path)
    return "verdict file of a codec", {
        "schema": VERDICTS_SCHEMA,
        "robot": found.robot,
        "variants": list(found.variants),
        "saturation": found.saturation,
    }


def study_folder(path: Path) -> FileDescription:
    """Describe the folder of a study; every finished sample is validated."""
    design = studies.read_design(path / studies.DESIGN)
    return "study", {
        **_design_facts(design),
        "samples": len(studies.StudyStore(path).finished(design)),
    }


def study_settings(path: Path) -> FileDescription:
    """Describe what a study is a study of."""
    return "settings file of a study", _design_facts(studies.read_design(path))


def study_samples(path: Path) -> FileDescription:
    """Describe some finished samples, by the settings in the folder above theirs."""
    results = studies.read_part(
        path, studies.read_design(path.resolve().parent.parent / studies.DESIGN)
    )
    return "part of a study", {
        "schema": studies.PART_SCHEMA,
        "samples": [result.number for result in results],
        "conditions": len(results[0].outcomes) if results else 0,
    }


def study_record(path: Path) -> FileDescription:
    """Describe the results of a study."""
    found = studies.read_study(path)
    return "record of a study", {
        "schema": studies.STUDY_SCHEMA,
        **_picked(found, "cell", "samples", "verification"),
        "median_error_m": {each.name: each.error_mean.median for each in found.conditions},
        "advice": found.advice or None,
    }


def schema_and(found: object, *names: str) -> dict[str, object]:
    """Return the schema of a record, and some attributes as they are called; tuples as lists."""
    return {"schema": schema_of(type(found)), **_picked(found, *names)}


def _picked(found: object, *names: str) -> dict[str, object]:
    """Return some attributes of a record as they are called; tuples as lists."""
    values = {name: getattr(found, name) for name in names}
    return {name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}


def _journal(path: Path) -> tuple[tuple[procedure.Entry, ...], procedure.RunRecord]:
    """Return the entries of a journal, and what the first says of the run."""
    entries = procedure.read_journal(path)
    start = entries[0].run if entries else None
    if start is None:
        raise SchemaError(
            f"{path} is empty or cut off: it has no whole entry and does not tell what was done"
        )
    return entries, start


def _codec_facts(data: CodecData) -> dict[str, object]:
    return {
        "schema": ARRAYS_SCHEMA,
        "robot": data.robot,
        "variants": [each.name for each in data.variants],
        "poses": len(data.contact),
        "splits": len(data.seed_pose),
        "training": len(data.n_train),
    }


def _design_facts(design: studies.StudyDesign) -> dict[str, object]:
    facts = _picked(design, "cell", "seed")
    facts |= {"conditions": list(design.names), "verification": design.verification}
    return {"schema": studies.DESIGN_SCHEMA, **facts}
