"""Section: provenance of the figures: times, versions, seeds, hashes, settings."""

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import PurePath

from elastocal import __version__, blocks
from elastocal.records import to_data
from elastocal.report.document.section import Section, flattened
from elastocal.verdict import BYTES, Evidence, LinkState
from elastocal.wording import counted, phrase, phrases

_STATES = {
    LinkState.WHOLE: phrase("unchanged"),
    LinkState.BROKEN: phrase("changed or of something else"),
    LinkState.OTHERWISE: phrase("derived by another version"),
    LinkState.UNSTATED: phrase("not verifiable"),
    LinkState.UNSIGNED: phrase("not signed"),
}
_LINKS: dict[str, str] = {
    name: name
    for name in phrases(
        "signature", "cell and plan", "streams", "journal", "dataset", "summary", "model", "codec",
        "process", "content", "history",
    )
}  # fmt: skip
"""Links of the chain; any other is a file."""
_PACKAGES = ("numpy", "scipy", "pin", "xarray", "matplotlib", "plotly")


def _provenance(evidence: Evidence) -> Iterator[blocks.Block]:
    yield blocks.Table(phrase("Times"), phrases("What", "When"), tuple(_times(evidence)), texts=2)
    yield blocks.Table(
        phrase("Versions"), phrases("What", "Version"), tuple(_versions(evidence)), texts=2
    )
    seeds = tuple(_seeds(evidence))
    yield blocks.Table(phrase("Seeds and fingerprints"), phrases("What", "Value"), seeds, texts=2)
    yield from _chain(evidence)
    yield from _files(evidence)
    yield from _settings(evidence)
    if evidence.cell_text is not None:
        yield blocks.Details(
            phrase("The cell file as it stands"), (blocks.Verbatim(evidence.cell_text),)
        )
    if evidence.cell is not None:
        values = tuple(
            (key, _of_plan(evidence, key, value))
            for key, value in sorted(flattened(evidence.cell.file.model_dump(mode="json")))
        )
        yield blocks.Details(
            phrase(
                "Every setting as the program takes it, defaults included: numbers in m, rad, N,"
                " kg, s; what the cell file sets stands above with its units"
            ),
            (blocks.Table(phrase("Settings of the cell"), phrases("Key", "Value"), values, 2),),
            "long",
        )


def _of_plan(evidence: Evidence, key: str, value: str) -> str:
    """Return a setting, or what the planner put in its place."""
    if key == "search.technique" and evidence.plan is not None:
        return phrase("{name}, by the plan", name=evidence.plan.search.name)
    return value


def _times(evidence: Evidence) -> Iterator[blocks.Row]:
    record, times = evidence.run_record, evidence.summary.times if evidence.summary else None
    started = times.started if times else None
    if started is None and record is not None:
        started = record.started
    yield phrase("Run began"), blocks.Stamp(started) if started else phrase("not known")
    if times is not None and times.total is not None:
        minutes = f"{times.total / 60:.1f}"
        yield (
            phrase("Run took"),
            (
                phrase("{minutes} min of simulated time", minutes=minutes)
                if evidence.simulated
                else phrase("{minutes} min", minutes=minutes)
            ),
        )
    yield phrase("Report made"), blocks.Stamp(evidence.made)


def _versions(evidence: Evidence) -> Iterator[blocks.Row]:
    yield phrase("elastocal, this report"), blocks.Code(__version__)
    if evidence.run_record is not None:
        yield phrase("elastocal, run"), blocks.Code(evidence.run_record.elastocal)
    if evidence.plan is not None:
        yield phrase("elastocal, plan"), blocks.Code(evidence.plan.elastocal)
    for name, number in dict(
        pair for codec in evidence.codecs for pair in codec.data.versions.items()
    ).items():
        yield phrase("{name}, codec", name=name), blocks.Code(number)
    yield "Python", blocks.Code(platform.python_version())
    for name in _PACKAGES:
        try:
            yield name, blocks.Code(version(name))
        except PackageNotFoundError:
            yield name, phrase("not known")


def _seeds(evidence: Evidence) -> Iterator[blocks.Row]:
    if evidence.run_record is not None:
        yield phrase("Seed of the simulated devices"), str(evidence.run_record.seed)
        yield phrase("Fingerprint of the cell"), blocks.Code(evidence.run_record.cell)
    if evidence.plan is not None:
        yield phrase("Seed of the search"), str(evidence.plan.search.seed)
        yield (
            phrase("Fingerprint of the cell in the plan"),
            blocks.Code(evidence.plan.cell.fingerprint),
        )
    if evidence.codecs:
        seeds = dict.fromkeys(str(codec.data.options.seed) for codec in evidence.codecs)
        yield phrase("Seed of the codecs"), ", ".join(seeds)
    if evidence.process is not None:
        runs = evidence.process.table.runs
        yield phrase("Seeds of the process"), ", ".join(str(run.seed) for run in runs)
    if evidence.calibrated is not None:
        yield phrase("SHA-256 of the robot's URDF"), blocks.Code(evidence.calibrated.urdf_sha256)


def _chain(evidence: Evidence) -> Iterator[blocks.Block]:
    if not evidence.chain:
        return
    rows = tuple(
        (_LINKS.get(link.name, link.name), _STATES[link.state], link.text)
        for link in evidence.chain
    )
    yield blocks.Table(
        phrase("From the streams to this report"), phrases("Link", "State", "Found"), rows, texts=3
    )


def _files(evidence: Evidence) -> Iterator[blocks.Block]:
    rows = tuple((each.name, blocks.Code(each.sha256), each.of) for each in evidence.files)
    table = blocks.Table(phrase("Files"), phrases("File", "SHA-256", "Of"), rows, texts=3)
    hashed = blocks.Paragraph(
        phrase(
            "Hashes of {bytes} are what sha256sum gives. Files that carry the time of the run, or"
            " the folder it was started in, are hashed without those, so that equal runs have equal"
            " hashes. The raw streams are hashed in the journal.",
            bytes=BYTES,
        ),
        "sub",
    )
    files = counted(len(rows), "file")
    yield blocks.Details(phrase("{files} with their SHA-256", files=files), (table, hashed))


def _settings(evidence: Evidence) -> Iterator[blocks.Block]:
    if evidence.calibrated is None:
        return
    settings = evidence.figures.settings if evidence.figures else None
    if settings is None:
        yield blocks.Paragraph(
            phrase("The model file does not tell the settings of its calibration.")
        )
        return
    rows = tuple((key, _setting(key, value)) for key, value in flattened(to_data(settings)))
    caption = phrase("Settings of the calibration")
    table = blocks.Table(caption, phrases("Key", "Value"), rows, texts=2)
    yield blocks.Details(caption, (table,))


def _setting(key: str, value: str) -> str:
    """Return a setting as a reader without the command line understands it."""
    if key == "springs":
        return PurePath(value).name
    return phrase("that of the dataset") if key == "marker" and value == "none" else value


PROVENANCE = Section(
    "provenance",
    phrase("Provenance"),
    phrase("Where do the figures come from?"),
    90,
    _provenance,
)
