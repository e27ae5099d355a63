"""Gather the evidence of a report from the files of a run.

Files named by the user must exist and be valid, or the report is refused. Files under a default
name that cannot be used are left out, and the report states why. Parts of another robot or another
cell count as unusable.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from elastocal import dataset as datasets
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, load_cell
from elastocal.codec import ARRAYS, VERDICTS, judge, read_codec
from elastocal.compensation.conditioning import ToolResult, read_tool
from elastocal.compensation.process import TABLE, SimulatedProcess, read_process
from elastocal.dataset import Dataset, content_sha256, merge_files, read_made_from
from elastocal.errors import CodecError, ElastocalError, present
from elastocal.files import read_text
from elastocal.identification import CalibrateResult, reproduce_calibration
from elastocal.identification.recertification import recertify_files
from elastocal.logs import IMPORTED, LogMap, days_of, read_map
from elastocal.planning import (
    PLAN,
    POOL,
    PlanResult,
    PoolData,
    cell_surface,
    check_plan_robot,
    check_pool_of,
    read_plan,
    read_pool,
)
from elastocal.procedure import (
    RunFolder,
    check_plan,
    file_sha256,
    on_arm_as_built,
    read_journal,
    read_summary,
)
from elastocal.records import read_json
from elastocal.results import brief_repr
from elastocal.verdict._files import (
    CODEC,
    MODEL,
    PROCESS,
    TOOL,
    Part,
    PartReader,
    find_folders,
    run_files,
)
from elastocal.verdict.chain import ChainFiles, Link, LinkState, verify_chain
from elastocal.verdict.evidence import (
    AcceptanceLimits,
    Campaign,
    CodecEvidence,
    Evidence,
    ModelEvidence,
    check_codec,
    check_model,
    check_process,
    check_tool,
    find_doubts,
)
from elastocal.verdict.history import history_link
from elastocal.wording import phrase

_NO_RUN = phrase("no folder of a run was given: nothing is known of how the readings came about")
_NO_LOGS = phrase(
    "the readings state no run, and no logs: nothing is known of how the readings came about"
)
_CELL = "cell.yaml"
"""Default name of a cell file beside a model."""


@brief_repr
@dataclass(frozen=True)
class EvidenceOptions:
    """Files and limits named by the user."""

    run: Path
    model: Path | None = None
    tool: Path | None = None
    codec: Path | None = None
    process: Path | None = None
    old: Path | None = None
    """Model file of an earlier calibration of the cell; there is no default name."""
    tolerance: float | None = None
    """In m; replaces that of the cell file."""
    drift: float | None = None
    """In m; replaces that of the cell file."""
    signer: str | None = None
    """Public key that must have signed the run, 64 hexadecimal digits."""
    stated: Mapping[str, str] = field(default_factory=dict)
    """Statements for the certificate, in addition to those of cell file and run."""


def gather_evidence(options: EvidenceOptions, made: str) -> Evidence:
    """Return the evidence of a report.

    Parameters
    ----------
    options : EvidenceOptions
        Files and limits that are named.
    made : str
        Date and time of the report, ISO 8601, UTC.

    Raises
    ------
    ElastocalError
        If there is nothing to report on, or a part that is named cannot be used.
    """
    reader = PartReader(find_folders(options.run))
    evidence = Evidence(made=made, stated=options.stated)
    if reader.folders.run is None:
        evidence = _with_readings(evidence, reader, options)
    else:
        evidence = _with_run(evidence, reader, reader.folders.run)
    evidence = _with_model(evidence, reader, options)
    evidence = replace(evidence, limits=_limits(evidence.cell, options))
    evidence = _with_rest(evidence, reader, options)
    evidence = _with_old(evidence, reader, options)
    evidence = replace(evidence, files=tuple(reader.files), missing=tuple(reader.missing))
    tool = options.tool or reader.folders.default(TOOL)
    files = ChainFiles(reader.folders.run, tool, reader.without_folders, options.signer)
    chain = (*verify_chain(evidence, files), *_history(evidence, reader.folders.run))
    evidence = replace(evidence, chain=chain)
    broken = (link.text for link in evidence.chain if link.state is LinkState.BROKEN)
    return replace(
        evidence,
        name=evidence.cell.name if evidence.cell else evidence.robot or "robot",
        doubts=tuple(dict.fromkeys((*broken, *find_doubts(evidence)))),
    )


def _history(evidence: Evidence, run: RunFolder | None) -> Iterator[Link]:
    if run is not None and evidence.run_record is not None and evidence.cell is not None:
        link = history_link(evidence.run_record, run, evidence.cell.name)
        yield from () if link is None else (link,)


def _with_readings(evidence: Evidence, reader: PartReader, options: EvidenceOptions) -> Evidence:
    """Return the evidence with the readings that a model states, where no run of ours took them.

    They lie beside it; so does the cell, or where the map of their logs says.
    """
    model = options.model or reader.folders.model or reader.folders.default(MODEL)
    names = [] if model is None else _stated_datasets(model)
    path = reader.folders.default(names[0]) if len(names) == 1 else None
    if path is None:
        reader.note_missing("run", _NO_RUN)
        return evidence
    data = reader.read("dataset", path, lambda: datasets.read(path))
    evidence = replace(evidence, dataset=data)
    stated = {} if data is None else read_made_from(data.attributes)
    if data is None or not stated or not data.provenance.startswith(IMPORTED):
        reader.note_missing("run", _NO_LOGS)
        return _with_cell(evidence, reader, reader.folders.default(_CELL))
    logs = tuple(path.parent / name for name in stated)
    log_map = _map_of(logs)
    evidence = replace(evidence, logs=logs, measured=_measured(log_map, logs))
    for log in logs:
        if log.exists():
            reader.use(log)
    cell = None if log_map is None else log_map.cell
    file = reader.folders.default(_CELL) if cell is None else logs[0].parent / cell
    return _with_cell(evidence, reader, file)


def _stated_datasets(model: Path) -> list[str]:
    """Return the names of the datasets that a model states; none of one that cannot be read."""
    try:
        return [Path(name).name for name in read_json(model, CalibrateResult).made_from]
    except ElastocalError:
        return []


def _map_of(logs: tuple[Path, ...]) -> LogMap | None:
    """Return the map of some logs; None if it cannot be read."""
    try:
        return read_map(logs[0])
    except ElastocalError:
        return None


def _measured(log_map: LogMap | None, logs: tuple[Path, ...]) -> str | None:
    """Return the day of imported readings; None where map or log cannot be read."""
    try:
        return None if log_map is None else days_of(log_map, logs[1:])
    except ElastocalError:
        return None


def _with_cell(evidence: Evidence, reader: PartReader, path: Path | None) -> Evidence:
    """Return the evidence with a cell and its surface, if it is that of the readings."""
    if path is None:
        return evidence
    cell = reader.read("cell", path, lambda: load_cell(path))
    if cell is None:
        return evidence
    measured = "" if evidence.dataset is None else evidence.dataset.robot_name
    if measured and measured != cell.robot.name:
        reason = phrase(
            "{file} is of {name}, the readings are of {measured}",
            file=reader.folders.shown(path),
            name=cell.robot.name,
            measured=measured,
        )
        reader.note_missing("cell", reason)
        return evidence
    surface = reader.read("surface", cell.path, lambda: cell_surface(cell))
    return replace(evidence, cell=cell, surface=surface, cell_text=read_text(cell.path))


def _with_run(evidence: Evidence, reader: PartReader, run: RunFolder) -> Evidence:
    """Return the evidence with the parts that a run folder holds."""
    journal = reader.read("journal", run.journal, lambda: read_journal(run.journal))
    evidence = replace(evidence, journal=journal)
    record = evidence.run_record
    path = run.cell / (record.cell_file if record else "cell.yaml")
    evidence = _with_plan(_with_cell(evidence, reader, path), reader, run)
    touches = record is not None and record.touch is not None
    summary = _derived(reader, "summary of the run", run.summary, read_summary, touches)
    dataset = _derived(reader, "dataset", run.dataset, datasets.read, touches)
    evidence = replace(evidence, dataset=dataset)
    for file in run_files(run):
        reader.use(file)
    return replace(evidence, summary=summary)


def _with_plan(evidence: Evidence, reader: PartReader, run: RunFolder) -> Evidence:
    cell, record = evidence.cell, evidence.run_record

    def plan_of_cell() -> PlanResult:
        plan = read_plan(run.plan)
        if record is not None:
            check_plan(run, record)
        if cell is not None:
            check_plan_robot(plan, cell)
        return plan

    plan = reader.read("plan", run.plan / PLAN, plan_of_cell)
    if plan is None:
        return evidence

    def pool_of_plan() -> PoolData:
        pool = read_pool(run.plan)
        check_pool_of(plan, pool)
        return pool

    if not (run.plan / POOL).exists():
        file = reader.folders.shown(run.plan / POOL)
        reader.note_missing("pool", phrase("there is no {file}", file=file))
        return replace(evidence, plan=plan)
    pool = reader.read("pool", run.plan / POOL, pool_of_plan)
    return replace(evidence, plan=plan, pool=pool)


def _derived(
    reader: PartReader, name: str, path: Path, read: Callable[[Path], Part], touches: bool
) -> Part | None:
    if not path.is_file():
        reason = reader.no_file(reader.folders.shown(path), phrase("`elastocal derive` makes it"))
        if touches:
            reason = phrase(
                "touches have none, they press no load case: `elastocal touch` reads them"
            )
        reader.note_missing(name, reason)
        return None
    return reader.read(name, path, lambda: read(path))


def _with_model(evidence: Evidence, reader: PartReader, options: EvidenceOptions) -> Evidence:
    given = options.model or reader.folders.model
    calibrated = reader.find(
        "calibrated model", given, MODEL, lambda path: _calibrated(path, evidence.dataset),
        phrase("`elastocal calibrate` makes one"),
    )  # fmt: skip
    evidence = replace(evidence, calibrated=calibrated)
    if calibrated is None or evidence.dataset is None:
        return evidence
    evidence = _with_campaigns(evidence, reader, calibrated)
    measured = present(evidence.calibrated_from, "readings")
    try:
        reproduction = reproduce_calibration(
            calibrated.as_calibrated, calibrated.figures, _as_calibrated(measured, calibrated)
        )
    except ElastocalError as error:
        reason = " ".join(str(error).split())
        reader.note_missing("calibration made again", reason, damaged=True)
        return evidence
    return replace(evidence, reproduction=reproduction)


def _with_campaigns(evidence: Evidence, reader: PartReader, found: ModelEvidence) -> Evidence:
    """Return the evidence with all datasets of a model, if those that it names are here."""
    own = content_sha256(present(evidence.dataset, "dataset"))
    if len(found.made_from) < 2 or own not in found.made_from.values():
        return evidence
    campaigns: list[Campaign] = []
    parts: list[tuple[Path, Dataset]] = []
    for name, sha256 in found.made_from.items():
        if sha256 == own:
            parts.append((Path(name), present(evidence.dataset, "dataset")))
            continue
        campaign = _campaign(name, sha256, reader)
        if campaign is None:
            return evidence
        campaigns.append(campaign)
        parts.append((Path(name), campaign.dataset))
        reader.use(campaign.path)
    merged, _ = merge_files(parts)
    return replace(evidence, campaigns=tuple(campaigns), merged=merged)


def _campaign(name: str, sha256: str, reader: PartReader) -> Campaign | None:
    """Return a dataset that a model names, where it was or beside the run; None if it is gone."""
    parts = Path(name).parts
    places = [Path(name)]
    for root in reader.folders.roots:
        places += [root.joinpath(*parts[-depth:]) for depth in (1, 2, 3) if depth < len(parts)]
    for place in places:
        if place.is_file():
            try:
                dataset = datasets.read(place)
            except ElastocalError:
                continue
            if content_sha256(dataset) == sha256:
                return Campaign(place, dataset)
    return None


def _as_calibrated(dataset: Dataset, found: ModelEvidence) -> Dataset:
    """Return the readings as they were calibrated: on the arm as built, where one was known."""
    settings = found.figures.settings if found.figures else None
    marker = settings.marker if settings else None
    return on_arm_as_built(dataset, found.model.model.robot, marker).dataset


def _calibrated(path: Path, dataset: Dataset | None) -> ModelEvidence:
    result = read_json(path, CalibrateResult)
    check_model(result.calibrated, dataset, path)
    hashes = result.robot.urdf_sha256, file_sha256(path)
    return ModelEvidence(
        result.calibrated, result.calibration, *hashes, result.made_from, result.update
    )


def _with_rest(evidence: Evidence, reader: PartReader, options: EvidenceOptions) -> Evidence:
    def tool(path: Path) -> ToolResult:
        return check_tool(read_tool(path), evidence, path)

    def process(path: Path) -> SimulatedProcess:
        folder = path.parent if path.name == TABLE else path
        return check_process(read_process(folder), evidence, folder / TABLE)

    place = options.tool or reader.folders.default(TOOL)
    found = reader.find("tool file", options.tool, TOOL, tool, phrase("`elastocal tool` makes one"))
    return replace(
        evidence,
        tool=found,
        tool_sha256=file_sha256(place) if found is not None and place is not None else None,
        codecs=_codecs(evidence, reader, options.codec),
        process=reader.find(
            phrase("simulated process"), options.process, PROCESS, process,
            phrase("`elastocal simulate-process` makes one for a simulated cell"),
            optional=bool(evidence.logs),
        ),
    )  # fmt: skip


def _codecs(
    evidence: Evidence, reader: PartReader, given: Path | None
) -> tuple[CodecEvidence, ...]:
    """Return the codec of a folder, or every one of the folders in it."""

    def codec(path: Path) -> CodecEvidence:
        data = check_codec(read_codec(path), evidence, path)
        if path.is_dir() and not (path / VERDICTS).is_file():
            raise CodecError(f"{path / VERDICTS} is gone: it is written together with {ARRAYS}")
        return CodecEvidence(data, judge(data), reader.folders.shown(path))

    root = given or reader.folders.default(CODEC)
    inner = sorted(path.parent for path in root.glob(f"*/{ARRAYS}")) if root else []
    if root is None or not inner or (root / ARRAYS).exists():
        hint = phrase("`elastocal codec` makes one")
        found = reader.find("codec", given, CODEC, codec, hint)
        return () if found is None else (found,)
    read = (
        reader.read("codec", path, partial(codec, path), named=given is not None) for path in inner
    )
    return tuple(each for each in read if each is not None)


def _with_old(evidence: Evidence, reader: PartReader, options: EvidenceOptions) -> Evidence:
    """Return the evidence with a comparison to an earlier model, where one is named."""
    old = options.old
    new = options.model or reader.folders.model or reader.folders.default(MODEL)
    if old is None:
        reason = phrase(
            "no earlier calibration was given to compare with, so nothing is known of any change"
        )
        reader.note_missing("earlier calibration", reason)
        return evidence
    if new is None or evidence.calibrated is None:
        reason = phrase("there is no calibrated model to compare it with")
        reader.note_missing("comparison with the earlier calibration", reason)
        return evidence
    q, force = _rows_that_matter(evidence)
    found = recertify_files(old, new, q, force, limit=evidence.limits.drift)
    reader.use(old)
    return replace(evidence, recertification=found.summary)


def _rows_that_matter(evidence: Evidence) -> tuple[FloatArray | None, FloatArray | None]:
    """Return joints and forces of production, else those of the run."""
    if evidence.cell is not None and evidence.cell.process is not None:
        return evidence.cell.process.joint_position, evidence.cell.process.force
    if evidence.dataset is None or evidence.calibrated is None:
        return None, None
    readings = evidence.dataset.readings(evidence.calibrated.model.model.robot.joint_names)
    return readings.joint_position, readings.force


def _limits(cell: Cell | None, options: EvidenceOptions) -> AcceptanceLimits:
    stated = cell.file.acceptance if cell is not None else None
    drift = options.drift or (stated.drift if stated else None)
    if options.tolerance is not None:
        return AcceptanceLimits(options.tolerance, drift, phrase("given with --tolerance"))
    if stated is not None and stated.tolerance is not None:
        return AcceptanceLimits(stated.tolerance, drift, phrase("set in the cell file"))
    return AcceptanceLimits(None, drift)
