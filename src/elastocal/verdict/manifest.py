"""The manifest of a report: the hash of its page and of every file that it shows, embedded in it.

A page has three regions: its bytes up to the manifest, the manifest, its bytes from there on. The
first and the last are hashed together, byte by byte, with an empty manifest between them. The
manifest has one form: what is read is written again and must give the same bytes. So every byte
of a page is under a hash, and under its signature where there is one.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from elastocal.errors import ElastocalError, SchemaError
from elastocal.files import Limit, read_bytes, sha256
from elastocal.procedure import file_sha256
from elastocal.records import SEAL, from_data, json_sha256, parse_json, record, sealed_data, to_data
from elastocal.results import brief_repr
from elastocal.verdict.chain import Link, LinkState
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.signing import Signature
from elastocal.wording import counted

if TYPE_CHECKING:
    from elastocal.verdict.judgement import Verdict

_OPENED, _CLOSED = '<script type="application/json" id="manifest">', "</script>"
EMPTY_MANIFEST = f"{_OPENED}{_CLOSED}"
"""The place of the manifest in a page, as the page is hashed."""

_FIRST = "elastocal.manifest/1"
"""The schema of manifests that did not state the hash of their own content."""
_MOST_VALUES = Limit("ELASTOCAL_MAX_MANIFEST_VALUES", 20_000, "values")
"""Values of six thousand files; a report shows some dozens."""


@record()
class ManifestFile:
    """A file that a report shows."""

    name: str
    """Its path relative to the folder around the run."""
    sha256: str
    """Output of ``sha256sum``."""


@brief_repr
@record("elastocal.manifest/2", sealed=True)
class Manifest:
    """Inputs of a report."""

    elastocal: str
    """Version that made it."""
    made: str
    light: str | None
    verdict: str
    """The word beside the light."""
    page_sha256: str
    """Hash of the page with an empty manifest."""
    chain: tuple[Link, ...]
    files: tuple[ManifestFile, ...]
    run: str | None = None
    """Hash of the run that it shows, `elastocal.procedure.RunRecord.identity`."""
    signature: Signature | None = None


@dataclass(frozen=True)
class FoundManifest:
    """The manifest of a page, and the hashes that its page has."""

    manifest: Manifest
    page_sha256: str
    """SHA-256 of all bytes before and behind the manifest, as `Manifest.page_sha256`."""
    signed_sha256: str
    """Hash that a signature must refer to: that of the manifest without the signature."""


def manifest_of(
    page: str, evidence: Evidence, verdict: "Verdict", version: str,
    sign: Callable[[str], Signature] | None = None,
) -> Manifest:  # fmt: skip
    """Return the manifest of a page.

    Parameters
    ----------
    page : str
        The page with an empty manifest.
    evidence : Evidence
        All parts.
    verdict : Verdict
        What the page says of them.
    version : str
        Version of elastocal.
    sign : callable, optional
        Returns the signature of a hash; by default the report is not signed.
    """
    light = None if verdict.light is None else verdict.light.value
    files = tuple(ManifestFile(each.name, each.bytes_sha256) for each in evidence.files)
    run = None if evidence.run_record is None else evidence.run_record.identity
    made = Manifest(
        version, evidence.made, light, verdict.word, sha256(page), evidence.chain, files, run
    )
    return made if sign is None else replace(made, signature=sign(_signed_sha256(to_data(made))))


def _signed_sha256(data: dict[str, object]) -> str:
    return json_sha256(data | {"signature": None})


def embed_manifest(page: str, manifest: Manifest) -> str:
    """Return a page with its manifest in the place of the empty one."""
    return page.replace(EMPTY_MANIFEST, f"{_OPENED}{_text(sealed_data(manifest))}{_CLOSED}", 1)


def _text(data: dict[str, object]) -> str:
    """Return the one form of a manifest; no parser of HTML may take a name in it for markup."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def read_manifest(path: Path) -> FoundManifest:
    """Return the manifest of a report, and the hashes that its page has now.

    Raises
    ------
    SchemaError
        If the page has none, or several, or what it has is not, byte by byte, what is written
        into pages.
    FileAccessError
        If it cannot be read.
    """
    page = read_bytes(path)
    opened, closed, empty = (each.encode() for each in (_OPENED, _CLOSED, EMPTY_MANIFEST))
    start = page.find(opened)
    end = page.find(closed, start)
    if start < 0 or end < 0 or page.find(opened, start + 1) >= 0:
        raise SchemaError(
            f"{path} has no manifest: it is no report of elastocal, or made before reports had one"
        )
    what, text = f"{path}: manifest", page[start + len(opened) : end]
    data = parse_json(text, what, most=_MOST_VALUES)
    old = isinstance(data, dict) and data.get("schema") == _FIRST
    found = from_data(Manifest, data, what, _FIRST if old else "")
    written = sealed_data(found)
    if old:
        left_out = ("run", SEAL)
        written = {k: v for k, v in written.items() if k not in left_out} | {"schema": _FIRST}
    if _text(written).encode() != text:
        raise SchemaError(f"{what} was changed after it was written: elastocal writes it otherwise")
    digest = hashlib.sha256(memoryview(page)[:start])
    digest.update(empty)
    digest.update(memoryview(page)[end + len(closed) :])
    return FoundManifest(found, digest.hexdigest(), _signed_sha256(written))


def file_links(manifest: Manifest, folders: tuple[Path, ...]) -> tuple[Link, ...]:
    """Return the files of a manifest, checked against those in folders.

    Missing files do not count against the report: it may be alone, or show a file from elsewhere.
    """
    places = [_find(each.name, folders) for each in manifest.files]
    count = counted(len(places), "file")
    if not any(places):
        text = f"none of {count} that the report shows lies beside it: name their folder with --run"
        return (Link("files", LinkState.UNSTATED, text),)
    wrong, absent = [], []
    for file, place in zip(manifest.files, places, strict=True):
        if place is None:
            absent.append(file.name)
            continue
        try:
            same = file_sha256(place) == file.sha256
        except ElastocalError:
            same = False
        if not same:
            wrong.append(f"{file.name} is not the one that the report shows: its SHA-256 differs")
    if wrong:
        return tuple(Link("files", LinkState.BROKEN, text) for text in wrong)
    if absent:
        text = f"of {count} that the report shows, {', '.join(absent)} not found; the others match"
        return (Link("files", LinkState.UNSTATED, text),)
    return (Link("files", LinkState.WHOLE, f"{count}: those that the report shows"),)


def _find(name: str, folders: tuple[Path, ...]) -> Path | None:
    """Return the path of a file of a manifest; None for a name that leads out of its folder."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        return None
    return next((folder / path for folder in folders if (folder / path).is_file()), None)
