"""From the files of a run to the parts of its report.

What a person names must be there and sound, or the report is refused. What lies under a default
name and cannot be used is left out, and the report says why. Parts that belong to another robot
or another cell count as unusable.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from elastocal import dataset as datasets
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, load_cell
from elastocal.codec import judge, read_codec
from elastocal.compensation.conditioning.tool_file import ToolRecord, read_tool
from elastocal.compensation.process.folder import TABLE, read_process
from elastocal.compensation.process.record import ProcessRecord
from elastocal.dataset import Dataset
from elastocal.errors import ElastocalError
from elastocal.files import read_text
from elastocal.identification.model_file import read_model, read_record
from elastocal.identification.recertification import recertify_files
from elastocal.planning.plan_file import PLAN, POOL, PlanFile, read_plan
from elastocal.planning.pool_file import PoolData, check_pool_of, read_pool
from elastocal.planning.tooling import cell_surface
from elastocal.procedure.copies import file_sha256
from elastocal.procedure.entries import Entry
from elastocal.procedure.journal import read_journal
from elastocal.procedure.run_folder import RunFolder
from elastocal.procedure.summary import read_summary
from elastocal.report.belongs import check_robot
from elastocal.report.document.again import Again, calibrate_again
from elastocal.report.document.content import hash_of
from elastocal.report.document.fitting import (
    check_codec,
    check_model,
    check_process,
    check_tool,
    doubts,
)
from elastocal.report.document.parts import (
    Absence,
    Calibrated,
    Codec,
    Limits,
    Parts,
    UsedFile,
)
from elastocal.report.document.places import (
    CODEC,
    MODEL,
    PROCESS,
    TOOL,
    Places,
    find_places,
    run_files,
)
from elastocal.report.document.shapes import checked_figures, checked_summary

Part = TypeVar("Part")


@dataclass(frozen=True)
class Options:
    """What a person names."""

    run: Path
    model: Path | None = None
    tool: Path | None = None
    codec: Path | None = None
    process: Path | None = None
    old: Path | None = None
    """Model file of an earlier calibration of the cell; there is no default name."""
    tolerance: float | None = None
    """In m; in place of that of the cell file."""
    drift: float | None = None
    """In m; likewise."""


@dataclass
class _Search:
    """What has been found so far; grows while the parts are read."""

    places: Places
    files: list[UsedFile] = field(default_factory=list)
    absent: list[Absence] = field(default_factory=list)

    def read(self, name: str, path: Path, read: Callable[[], Part], named: bool) -> Part | None:
        """Return a part, or None and a note of why there is none."""
        try:
            part = read()
        except ElastocalError as error:
            if named:
                raise
            self.absent.append(Absence(name, self._said(error), damaged=True))
            return None
        self.use(path)
        return part

    def find(
        self, name: str, given: Path | None, default: str, read: Callable[[Path], Part], hint: str
    ) -> Part | None:
        """Return a part that may be named or lie under a default name."""
        path = given or self.places.default(default)
        if path is None:
            self.absent.append(Absence(name, f"there is no {default}; {hint}"))
            return None
        return self.read(name, path, lambda: read(path), named=given is not None)

    def use(self, path: Path) -> None:
        """Note the hash of a file, or of every file in a folder that belongs to a part."""
        for file in sorted(_files_of(path)):
            shown = self.places.shown(file)
            if shown not in {each.name for each in self.files}:
                self.files.append(UsedFile(shown, *hash_of(file)))

    def _said(self, error: ElastocalError) -> str:
        """Return a reason without the folder that the run happens to lie in."""
        text = " ".join(str(error).split())
        for root in self.places.roots:
            for form in {str(root), str(root.resolve())} - {"."}:
                text = text.replace(f"{form}/", "")
        return text


def gather(options: Options, made: str) -> Parts:
    """Return the parts of a report.

    Parameters
    ----------
    options : Options
        What is named.
    made : str
        Date and time of the report, ISO 8601, UTC.

    Raises
    ------
    ElastocalError
        If there is nothing to report on, or a part that is named cannot be used.
    """
    search = _Search(find_places(options.run))
    parts = _with_run(Parts(made=made), search)
    parts = _with_model(parts, search, options)
    parts = replace(parts, limits=_limits(parts.cell, options))
    parts = _with_rest(parts, search, options)
    parts = _with_old(parts, search, options)
    return replace(
        parts,
        name=parts.cell.name if parts.cell else parts.robot or "robot",
        files=tuple(search.files),
        absent=tuple(search.absent),
        doubts=doubts(parts),
    )


def _with_run(parts: Parts, search: _Search) -> Parts:
    run = search.places.run
    if run is None:
        reason = "no folder of a run was given: nothing is known of how the readings came about"
        search.absent.append(Absence("run", reason))
        return parts
    journal = search.read("journal", run.journal, lambda: read_journal(run.journal), named=False)
    cell = _cell(search, run, journal)
    parts = replace(parts, journal=journal, cell=cell)
    if cell is not None:
        surface = search.read("surface", cell.path, lambda: cell_surface(cell), named=False)
        parts = replace(parts, surface=surface, cell_text=read_text(cell.path))
    parts = _with_plan(parts, search, run)
    summary = _derived(
        search,
        "summary of the run",
        run.summary,
        lambda path: checked_summary(read_summary(path), str(path)),
    )
    parts = replace(parts, dataset=_derived(search, "dataset", run.dataset, datasets.read))
    for file in run_files(run):
        search.use(file)
    return replace(parts, summary=summary)


def _cell(search: _Search, run: RunFolder, journal: tuple[Entry, ...] | None) -> Cell | None:
    record = journal[0].run if journal else None
    path = run.cell / (record.cell_file if record else "cell.yaml")
    return search.read("cell", path, lambda: load_cell(path), named=False)


def _with_plan(parts: Parts, search: _Search, run: RunFolder) -> Parts:
    cell = parts.cell

    def plan_of_cell() -> PlanFile:
        plan = read_plan(run.plan)
        if cell is not None:
            check_robot(plan, cell)
        return plan

    plan = search.read("plan", run.plan / PLAN, plan_of_cell, named=False)
    if plan is None:
        return parts

    def pool_of_plan() -> PoolData:
        pool = read_pool(run.plan)
        check_pool_of(plan, pool)
        return pool

    pool = search.read("pool", run.plan / POOL, pool_of_plan, named=False)
    return replace(parts, plan=plan, pool=pool)


def _derived(search: _Search, name: str, path: Path, read: Callable[[Path], Part]) -> Part | None:
    if not path.is_file():
        reason = f"there is no {search.places.shown(path)}; `elastocal derive` makes it"
        search.absent.append(Absence(name, reason))
        return None
    return search.read(name, path, lambda: read(path), named=False)


def _with_model(parts: Parts, search: _Search, options: Options) -> Parts:
    given = options.model or search.places.model
    calibrated = search.find(
        "calibrated model", given, MODEL, lambda path: _calibrated(path, parts.dataset),
        "`elastocal calibrate` makes one",
    )  # fmt: skip
    parts = replace(parts, calibrated=calibrated)
    if calibrated is None or parts.dataset is None:
        return parts
    try:
        again: Again | None = calibrate_again(calibrated.model, calibrated.figures, parts.dataset)
    except ElastocalError as error:
        search.absent.append(Absence("calibration made again", " ".join(str(error).split()), True))
        again = None
    return replace(parts, again=again)


def _calibrated(path: Path, dataset: Dataset | None) -> Calibrated:
    record, model = read_record(path), read_model(path)
    check_model(model, dataset, path)
    figures = checked_figures(dict(record.calibration), f"{path}: calibration")
    return Calibrated(model, figures, record.robot.urdf_sha256, file_sha256(path))


def _with_rest(parts: Parts, search: _Search, options: Options) -> Parts:
    def tool(path: Path) -> ToolRecord:
        return check_tool(read_tool(path), parts, path)

    def codec(path: Path) -> Codec:
        data = check_codec(read_codec(path), parts, path)
        return Codec(data, judge(data))

    def process(path: Path) -> ProcessRecord:
        folder = path.parent if path.name == TABLE else path
        return check_process(read_process(folder), parts, folder / TABLE)

    return replace(
        parts,
        tool=search.find("tool file", options.tool, TOOL, tool, "`elastocal tool` makes one"),
        codec=search.find("codec", options.codec, CODEC, codec, "`elastocal codec` makes one"),
        process=search.find(
            "process", options.process, PROCESS, process,
            "`elastocal simulate-process` makes one for a simulated cell",
        ),
    )  # fmt: skip


def _with_old(parts: Parts, search: _Search, options: Options) -> Parts:
    """Return the parts with a comparison to an earlier model, where one is named."""
    old = options.old
    new = options.model or search.places.model or search.places.default(MODEL)
    if old is None:
        reason = "no earlier calibration was given (--old), so nothing is known of any change"
        search.absent.append(Absence("earlier calibration", reason))
        return parts
    if new is None or parts.calibrated is None:
        reason = "there is no calibrated model to compare it with"
        search.absent.append(Absence("comparison with the earlier calibration", reason))
        return parts
    q, force = _rows_that_matter(parts)
    found = recertify_files(old, new, q, force, limit=parts.limits.drift)
    search.use(old)
    return replace(parts, recertification=found)


def _rows_that_matter(parts: Parts) -> tuple[FloatArray | None, FloatArray | None]:
    """Return joints and forces of production, else those of the run."""
    if parts.cell is not None and parts.cell.process is not None:
        return parts.cell.process.joint_position, parts.cell.process.force
    if parts.dataset is None or parts.calibrated is None:
        return None, None
    readings = parts.dataset.readings(parts.calibrated.model.model.robot.joint_names)
    return readings.joint_position, readings.force


def _limits(cell: Cell | None, options: Options) -> Limits:
    stated = cell.file.acceptance if cell is not None else None
    drift = options.drift or (stated.drift if stated else None)
    if options.tolerance is not None:
        return Limits(options.tolerance, drift, "given with --tolerance")
    if stated is not None and stated.tolerance is not None:
        return Limits(stated.tolerance, drift, "of the cell file")
    return Limits(None, drift)


def _files_of(path: Path) -> list[Path]:
    """Return a file, or the files of a folder that a report reads; pictures are none of them."""
    if path.is_file():
        return [path]
    read = ("codec.nc", "codec.json", TABLE, "deviations.csv")
    return [path / name for name in read if (path / name).is_file()]
