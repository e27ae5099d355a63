"""Folders of a run, the hashes of their files, and a reader that notes which of them were used.

A file that holds no time of day is hashed as it is: ``sha256sum`` gives the same. The others
carry the time at which the run began, the folder it was started from, or hashes of files that
do. Of those, the hash is taken of what they say beside that, so that equal runs have equal
hashes: of their JSON, keys sorted, or of their arrays, without the fields of `_LEFT_OUT`.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from elastocal.codec import ARRAYS, VERDICTS
from elastocal.compensation.process import DEVIATIONS, TABLE
from elastocal.dataset import MADE_FROM
from elastocal.errors import ElastocalError, FileAccessError
from elastocal.files import read_text
from elastocal.procedure import JOURNAL, RunFolder, file_sha256
from elastocal.records import (
    SEAL,
    arrays_sha256,
    json_sha256,
    parse_json,
    read_arrays,
)
from elastocal.verdict.evidence import MissingPart, Seal, UsedFile
from elastocal.wording import Phrase, phrase, phrases

BYTES, CONTENT = phrases("bytes", "content without times and folders")
_LEFT_OUT = (
    "provenance", "started", "source", "sha256", "file", "findings", "model", "model_sha256",
    "tool", "tool_sha256", "plan", "streams_sha256", "line_check", "dataset_sha256", SEAL,
)  # fmt: skip
"""Keys and attributes for time, place, or hashes of them."""
_WHOLE_LEFT_OUT = (MADE_FROM, "files_sha256", "run_number", "earlier_runs")
_STAMPED = (".json", ".jsonl", ".nc")
_SEALED = (
    "elastocal.model", "elastocal.tool", "elastocal.process", "elastocal.codec_verdicts",
    "elastocal.codec",
)  # fmt: skip
"""Schemas of files that state the hash of their own content."""


def read_hash(path: Path) -> tuple[str, str, Seal]:
    """Return the hash of a file, what it was taken of, and what its own seal says.

    Returns
    -------
    sha256 : str
        Hash.
    of : str
        `BYTES` or `CONTENT`.
    seal : Seal
        Whether the file says what it said when it was written, by the hash that it states.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    if path.suffix not in _STAMPED:
        return file_sha256(path), BYTES, Seal.NONE
    try:
        content, seal = _of_arrays(path) if path.suffix == ".nc" else _of_json(path)
        return content, CONTENT, seal
    except (ElastocalError, ValueError, RecursionError):
        # Damaged files have no content to compare.
        states = path.name == ARRAYS or path.suffix == ".json"
        return file_sha256(path), BYTES, Seal.BROKEN if states else Seal.NONE


def _of_arrays(path: Path) -> tuple[str, Seal]:
    arrays = read_arrays(path)
    content = arrays_sha256(arrays, (*_LEFT_OUT, MADE_FROM))
    if path.name != ARRAYS:
        return content, Seal.NONE
    return content, _seal(arrays.attributes, lambda: arrays_sha256(arrays))


def _of_json(path: Path) -> tuple[str, Seal]:
    whole = read_text(path)
    documents = whole.splitlines() if path.suffix == ".jsonl" else [whole]
    digest, seal = hashlib.sha256(), Seal.NONE
    for document in documents:
        data = parse_json(document, str(path))
        text = json.dumps(_kept(data), sort_keys=True, separators=(",", ":"))
        digest.update(text.encode("utf-8") + b"\n")
        if path.suffix == ".json" and isinstance(data, dict):
            seal = _seal(data, partial(json_sha256, data))
    return digest.hexdigest(), seal


def _seal(states: Mapping[str, Any], content: Callable[[], str]) -> Seal:
    if str(states.get("schema")).partition("/")[0] not in _SEALED:
        return Seal.NONE
    stated = states.get(SEAL)
    if stated is None:
        return Seal.ABSENT
    return Seal.WHOLE if stated == content() else Seal.BROKEN


def _kept(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _kept(each) for key, each in value.items() if not _left_out(key, each)}
    return [_kept(each) for each in value] if isinstance(value, list) else value


def _left_out(key: str, value: Any) -> bool:
    # A section of that name, such as the tool in the summary of a run, says more than where.
    return key in _WHOLE_LEFT_OUT or (key in _LEFT_OUT and not isinstance(value, dict))


MODEL, TOOL, CODEC, PROCESS = "model.json", "tool.json", "codec", "process"
"""Default names of files outside the run's own folder."""
_RUN = "run"
"""Name of a run's folder in the folder that holds everything."""
Part = TypeVar("Part")


