"""The run of a journal, and the earlier runs of its cell.

The file `HISTORY` is beside the folders of runs; each run adds a line to it when it begins. A run
copies the earlier lines into its own record, so that its signature covers them. This reveals a run
that is wrongly presented as the newest, and one that was repeated.
"""

import contextlib
import os
from pathlib import Path
from typing import Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from elastocal.errors import ElastocalError
from elastocal.files import read_text
from elastocal.records import StrictModel, from_data, json_sha256, parse_json

JOURNAL_SCHEMA = "elastocal.journal/1"
Warmth = Literal["cold", "warm"]
"""Stated warmth of an arm when it touches the tooling."""
HISTORY = "runs.jsonl"
"""Name of the history, in the folder in which the folders of runs are."""


class EarlierRun(StrictModel):
    """A run of the same cell that began before another."""

    run: str
    """Its hash, `RunRecord.identity`."""
    started: str
    """Date and time of day, ISO 8601, UTC."""
    same_plan: bool
    """Whether it was made with the same plan."""
    light: str | None = None
    """Light of a report on it that lay beside it; None: there was none."""


class RunRecord(StrictModel):
    """Identity of the run of a journal."""

    schema_name: str = JOURNAL_SCHEMA
    elastocal: str
    """Version that started it."""
    plan: str
    """SHA-256 of ``plan.json``."""
    cell: str
    """Fingerprint of the cell."""
    cell_file: str
    """Path of the cell file in the run's folder ``cell``."""
    seed: int
    """Seed of simulated devices."""
    started: str
    """Date and time of day, ISO 8601, UTC."""
    cell_sha256: str | None = None
    """SHA-256 of the cell file: the fingerprint leaves out by what a result is judged. None in
    journals before it was written."""
    signer: str | None = None
    """Public key of the signer; None: not signed."""
    stated: dict[str, str] = Field(default_factory=dict)
    """Statements for the certificate at the beginning of the run, by key: operator, place, serial
    numbers."""

    files_sha256: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of every file that was copied into the run's folder, by its path there; empty in
    journals before it was written."""
    run_number: int | None = None
    """Ordinal number of this run among those of its cell, by the history beside it; None in older
    journals."""
    earlier_runs: tuple[EarlierRun, ...] = ()
    """The runs of its cell before it, the last at the end."""
    touch: Warmth | None = None
    """Stated warmth of the arm in a run of touches; None: a run of load cases."""

    @property
    def identity(self) -> str:
        """The hash by which the run is known: of all that was stated when it began."""
        return json_sha256(self.model_dump(mode="json", exclude_defaults=True))

    @property
    def origin(self) -> str:
        """Provenance that a dataset states."""
        return (
            f"started {self.started} with elastocal {self.elastocal}, plan {self.plan[:12]}, cell"
            f" {self.cell[:12]}, seed {self.seed}"
        )

    @model_serializer(mode="wrap")
    def _schema_first(self, rest: SerializerFunctionWrapHandler) -> dict[str, object]:
        # An entry leaves out default values, but must state the schema.
        return {"schema_name": self.schema_name, **rest(self)}


class HistoryEntry(StrictModel):
    """A line of a history."""

    run: str
    cell: str
    """Name of the cell."""
    plan: str
    """SHA-256 of ``plan.json``."""
    started: str


def read_history(folder: Path, cell: str) -> tuple[HistoryEntry, ...]:
    """Return the runs of a cell by the history in a folder, in the order in which they began.

    Foreign lines are left out; without a history, there are no runs.
    """
    path, found = folder / HISTORY, []
    if not path.is_file():
        return ()
    with contextlib.suppress(ElastocalError):
        for line in read_text(path).splitlines():
            with contextlib.suppress(ElastocalError):
                found.append(from_data(HistoryEntry, parse_json(line, str(path)), str(path)))
    return tuple(each for each in found if each.cell == cell)


def note_run(folder: Path, cell: str, record: RunRecord) -> None:
    """Add a run to the history in a folder; without effect where nothing can be written."""
    entry = HistoryEntry(run=record.identity, cell=cell, plan=record.plan, started=record.started)
    with contextlib.suppress(OSError), (folder / HISTORY).open("ab") as file:
        file.write(entry.model_dump_json().encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())
