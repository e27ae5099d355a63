"""Figures that take long to measure: kept in a file, a line each, and quoted by the build."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from elastocal.records import from_data, to_data

T = TypeVar("T")


def read_kept(path: Path, kind: type[T]) -> list[T]:
    """Return the records of a kind that a file keeps; none before there is one."""
    data = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    return [from_data(kind, each, path.name) for each in data]


def write_kept(path: Path, records: Sequence[Any]) -> None:
    """Write records down, a line each."""
    lines = ",\n".join(json.dumps(to_data(each)) for each in records)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def rounded(length: float) -> float:
    """Return a length in m to 10 nm: what is quoted is small, and alike on all machines."""
    return round(length, 8)
