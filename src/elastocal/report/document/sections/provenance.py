"""Where the figures come from, and what the report does not show; neither list is ever empty."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath

from elastocal import __version__
from elastocal.records import to_data
from elastocal.report.document import blocks
from elastocal.verdict import BYTES, Evidence
from elastocal.wording import mm

_PACKAGES = ("numpy", "scipy", "pin", "xarray", "matplotlib", "plotly")


def _provenance(evidence: Evidence) -> Iterator[blocks.Block]:
    yield blocks.Table("Times", ("What", "When"), tuple(_times(evidence)), texts=2)
    yield blocks.Table("Versions", ("What", "Version"), tuple(_versions(evidence)), texts=2)
    yield blocks.Table(
        "Seeds and fingerprints", ("What", "Value"), tuple(_seeds(evidence)), texts=2
    )
    yield from _chain(evidence)
    yield from _files(evidence)
    yield from _settings(evidence)
    if evidence.cell_text is not None:
        yield blocks.Details("The cell file as it stands", (blocks.Verbatim(evidence.cell_text),))
    if evidence.cell is not None:
        values = tuple(sorted(blocks.flattened(evidence.cell.file.model_dump(mode="json"))))
        yield blocks.Details(
            "Every setting of the cell, defaults included, in SI units",
            (blocks.Table("Settings of the cell", ("Key", "Value"), values, texts=2),),
            "long",
        )


def _times(evidence: Evidence) -> Iterator[blocks.Row]:
    record, times = evidence.run_record, evidence.summary.times if evidence.summary else None
    started = times.started if times else None
    if started is None and record is not None:
        started = record.started
    yield "Run began", blocks.Stamp(started) if started else "not known"
    if times is not None and times.total is not None:
        yield "Run took", f"{times.total / 60:.1f} min of the cell's clock"
    yield "Report made", blocks.Stamp(evidence.made)


def _versions(evidence: Evidence) -> Iterator[blocks.Row]:
    yield "elastocal, this report", __version__
    if evidence.run_record is not None:
        yield "elastocal, run", evidence.run_record.elastocal
    if evidence.plan is not None:
        yield "elastocal, plan", evidence.plan.elastocal
    for name, number in dict(
        pair for codec in evidence.codecs for pair in codec.data.versions.items()
    ).items():
        yield f"{name}, codec", number
    yield "Python", platform.python_version()
    for name in _PACKAGES:
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, "not known"


def _seeds(evidence: Evidence) -> Iterator[blocks.Row]:
    if evidence.run_record is not None:
        yield "Seed of the simulated devices", str(evidence.run_record.seed)
        yield "Fingerprint of the cell", evidence.run_record.cell
    if evidence.plan is not None:
        yield "Seed of the search", str(evidence.plan.search.seed)
        yield "Fingerprint of the cell in the plan", evidence.plan.cell.fingerprint
    if evidence.codecs:
        seeds = dict.fromkeys(str(codec.data.options.seed) for codec in evidence.codecs)
        yield "Seed of the codecs", ", ".join(seeds)
    if evidence.process is not None:
        runs = evidence.process.table.runs
        yield "Seeds of the process", ", ".join(str(run.seed) for run in runs)
    if evidence.calibrated is not None:
        yield "SHA-256 of the robot's URDF", evidence.calibrated.urdf_sha256


def _chain(evidence: Evidence) -> Iterator[blocks.Block]:
    if not evidence.chain:
        return
    rows = tuple((link.name, link.state.value, link.text) for link in evidence.chain)
    yield blocks.Heading("From the streams to this report")
    yield blocks.Table("Links", ("Link", "State", "Found"), rows, texts=3)


def _files(evidence: Evidence) -> Iterator[blocks.Block]:
    rows = tuple((each.name, blocks.Code(each.sha256), each.of) for each in evidence.files)
    yield blocks.Heading("Files")
    yield blocks.Table("Files", ("File", "SHA-256", "Of"), rows, texts=3)
    yield blocks.Paragraph(
        f"Hashes of {BYTES} are what sha256sum gives. Files that carry the time of the run, or"
        " the folder it was started in, are hashed without those, so that equal runs have equal"
        " hashes. The raw streams are hashed in the journal.", "sub",
    )  # fmt: skip


def _settings(evidence: Evidence) -> Iterator[blocks.Block]:
    if evidence.calibrated is None:
        return
    settings = evidence.figures.settings if evidence.figures else None
    if settings is None:
        yield blocks.Paragraph("The model file does not tell the settings of its calibration.")
        return
    rows = tuple((key, _setting(key, value)) for key, value in blocks.flattened(to_data(settings)))
    yield blocks.Heading("Settings")
    yield blocks.Table("Settings of the calibration", ("Key", "Value"), rows, texts=2)


def _setting(key: str, value: str) -> str:
    """Return a setting as a reader without the command line understands it."""
    if key == "springs":
        return PurePath(value).name
    return "that of the dataset" if key == "marker" and value == "none" else value


PROVENANCE = blocks.Section("provenance", "Provenance", 90, _provenance)


_ALWAYS = (
    "Geometric calibration and the sag under the arm's own weight: only deflection under a force"
    " is modelled, and both must be corrected before it.",
    "Absolute accuracy: deflections are differences to the unloaded reading at the same pose.",
    "Temperature: nothing corrects for a warm arm.",
    "Payloads and tools other than the one of this run.",
    "Poses outside the region of the pool, and forces beyond those that were applied.",
    "Dynamic effects: readings were taken while the arm stood still.",
    "The controller that will apply the correction, and its delay.",
    "Safety: a calibrated model is not a safety function.",
)


def _not_verified(evidence: Evidence) -> Iterator[blocks.Block]:
    yield blocks.Paragraph("Whatever the light says, this was not verified:")
    yield blocks.Bullets(tuple(_always(evidence)))
    yield blocks.Heading("Missing in this report")
    missing = tuple(
        f"{each.name[0].upper()}{each.name[1:]}{' (cannot be used)' if each.damaged else ''}:"
        f" {each.reason}"
        for each in evidence.missing
    )
    none = blocks.Paragraph("No part of the report is missing.")
    yield blocks.Bullets(missing, code=True) if missing else none
    if evidence.doubts:
        yield blocks.Heading("What does not fit together")
        yield blocks.Bullets(evidence.doubts)


def _always(evidence: Evidence) -> Iterator[str]:
    if evidence.simulated:
        yield "A real robot: all devices of this run are simulated."
    yield from _ALWAYS
    calibrated = evidence.calibrated
    if calibrated is not None and calibrated.model.observability.unobservable:
        yield (
            "Single springs that no reading tells apart (see Compliances): their numbers are not"
            " findings."
        )
    if evidence.plan is not None:
        yield (
            "Places on the surface farther than"
            f" {mm(evidence.plan.search.covering_radius, 1)} from every pose; that is how far the"
            " worst covered candidate is from one."
        )


NOT_VERIFIED = blocks.Section("not-verified", "What was not verified", 100, _not_verified)
