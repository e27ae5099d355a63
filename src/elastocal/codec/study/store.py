"""Folder of a study: settings first, then finished samples in parts, each written whole or not.

A part is named after its samples. Its contents depend on nothing else but the settings, so a part
that two processes write is the same; a study that is killed goes on with what is missing. A part
carries a digest over the settings and its samples: one of another study, or one that was edited,
is refused.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import FiniteFloat

from elastocal.codec.study.samples import Accuracy, Outcome, SampleResult
from elastocal.codec.study.settings import SETTINGS_SCHEMA, StudySettings, check_same
from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import sha256, write_text
from elastocal.records import StrictModel, read_json

SETTINGS = "settings.json"
"""Name of the file by which a study's folder is known."""
PARTS = "samples"
"""Name of the folder with finished samples."""
PART_SCHEMA = "elastocal.study_samples/1"


class OutcomeRecord(StrictModel):
    """`Outcome` as it stands in files; floating point as text is exact in Python's JSON."""

    error_mean: FiniteFloat
    error_max: FiniteFloat
    deflection_mean: FiniteFloat
    compliance: tuple[FiniteFloat, ...]


class SampleRecord(StrictModel):
    """`SampleResult` as it stands in files."""

    number: int
    outcomes: tuple[OutcomeRecord, ...]


class Part(StrictModel):
    """Some finished samples."""

    digest: str
    """SHA-256 over the settings of the study and these samples."""
    samples: tuple[SampleRecord, ...]


class StudyStore:
    """The folder of a study; see the module."""

    def __init__(self, folder: Path) -> None:
        """Look at a folder; nothing is read or made yet."""
        self.folder = Path(folder)

    def open(self, settings: StudySettings) -> None:
        """Begin a study in an empty folder, or find the same one there.

        Raises
        ------
        CodecError
            If the folder holds another study.
        FileAccessError
            If it holds something else, or cannot be written.
        """
        path = self.folder / SETTINGS
        if path.exists():
            check_same(read_settings(path), settings, str(self.folder))
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            others = sorted(entry.name for entry in self.folder.iterdir())
            # A kill may come between this and the settings.
            if others and others != [PARTS]:
                raise FileAccessError(
                    f"{self.folder} holds {others[0]} and no study: name another folder"
                )
            (self.folder / PARTS).mkdir(exist_ok=True)
        except FileAccessError:
            raise
        except OSError as error:
            raise FileAccessError(f"cannot write {self.folder}: {error.strerror}") from error
        write_text(path, _text(SETTINGS_SCHEMA, settings))

    def keep(self, settings: StudySettings, results: Sequence[SampleResult]) -> None:
        """Write finished samples of a study; they are on the disk when this returns.

        Raises
        ------
        FileAccessError
            If they cannot be written.
        """
        records = tuple(_record(result) for result in results)
        part = Part(digest=_digest(settings, records), samples=records)
        name = "-".join(f"{number:06d}" for number in (records[0].number, records[-1].number))
        write_text(self.folder / PARTS / f"{name}.json", _text(PART_SCHEMA, part))

    def finished(self, settings: StudySettings) -> dict[int, SampleResult]:
        """Return the finished samples by number, rising.

        Raises
        ------
        SchemaError
            If a part is damaged, was edited, or is one of another study.
        """
        found: dict[int, SampleResult] = {}
        for path in sorted((self.folder / PARTS).glob("*.json")):
            for result in read_part(path, settings):
                found[result.number] = result
        return dict(sorted(found.items()))


def read_settings(path: Path) -> StudySettings:
    """Return the settings of a study.

    Raises
    ------
    SchemaError, FileAccessError
        If the file holds none.
    """
    settings = read_json(path, StudySettings, SETTINGS_SCHEMA)
    missing = {each.springs for each in settings.conditions} - set(settings.springs)
    if missing or not settings.conditions:
        raise SchemaError(f"{path}: springs of {', '.join(sorted(missing)) or 'any'} are missing")
    return settings


def read_part(path: Path, settings: StudySettings) -> tuple[SampleResult, ...]:
    """Return some finished samples of a study from their file.

    Raises
    ------
    SchemaError
        If the file holds none, was edited, or belongs to a study with other settings.
    FileAccessError
        If it cannot be read.
    """
    part = read_json(path, Part, PART_SCHEMA)
    if part.digest != _digest(settings, part.samples):
        raise SchemaError(
            f"{path} was edited, or belongs to a study with other settings: delete it to have its"
            " samples simulated again"
        )
    return tuple(_result(record) for record in part.samples)


def _digest(settings: StudySettings, samples: Sequence[SampleRecord]) -> str:
    contents = [settings.model_dump(mode="json"), [s.model_dump(mode="json") for s in samples]]
    return sha256(json.dumps(contents, sort_keys=True, allow_nan=False))


def _text(schema: str, model: StrictModel) -> str:
    return json.dumps(model.stated(schema), allow_nan=False) + "\n"


def _record(result: SampleResult) -> SampleRecord:
    outcomes = tuple(
        OutcomeRecord(
            error_mean=each.accuracy.error_mean,
            error_max=each.accuracy.error_max,
            deflection_mean=each.accuracy.deflection_mean,
            compliance=tuple(each.compliance.tolist()),
        )
        for each in result.outcomes
    )
    return SampleRecord(number=result.number, outcomes=outcomes)


def _result(record: SampleRecord) -> SampleResult:
    outcomes = tuple(
        Outcome(
            Accuracy(each.error_mean, each.error_max, each.deflection_mean),
            np.array(each.compliance),
        )
        for each in record.outcomes
    )
    return SampleResult(record.number, outcomes)
