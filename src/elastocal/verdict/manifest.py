"""The manifest of a report: the hash of its page and of every file that it shows, embedded in it.

The page is hashed as it stands, with an empty manifest, so that a report can be verified alone.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path, PurePosixPath

from elastocal.errors import ElastocalError, FileAccessError, SchemaError
from elastocal.files import read_bytes, sha256
from elastocal.procedure import file_sha256
from elastocal.records import from_data, json_sha256, record, to_data
from elastocal.results import brief_repr
from elastocal.verdict.chain import Link, LinkState
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.judgement import Verdict
from elastocal.verdict.signing import Signature
from elastocal.wording import counted

_OPENED, _CLOSED = '<script type="application/json" id="manifest">', "</script>"
EMPTY_MANIFEST = f"{_OPENED}{_CLOSED}"
"""The place of the manifest in a page, as the page is hashed."""


@record()
class ManifestFile:
    """A file that a report shows."""

    name: str
    """Its path relative to the folder around the run."""
    sha256: str
    """What ``sha256sum`` gives."""


@brief_repr
@record("elastocal.manifest/1")
class Manifest:
    """What a report was made of."""

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
    signature: Signature | None = None

    @property
    def sha256(self) -> str:
        """The hash that is signed: of all but the signature."""
        return json_sha256(to_data(replace(self, signature=None)))


def manifest_of(
    page: str, evidence: Evidence, verdict: Verdict, version: str,
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
        Of elastocal.
    sign : callable, optional
        Returns the signature of a hash; by default the report is not signed.
    """
    light = None if verdict.light is None else verdict.light.value
    files = tuple(ManifestFile(each.name, each.bytes_sha256) for each in evidence.files)
    made = Manifest(
        version, evidence.made, light, verdict.word, sha256(page), evidence.chain, files
    )
    return made if sign is None else replace(made, signature=sign(made.sha256))


def embed_manifest(page: str, manifest: Manifest) -> str:
    """Return a page with its manifest in the place of the empty one."""
    text = json.dumps(to_data(manifest), separators=(",", ":"))
    # No HTML parser may take a name for markup.
    safe = text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return page.replace(EMPTY_MANIFEST, f"{_OPENED}{safe}{_CLOSED}", 1)


def _text(path: Path) -> str:
    """Return the text of a page, every end of a line as it is."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FileAccessError(f"cannot read {path}: not a UTF-8 text file") from error


def read_manifest(path: Path) -> tuple[Manifest, str]:
    """Return the manifest of a report, and the hash that its page has now.

    Raises
    ------
    SchemaError
        If the page has none, or several, or what it has is none.
    FileAccessError
        If it cannot be read.
    """
    page = _text(path)
    before, opened, rest = page.partition(_OPENED)
    text, closed, after = rest.partition(_CLOSED)
    if not (opened and closed) or _OPENED in rest:
        raise SchemaError(
            f"{path} has no manifest: it is no report of elastocal, or made before reports had one"
        )
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SchemaError(f"{path}: its manifest is not valid JSON") from error
    found = from_data(Manifest, data, f"{path}: manifest")
    emptied = f"{before}{EMPTY_MANIFEST}{after}"
    return found, sha256(emptied)


def file_links(manifest: Manifest, folders: tuple[Path, ...]) -> tuple[Link, ...]:
    """Return the files of a manifest held against those that lie in folders.

    What is not there is not held against the report: it may stand alone, or show a file that lay
    elsewhere.
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
    """Return where a file of a manifest lies; a name that leads out of its folder is nowhere."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        return None
    return next((folder / path for folder in folders if (folder / path).is_file()), None)
