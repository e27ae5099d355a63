"""Folder of a study: its design first, then finished samples in parts, each written whole or not.

A part is named after its samples. Its contents depend on nothing else but the design, so a part
that two processes write is the same; a study that is killed goes on with what is missing. A part
carries a digest over the design and its samples: one of another study, or one that was edited,
is refused.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from elastocal.codec.study.conditions import FACTORS, Condition, condition_name
from elastocal.codec.study.samples import SampleResult
from elastocal.errors import CodecError, FileAccessError, SchemaError
from elastocal.files import sha256, write_text
from elastocal.records import read_json, record, to_data
from elastocal.results import brief_repr

DESIGN = "settings.json"
"""Name of the file by which a study's folder is known."""
DESIGN_SCHEMA = "elastocal.study_settings/1"
PARTS = "samples"
"""Name of the folder with finished samples."""
PART_SCHEMA = "elastocal.study_samples/1"
_LONGEST = 60
"""Letters of a setting that a refusal still quotes whole; fingerprints are longer."""


@record()
class SpringLabel:
    """A spring of a layout."""

    name: str
    unit: str
    """Unit of its compliance."""


@brief_repr
@record(DESIGN_SCHEMA)
class StudyDesign:
    """All that the numbers of a study depend on, but for the number of samples.

    Two stretches of a study belong together only when this is the same.
    """

    cell: str
    """Name of the cell."""
    cell_fingerprint: str
    """Over the cell file and the files that it names (`elastocal.cell.fingerprint`)."""
    simulation_fingerprint: str
    """Over what is simulated in the cell."""
    seed: int
    pool: int
    """Candidates that calibration poses are chosen from."""
    verification: int
    """Verification poses."""
    load_cases: tuple[str, ...]
    """Those of the cell; verification takes all of them."""
    conditions: tuple[Condition, ...]
    springs: dict[str, tuple[SpringLabel, ...]]
    """By layout, in the order of the compliances."""
    versions: dict[str, str]
    """Versions of the packages that make the numbers."""

    @property
    def varied(self) -> tuple[str, ...]:
        """Factors with more than one value."""
        return tuple(
            key for key in FACTORS if len({each.value(key) for each in self.conditions}) > 1
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each condition: the values of the factors that are varied."""
        return tuple(condition_name(self.varied, each) for each in self.conditions)


@record(PART_SCHEMA, eq=False)
class _Part:
    """Some finished samples."""

    digest: str
    """SHA-256 over the design of the study and these samples."""
    samples: tuple[SampleResult, ...]


class StudyStore:
    """The folder of a study; see the module."""

    def __init__(self, folder: Path) -> None:
        """Look at a folder; nothing is read or made yet."""
        self.folder = Path(folder)

    def open(self, design: StudyDesign) -> None:
        """Begin a study in an empty folder, or find the same one there.

        Raises
        ------
        CodecError
            If the folder holds another study.
        FileAccessError
            If it holds something else, or cannot be written.
        """
        path = self.folder / DESIGN
        if path.exists():
            _check_same(read_design(path), design, str(self.folder))
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            others = sorted(entry.name for entry in self.folder.iterdir())
            # A kill may come between this and the design.
            if others and others != [PARTS]:
                raise FileAccessError(
                    f"{self.folder} holds {others[0]} and no study: name another folder"
                )
            (self.folder / PARTS).mkdir(exist_ok=True)
        except FileAccessError:
            raise
        except OSError as error:
            raise FileAccessError(f"cannot write {self.folder}: {error.strerror}") from error
        write_text(path, _on_one_line(design))

    def keep(self, design: StudyDesign, results: Sequence[SampleResult]) -> None:
        """Write finished samples of a study; they are on the disk when this returns.

        Raises
        ------
        FileAccessError
            If they cannot be written.
        """
        part = _Part(_digest(design, results), tuple(results))
        name = "-".join(f"{number:06d}" for number in (results[0].number, results[-1].number))
        write_text(self.folder / PARTS / f"{name}.json", _on_one_line(part))

    def finished(self, design: StudyDesign) -> dict[int, SampleResult]:
        """Return the finished samples by number, rising.

        Raises
        ------
        SchemaError
            If a part is damaged, was edited, or is one of another study.
        """
        found: dict[int, SampleResult] = {}
        for path in sorted((self.folder / PARTS).glob("*.json")):
            for result in read_part(path, design):
                found[result.number] = result
        return dict(sorted(found.items()))


def read_design(path: Path) -> StudyDesign:
    """Return the design of a study.

    Raises
    ------
    SchemaError, FileAccessError
        If the file holds none.
    """
    design = read_json(path, StudyDesign)
    missing = {each.springs for each in design.conditions} - set(design.springs)
    if missing or not design.conditions:
        raise SchemaError(f"{path}: springs of {', '.join(sorted(missing)) or 'any'} are missing")
    return design


def read_part(path: Path, design: StudyDesign) -> tuple[SampleResult, ...]:
    """Return some finished samples of a study from their file.

    Raises
    ------
    SchemaError
        If the file holds none, was edited, or belongs to a study with other settings.
    FileAccessError
        If it cannot be read.
    """
    part = read_json(path, _Part)
    if part.digest != _digest(design, part.samples):
        raise SchemaError(
            f"{path} was edited, or belongs to a study with other settings: delete it to have its"
            " samples simulated again"
        )
    return part.samples


def _check_same(found: StudyDesign, wanted: StudyDesign, where: str) -> None:
    """Refuse to go on with another study, with the first setting that differs."""
    before, now = to_data(found), to_data(wanted)
    for key in before:
        if before[key] != now[key]:
            raise CodecError(
                f"{where} holds another study ({key.replace('_', ' ')}: {_short(before[key])}, not"
                f" {_short(now[key])}): name another folder"
            )


def _short(value: object) -> str:
    """Return a setting in so few letters that the difference is in sight."""
    if isinstance(value, list):
        return "; ".join(_short(each) for each in value)
    if isinstance(value, dict):
        return " ".join(str(each) for each in value.values())
    text = str(value)
    return text if len(text) < _LONGEST else f"{text[:12]}…"


def _digest(design: StudyDesign, samples: Sequence[SampleResult]) -> str:
    stated = to_data(design)
    del stated["schema"]
    return sha256(json.dumps([stated, to_data(samples)], sort_keys=True, allow_nan=False))


def _on_one_line(value: Any) -> str:
    return json.dumps(to_data(value), allow_nan=False) + "\n"
