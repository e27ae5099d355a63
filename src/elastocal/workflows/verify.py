"""``verify``: is a run, or a report, what it was when it was made; who vouches for it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal.blocks import Block, Facts
from elastocal.errors import ElastocalError, FileAccessError, VerificationError
from elastocal.options import Option
from elastocal.procedure import JOURNAL
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.verdict import (
    OF_REPORT,
    EvidenceOptions,
    FoundManifest,
    Link,
    LinkState,
    Manifest,
    check_signature,
    file_links,
    gather_evidence,
    read_manifest,
    read_public_key,
)
from elastocal.workflows._workflow import workflow

_HASH = re.compile("[0-9a-f]{8,64}")
_SHOWN = 16
"""Number of digits of a run's hash that people compare."""
_OF_A_RUN = ("run", "journal", "cell", "plan", "dataset", "summary of the run")
"""Parts that a run has, whatever was made from it; without one nothing is verified."""


@dataclass(frozen=True)
class VerifySettings:
    """Settings of ``verify``: the object and its expected signer."""

    file: str | PathLike[str]
    """A report, or the folder of a run, or a folder that holds one."""
    key: Annotated[Path | None, Option(metavar="PUBLIC")] = None
    """Public key that must have signed it; by default none need have."""
    run: Annotated[Path | None, Option(metavar="DIR")] = None
    """Folder of the run that a report shows; by default the report's own."""
    expect: Annotated[str | None, Option(metavar="HASH")] = None
    """Hash of the run that it must be, or its first 8 digits or more; by default any."""


@dataclass(frozen=True, eq=False, repr=False)
class VerifyResult(Result):
    """Every link of the chain, and how it was found."""

    file: str
    links: tuple[Link, ...]

    @property
    def broken(self) -> Link | None:
        """The first broken link; None if there is none."""
        return next((link for link in self.links if link.state is LinkState.BROKEN), None)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return tuple((link.name, f"{link.state.value}: {link.text}") for link in self.links)

    def show(self) -> Iterator[Block]:
        """Yield a line a link, its state first."""
        # One line each: the words of a forged report must not look like a link of their own.
        yield Facts(
            tuple(
                (f"{link.state.value:<14} {_on_one_line(link.name)}", _on_one_line(link.text))
                for link in self.links
            )
        )

    def require_whole(self) -> None:
        """Refuse what is broken.

        Raises
        ------
        VerificationError
            With the first broken link.
        """
        if self.broken is not None:
            raise VerificationError(f"{self.file}: {self.broken.text}")


def _on_one_line(text: str) -> str:
    return " ".join(text.split())


@workflow(VerifySettings)
def verify(settings: VerifySettings, progress: Progress) -> VerifyResult:  # noqa: ARG001 - seconds
    """Verify the chain of a run from its streams to its model, or a report with what it shows.

    Raises
    ------
    FileAccessError
        If there is nothing of ours.
    SchemaError
        If the page is no report, or one made before reports could be verified.
    VerificationError
        If the key cannot be read.

    Examples
    --------
    >>> import elastocal as ec
    >>> run = ec.datasets.afp_run("afp", poses=4)
    >>> dict(ec.verify(run).facts())["dataset"]
    'whole: the dataset is what the streams give, made again from them'
    """
    target = Path(settings.file)
    trusted = None if settings.key is None else read_public_key(settings.key)
    if target.is_file() and target.suffix.lower() in (".html", ".htm"):
        return VerifyResult(str(target), (*_report(target, settings, trusted),))
    if not target.exists():
        raise FileAccessError(f"cannot read {target}: there is no such file or folder")
    if not target.is_dir():
        raise FileAccessError(f"{target} is neither a report (.html) nor the folder of a run")
    if settings.run is not None:
        raise FileAccessError(f"--run {settings.run}: it says where the run of a report lies")
    return VerifyResult(str(target), (*_run(target, trusted, settings.expect, alone=True),))


