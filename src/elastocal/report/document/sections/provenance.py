"""Where everything comes from: versions, hashes, seeds, every setting."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath

from elastocal import __version__
from elastocal.report.document.content import BYTES
from elastocal.report.document.markup import (
    Markup,
    flattened,
    folded,
    heading,
    html,
    paragraph,
    stamp,
    table,
    verbatim,
)
from elastocal.report.document.parts import Parts
from elastocal.report.document.section import Content, Section

PACKAGES = ("numpy", "scipy", "pin", "xarray", "matplotlib", "plotly")


def body(parts: Parts) -> Content:
    """Return the section."""
    text = table("Times", ("What", "When"), _times(parts), texts=2)
    text += table("Versions", ("What", "Version"), _versions(parts), texts=2)
    text += table("Seeds and fingerprints", ("What", "Value"), _seeds(parts), texts=2)
    text += _files(parts) + _settings(parts)
    if parts.cell_text is not None:
        text += folded("The cell file as it stands", verbatim(parts.cell_text))
    if parts.cell is not None:
        values = sorted(flattened(parts.cell.file.model_dump(mode="json")))
        text += folded(
            "Every setting of the cell, defaults included, in SI units",
            table("Settings of the cell", ("Key", "Value"), values, texts=2),
            "long",
        )
    return Content(text)


def _times(parts: Parts) -> Iterator[tuple[object, object]]:
    started = parts.summary["times"]["started"] if parts.summary else None
    if started is None and parts.journal:
        started = parts.journal[0].run.started if parts.journal[0].run else None
    yield "Run began", stamp(str(started)) if started else "not known"
    total = parts.summary["times"]["total"] if parts.summary else None
    if total is not None:
        yield "Run took", f"{total / 60:.1f} min of the cell's clock"
    yield "Report made", stamp(parts.made)


def _versions(parts: Parts) -> Iterator[tuple[str, str]]:
    yield "elastocal, this report", __version__
    record = parts.journal[0].run if parts.journal else None
    if record is not None:
        yield "elastocal, run", record.elastocal
    if parts.plan is not None:
        yield "elastocal, plan", parts.plan.elastocal
    for name, number in dict(
        pair for codec in parts.codecs for pair in codec.data.versions.items()
    ).items():
        yield f"{name}, codec", number
    yield "Python", platform.python_version()
    for name in PACKAGES:
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, "not known"


def _seeds(parts: Parts) -> Iterator[tuple[str, str]]:
    record = parts.journal[0].run if parts.journal else None
    if record is not None:
        yield "Seed of the simulated devices", str(record.seed)
        yield "Fingerprint of the cell", record.cell
    if parts.plan is not None:
        yield "Seed of the search", str(parts.plan.search.seed)
        yield "Fingerprint of the cell in the plan", parts.plan.cell.fingerprint
    if parts.codecs:
        seeds = dict.fromkeys(str(codec.data.options.seed) for codec in parts.codecs)
        yield "Seed of the codecs", ", ".join(seeds)
    if parts.process is not None:
        yield "Seeds of the process", ", ".join(str(run.seed) for run in parts.process.table.runs)
    if parts.calibrated is not None:
        yield "SHA-256 of the robot's URDF", parts.calibrated.urdf_sha256


def _files(parts: Parts) -> str:
    rows = [
        (each.name, Markup(f"<code>{html(each.sha256)}</code>"), each.of) for each in parts.files
    ]
    note = paragraph(
        f"Hashes of {BYTES} are what sha256sum gives. Files that carry the time of the run, or"
        " the folder it was started in, are hashed without those, so that equal runs have equal"
        " hashes. The raw streams are hashed in the journal.", "sub",
    )  # fmt: skip
    return heading("Files") + table("Files", ("File", "SHA-256", "Of"), rows, texts=3) + note


def _settings(parts: Parts) -> str:
    if parts.calibrated is None:
        return ""
    settings = parts.calibrated.figures.get("settings")
    if not isinstance(settings, dict):
        return paragraph("The model file does not tell the settings of its calibration.")
    rows = [(key, _setting(key, value)) for key, value in flattened(settings)]
    return heading("Settings") + table(
        "Settings of the calibration", ("Key", "Value"), rows, texts=2
    )


def _setting(key: str, value: str) -> str:
    """Return a setting as a reader without the command line understands it."""
    if key == "springs":
        return PurePath(value).name
    return "that of the dataset" if key == "marker" and value == "none" else value


SECTION = Section("provenance", "Provenance", body)
