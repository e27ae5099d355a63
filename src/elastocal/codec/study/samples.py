"""Samples of a study, arms calibrated under every condition, and the folder that keeps them.

This module does the estimator's part of a sample: it fits, then predicts at poses that were not
measured.

The folder holds the design of the study first, then finished samples in parts, each written whole
or not. A part is named after its samples. Its contents depend on the design alone, so a part that
two processes write is the same; a study that was killed continues with the missing parts. A part
carries a digest over the design and its samples: a part of another study, or an edited one, is
refused.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.codec.study.conditions import FACTORS, Condition, condition_name
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import CodecError, FileAccessError, SchemaError
from elastocal.files import sha256, write_text
from elastocal.identification import FitOptions, build, solve, with_sag_open
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


class Purpose(IntEnum):
    """A purpose that a sample draws for; each has a generator of its own."""

    TRUTH = 0
    """The true arm."""
    ERRORS = 1
    """Errors of the instruments."""
    CHOICE = 2
    """Techniques that choose by chance."""


@dataclass(frozen=True)
class Sample:
    """One of the arms to be simulated."""

    seed: int
    """Seed of the study."""
    number: int
    """Number of the sample, from 0."""

    def generator(self, purpose: Purpose) -> Generator:
        """Return the generator of a purpose.

        It depends on nothing but seed, number and purpose: any order, any number of processes
        and any cluster draw the same.
        """
        key = (self.number, int(purpose))
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))


@brief_repr
@record(eq=False)
class ConditionResult:
    """A calibration under one condition, and how accurate it is at poses that it has not seen.

    Errors are in m, over the verification poses and all load cases of the cell.
    """

    error_mean: float
    """Mean norm of predicted minus true deflection."""
    error_max: float
    """Largest norm."""
    deflection_mean: float
    """Mean norm of the true deflection: the error without any calibration."""
    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""


@brief_repr
@record(eq=False)
class SampleResult:
    """A finished sample."""

    number: int
    outcomes: tuple[ConditionResult, ...]
    """Outcomes in the order of the conditions."""


Simulate = Callable[[Sample], SampleResult]
"""Simulates one sample. It is sent to other processes, so it can be pickled, and it is a pure
function: the same sample gives the same result bit for bit."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Verification:
    """True deflections without any noise, at poses that no calibration has seen."""

    q: FloatArray
    """Joints under load, shape (reading, joint), in rad or m."""
    force: FloatArray
    """True force on the robot in base, shape (reading, 3), in N."""
    deflection: FloatArray
    """True deflection of the tool in base, shape (reading, 3), in m."""

    def judge(self, model: ElasticModel, compliance: FloatArray) -> ConditionResult:
        """Return the accuracy of a calibrated model on the deflections."""
        predicted = model.deflection(compliance, self.q, self.force)
        error = np.linalg.norm(predicted - self.deflection, axis=1)
        size = np.linalg.norm(self.deflection, axis=1)
        return ConditionResult(
            float(error.mean()), float(error.max()), float(size.mean()), compliance
        )


def calibrated(
    model: ElasticModel,
    readings: Readings,
    marker_offset: ArrayLike,
    verification: Verification,
    options: FitOptions | None = None,
) -> ConditionResult:
    """Return compliances and accuracy of a calibration (Eq. 15-19).

    Simulated instruments make no blunders, so none are looked for; otherwise the compliances are
    those of `elastocal.identification.calibrate`. Nothing is resampled: the samples of a study
    show the spread.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Readings of the calibration poses.
    marker_offset : array_like, shape (3,)
        Metrology marker in the tcp frame, in m.
    verification : Verification
        Where the result is judged.
    options : FitOptions, optional
        Bounds, weights, prior; the defaults without.

    Raises
    ------
    IdentificationError
        If nothing can be identified.
    """
    options = options or FitOptions()
    problem = build(model, readings, options, marker_offset)
    every = np.ones(len(readings), dtype=bool)
    problem = with_sag_open(problem, model, readings, every, options, marker_offset)
    return verification.judge(model, solve(problem).compliance[problem.springs])


@record()
class SpringLabel:
    """A spring of a layout."""

    name: str
    unit: str
    """Unit of its compliance."""


@brief_repr
@record(DESIGN_SCHEMA)
class StudyDesign:
    """Design of a study: all that its numbers depend on except the number of samples.

    Parts of a study belong together only if their design is the same.
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
    """Load cases of the cell; verification uses all of them."""
    conditions: tuple[Condition, ...]
    springs: dict[str, tuple[SpringLabel, ...]]
    """Springs by layout, in the order of the compliances."""
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