def _report(path: Path, settings: VerifySettings, trusted: str | None) -> list[Link]:
    """Return the links of a report: page, signature, files, and those of the run beside it."""
    found, run = read_manifest(path), settings.run
    manifest = found.manifest
    if found.page_sha256 == manifest.page_sha256:
        text = f"the page is the one that was written: {_light(manifest)}"
        links = [Link("page", LinkState.WHOLE, text)]
    else:
        text = "the page was edited after it was written: its SHA-256 is not that of its manifest"
        links = [Link("page", LinkState.BROKEN, text)]
    links.append(_signature(found, trusted))
    links += _expected(manifest.run, settings.expect)
    folder = path.parent if run is None else run
    folders = tuple(dict.fromkeys((folder, folder.resolve().parent))) if run else (folder,)
    files = file_links(manifest, folders)
    links += files
    if any(link.name == "logs" for link in manifest.chain) or (
        manifest.chain and _holds_run(folder)
    ):
        links += _run(folder, None)
    return links


def _holds_run(folder: Path) -> bool:
    return any((folder / place).is_file() for place in (JOURNAL, f"run/{JOURNAL}"))


def _light(manifest: Manifest) -> str:
    return f"{manifest.verdict} ({manifest.light} light)" if manifest.light else manifest.verdict


def _signature(found: FoundManifest, trusted: str | None) -> Link:
    signature = found.manifest.signature
    if signature is None:
        state = LinkState.UNSIGNED if trusted is None else LinkState.BROKEN
        return Link("signature", state, "the report is not signed: whoever edits it can renew it")
    try:
        check_signature(signature, OF_REPORT, found.signed_sha256, trusted)
    except VerificationError as error:
        return Link("signature", LinkState.BROKEN, str(error))
    signer = f"the report is signed by key {signature.signer}"
    text = signer if trusted else f"{signer}; give --key to hold it against one that you trust"
    return Link("signature", LinkState.WHOLE, text)


def _expected(found: str | None, expect: str | None) -> list[Link]:
    """Return whether a run is the expected one."""
    if expect is None:
        return []
    if not _HASH.fullmatch(expect):
        raise VerificationError(
            f"--expect {expect!r:.80}: it must be the 64 digits of a run's hash, or its first 8 or"
            " more; `elastocal verify` shows them"
        )
    if found is None:
        text = "it does not state its run (made before files stated it)"
        return [Link("expected run", LinkState.BROKEN, text)]
    if not found.startswith(expect):
        text = f"it is of run {found[:_SHOWN]}, not of the run {expect[:_SHOWN]} that is expected"
        return [Link("expected run", LinkState.BROKEN, text)]
    return [Link("expected run", LinkState.WHOLE, f"it is of run {found[:_SHOWN]}, as expected")]


def _run(
    folder: Path, trusted: str | None, expect: str | None = None, *, alone: bool = False
) -> list[Link]:
    """Return the links of a run, including every damaged part and every contradiction."""
    made = datetime.now(UTC).isoformat(timespec="seconds")
    try:
        evidence = gather_evidence(EvidenceOptions(folder, signer=trusted), made)
    except ElastocalError as error:
        return [Link("run", LinkState.BROKEN, str(error))]
    links = [
        Link(
            each.name,
            LinkState.BROKEN,
            f"the {each.name} {'cannot be used' if each.damaged else 'is missing'}: {each.reason}",
        )
        for each in evidence.missing
        if each.damaged or each.name in _OF_A_RUN
    ]
    links += evidence.chain
    reported = {link.text for link in links}
    links += [
        Link("whole run", LinkState.BROKEN, text)
        for text in evidence.doubts
        if text not in reported
    ]
    record = evidence.run_record
    links += _expected(None if record is None else record.identity, expect)
    if alone and trusted and not any(link.name == "signature" for link in links):
        links.append(Link("signature", LinkState.BROKEN, "there is no run that could be signed"))
    return links
