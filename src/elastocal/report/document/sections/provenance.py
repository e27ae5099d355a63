"""Where everything comes from: versions, hashes, seeds, every setting."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath

from elastocal import __version__
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
from elastocal.report.document.section import Content, Section
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.hashes import BYTES

PACKAGES = ("numpy", "scipy", "pin", "xarray", "matplotlib", "plotly")


def body(evidence: Evidence) -> Content:
    """Return the section."""
    text = table("Times", ("What", "When"), _times(evidence), texts=2)
    text += table("Versions", ("What", "Version"), _versions(evidence), texts=2)
    text += table("Seeds and fingerprints", ("What", "Value"), _seeds(evidence), texts=2)
    text += _files(evidence) + _settings(evidence)
    if evidence.cell_text is not None:
        text += folded("The cell file as it stands", verbatim(evidence.cell_text))
    if evidence.cell is not None:
        values = sorted(flattened(evidence.cell.file.model_dump(mode="json")))
        text += folded(
            "Every setting of the cell, defaults included, in SI units",
            table("Settings of the cell", ("Key", "Value"), values, texts=2),
            "long",
        )
    return Content(text)


def _times(evidence: Evidence) -> Iterator[tuple[object, object]]:
    started = evidence.summary["times"]["started"] if evidence.summary else None
    if started is None and evidence.journal:
        started = evidence.journal[0].run.started if evidence.journal[0].run else None
    yield "Run began", stamp(str(started)) if started else "not known"
    total = evidence.summary["times"]["total"] if evidence.summary else None
    if total is not None:
        yield "Run took", f"{total / 60:.1f} min of the cell's clock"
    yield "Report made", stamp(evidence.made)


def _versions(evidence: Evidence) -> Iterator[tuple[str, str]]:
    yield "elastocal, this report", __version__
    record = evidence.journal[0].run if evidence.journal else None
    if record is not None:
        yield "elastocal, run", record.elastocal
    if evidence.plan is not None:
        yield "elastocal, plan", evidence.plan.elastocal
    for name, number in dict(
        pair for codec in evidence.codecs for pair in codec.data.versions.items()
    ).items():
        yield f"{name}, codec", number
    yield "Python", platform.python_version()
    for name in PACKAGES:
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, "not known"


def _seeds(evidence: Evidence) -> Iterator[tuple[str, str]]:
    record = evidence.journal[0].run if evidence.journal else None
    if record is not None:
        yield "Seed of the simulated devices", str(record.seed)
        yield "Fingerprint of the cell", record.cell
    if evidence.plan is not None:
        yield "Seed of the search", str(evidence.plan.search.seed)
        yield "Fingerprint of the cell in the plan", evidence.plan.cell.fingerprint
    if evidence.codecs:
        seeds = dict.fromkeys(str(codec.data.options.seed) for codec in evidence.codecs)
        yield "Seed of the codecs", ", ".join(seeds)
    if evidence.process is not None:
        yield (
            "Seeds of the process",
            ", ".join(str(run.seed) for run in evidence.process.table.runs),
        )
    if evidence.calibrated is not None:
        yield "SHA-256 of the robot's URDF", evidence.calibrated.urdf_sha256


def _files(evidence: Evidence) -> str:
    rows = [
        (each.name, Markup(f"<code>{html(each.sha256)}</code>"), each.of) for each in evidence.files
    ]
    note = paragraph(
        f"Hashes of {BYTES} are what sha256sum gives. Files that carry the time of the run, or"
        " the folder it was started in, are hashed without those, so that equal runs have equal"
        " hashes. The raw streams are hashed in the journal.", "sub",
    )  # fmt: skip
    return heading("Files") + table("Files", ("File", "SHA-256", "Of"), rows, texts=3) + note


def _settings(evidence: Evidence) -> str:
    if evidence.calibrated is None:
        return ""
    settings = evidence.calibrated.figures.get("settings")
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