@dataclass(frozen=True)
class EvidenceFolders:
    """Folders in which the parts of the evidence lie."""

    run: RunFolder | None
    """None if there is only a model."""
    roots: tuple[Path, ...]
    """Folders in which default names are looked for, in order."""
    model: Path | None = None
    """A model that was named in place of a run."""

    def default(self, name: str) -> Path | None:
        """Return the path of a default name, or None."""
        return next((root / name for root in self.roots if (root / name).exists()), None)

    def shown(self, path: Path) -> str:
        """Return a path as the report shows it: independent of the folder's location."""
        whole = path.resolve()
        for root in sorted({each.resolve() for each in self.roots}, key=lambda p: len(p.parts)):
            if whole.is_relative_to(root):
                return whole.relative_to(root).as_posix()
        return path.name


@dataclass
class PartReader:
    """Reads part by part; notes the hashes of what was used, and what could not be."""

    folders: EvidenceFolders
    files: list[UsedFile] = field(default_factory=list)
    missing: list[MissingPart] = field(default_factory=list)

    def read(
        self, name: str, path: Path, read: Callable[[], Part], named: bool = False
    ) -> Part | None:
        """Return a part, or None and a note with the reason."""
        try:
            part = read()
        except ElastocalError as error:
            if named:
                raise
            self.note_missing(name, self.without_folders(error), damaged=True)
            return None
        self.use(path)
        return part

    def find(
        self, name: str, given: Path | None, default: str, read: Callable[[Path], Part], hint: str,
        *, optional: bool = False,
    ) -> Part | None:  # fmt: skip
        """Return a part that may be named or lie under a default name.

        One that is ``optional`` is not missed where it is not there: most runs have none.
        """
        path = given or self.folders.default(default)
        if path is None:
            if not optional:
                self.note_missing(name, self.no_file(default, hint))
            return None
        return self.read(name, path, lambda: read(path), named=given is not None)

    @staticmethod
    def no_file(file: str, hint: str) -> Phrase:
        """Return why a part is missing whose file is not there, and what makes it."""
        return phrase("there is no {file}; {hint}", file=file, hint=hint)

    def note_missing(self, name: str, reason: str, damaged: bool = False) -> None:
        """Note that the report does without a part."""
        self.missing.append(MissingPart(name, reason, damaged))

    def use(self, path: Path) -> None:
        """Note the hash of a file, or of every file in a folder that belongs to a part."""
        for file in sorted(_files_of(path)):
            shown = self.folders.shown(file)
            if shown not in {each.name for each in self.files}:
                content, of, seal = read_hash(file)
                self.files.append(UsedFile(shown, content, of, file_sha256(file), seal))

    def without_folders(self, error: ElastocalError) -> str:
        """Return a reason without the folder that the run happens to lie in."""
        text = " ".join(str(error).split())
        for root in self.folders.roots:
            for form in {str(root), str(root.resolve())} - {"."}:
                text = text.replace(f"{form}/", "")
        return text


def find_folders(run: Path) -> EvidenceFolders:
    """Return the folders of the files of a run.

    Parameters
    ----------
    run : Path
        A run folder, a folder that holds one called ``run``, or a single one of another name, a
        folder with other parts but no run, or a model file.

    Raises
    ------
    FileAccessError
        If it is none of these.
    """
    if run.is_file():
        return EvidenceFolders(None, (run.parent,), run)
    if not run.is_dir():
        raise FileAccessError(f"cannot read {run}: there is no such file or folder")
    if (run / JOURNAL).exists():
        return EvidenceFolders(RunFolder(run), (run, run.resolve().parent))
    named = (run / _RUN / JOURNAL).exists()
    inside = [run / _RUN] if named else [each.parent for each in run.glob(f"*/{JOURNAL}")]
    if len(inside) == 1:
        return EvidenceFolders(RunFolder(inside[0]), (inside[0], run))
    if any((run / name).exists() for name in (MODEL, CODEC, PROCESS)):
        return EvidenceFolders(None, (run,))
    raise FileAccessError(
        f"{run} is no folder of a run: it holds neither {JOURNAL}, {_RUN}/{JOURNAL} nor {MODEL}"
    )


def run_files(run: RunFolder) -> Iterator[Path]:
    """Yield the files of a run's own that a report is made from, if they are there."""
    cell = sorted(path for path in run.cell.rglob("*") if path.is_file())
    plan = sorted(path for path in run.plan.glob("*") if path.is_file())
    for path in (*cell, *plan, run.journal, run.dataset, run.summary):
        if path.is_file():
            yield path


def _files_of(path: Path) -> list[Path]:
    """Return a file, or the files of a folder that a report reads, without pictures."""
    if path.is_file():
        return [path]
    read = (ARRAYS, VERDICTS, TABLE, DEVIATIONS)
    return [path / name for name in read if (path / name).is_file()]
