"""Hashes of files that stay the same from one run to the next with the same seed.

A file that holds no time of day is hashed as it is: ``sha256sum`` gives the same. The others
carry the time at which the run began, the folder it was started from, or hashes of files that
do. Of those, the hash is taken of what they say beside that: of their JSON, keys sorted, or of
their arrays, without the fields of `_LEFT_OUT`.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.errors import ElastocalError
from elastocal.files import read_text
from elastocal.procedure import file_sha256
from elastocal.records import read_arrays

BYTES, CONTENT = "bytes", "content without times and folders"
_LEFT_OUT = (
    "provenance", "started", "source", "sha256", "file", "findings", "model", "model_sha256",
    "tool", "tool_sha256", "plan", "streams_sha256",
)  # fmt: skip
"""Keys and attributes that tell when and where, or are hashes of what does."""
_STAMPED = (".json", ".jsonl", ".nc")


def content_hash(path: Path) -> tuple[str, str]:
    """Return the hash of a file and what it was taken of, `BYTES` or `CONTENT`.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    if path.suffix in _STAMPED:
        try:
            return _content(path), CONTENT
        except (ElastocalError, ValueError):
            # What is damaged has no content to speak of.
            return file_sha256(path), BYTES
    return file_sha256(path), BYTES


def _content(path: Path) -> str:
    if path.suffix == ".nc":
        return _arrays(path)
    text = read_text(path)
    documents = text.splitlines() if path.suffix == ".jsonl" else [text]
    digest = hashlib.sha256()
    for document in documents:
        kept = json.dumps(_kept(json.loads(document)), sort_keys=True, separators=(",", ":"))
        digest.update(kept.encode("utf-8") + b"\n")
    return digest.hexdigest()


def _kept(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _kept(each) for key, each in value.items() if not _left_out(key, each)}
    return [_kept(each) for each in value] if isinstance(value, list) else value


def _left_out(key: str, value: Any) -> bool:
    # A section of that name, such as the tool in the summary of a run, says more than where.
    return key in _LEFT_OUT and not isinstance(value, dict)


def _arrays(path: Path) -> str:
    data = read_arrays(path)
    digest = hashlib.sha256()
    for name in sorted(data.variables):
        values = np.ascontiguousarray(data[name].values)
        shape = f"{name} {data[name].dims} {values.shape}"
        listed = json.dumps(values.tolist()) if values.dtype.kind in "OU" else ""
        digest.update(shape.encode() + (listed.encode() if listed else values.tobytes()))
    attributes = {k: str(v) for k, v in data.attributes.items() if k not in _LEFT_OUT}
    digest.update(json.dumps(attributes, sort_keys=True).encode())
    return digest.hexdigest()
