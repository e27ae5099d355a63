"""From the files of a run to the parts of its report.

What a person names must be there and sound, or the report is refused. What lies under a default
name and cannot be used is left out, and the report says why. Parts that belong to another robot
or another cell count as unusable.
"""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.codec import ARRAYS, judge, read_codec
from elastocal.compensation.conditioning import ToolResult, read_tool
from elastocal.compensation.process import TABLE, SimulatedProcess, read_process
from elastocal.dataset import Dataset
from elastocal.errors import ElastocalError
from elastocal.identification import CalibrateResult
from elastocal.identification.recertification import recertify_files
from elastocal.procedure import file_sha256
from elastocal.records import read_json, to_data
from elastocal.report.document.again import Again, calibrate_again
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
)
from elastocal.report.document.places import (
    CODEC,
    MODEL,
    PROCESS,
    TOOL,
    find_places,
)
from elastocal.report.document.run_parts import with_run
from elastocal.report.document.searching import Search


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
    search = Search(find_places(options.run))
    parts = with_run(Parts(made=made), search)
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


def _with_model(parts: Parts, search: Search, options: Options) -> Parts:
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
    record = read_json(path, CalibrateResult)
    model = record.calibrated
    check_model(model, dataset, path)
    figures = {} if record.calibration is None else to_data(record.calibration)
    return Calibrated(model, figures, record.robot.urdf_sha256, file_sha256(path))


def _with_rest(parts: Parts, search: Search, options: Options) -> Parts:
    def tool(path: Path) -> ToolResult:
        return check_tool(read_tool(path), parts, path)

    def process(path: Path) -> SimulatedProcess:
        folder = path.parent if path.name == TABLE else path
        return check_process(read_process(folder), parts, folder / TABLE)

    place = options.tool or search.places.default(TOOL)
    found = search.find("tool file", options.tool, TOOL, tool, "`elastocal tool` makes one")
    return replace(
        parts,
        tool=found,
        tool_sha256=file_sha256(place) if found is not None and place is not None else None,
        codecs=_codecs(parts, search, options.codec),
        process=search.find(
            "process", options.process, PROCESS, process,
            "`elastocal simulate-process` makes one for a simulated cell",
        ),
    )  # fmt: skip


def _codecs(parts: Parts, search: Search, given: Path | None) -> tuple[Codec, ...]:
    """Return the codec of a folder, or every one of the folders in it."""

    def codec(path: Path) -> Codec:
        data = check_codec(read_codec(path), parts, path)
        return Codec(data, judge(data))

    root = given or search.places.default(CODEC)
    inner = sorted(path.parent for path in root.glob(f"*/{ARRAYS}")) if root else []
    if root is None or not inner or (root / ARRAYS).exists():
        hint = "`elastocal codec` makes one"
        found = search.find("codec", given, CODEC, codec, hint)
        return () if found is None else (found,)
    read = (
        search.read("codec", path, partial(codec, path), named=given is not None) for path in inner
    )
    return tuple(each for each in read if each is not None)


def _with_old(parts: Parts, search: Search, options: Options) -> Parts:
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
    return replace(parts, recertification=found.summary)


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
