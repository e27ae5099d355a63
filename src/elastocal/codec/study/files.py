"""Results of a study: a tidy table of samples, one of compliances, and what they say."""

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from elastocal.codec.study.factors import FACTORS
from elastocal.codec.study.samples import SampleResult
from elastocal.codec.study.settings import StudySettings, written
from elastocal.codec.study.summary import ConditionSummary, advice, summarise
from elastocal.errors import CodecError
from elastocal.files import write_json, write_text
from elastocal.records import StrictModel, read_json

STUDY_SCHEMA = "elastocal.study/1"
RECORD, TABLE, COMPLIANCES = "study.json", "study.csv", "compliance.csv"
"""Names of the files in a study's folder."""

_FACTOR_COLUMNS = tuple(
    f"{key}[{factor.unit}]" if factor.unit else key for key, factor in FACTORS.items()
)
_ERRORS = ("error_mean", "error_max", "deflection_mean")


class StudyRecord(StrictModel):
    """Contents of `RECORD`; all lengths in m."""

    cell: str
    seed: int
    samples: int
    """Arms."""
    verification: int
    """Poses at which every calibration was judged, none of which any has seen."""
    load_cases: tuple[str, ...]
    """Under which it was judged."""
    target: float | None
    """Error that is good enough, in m."""
    advice: str
    """What the study says about the target; empty without one."""
    varied: tuple[str, ...]
    """Factors with more than one value."""
    conditions: tuple[ConditionSummary, ...]
    versions: dict[str, str]


def study_record(
    settings: StudySettings, results: Sequence[SampleResult], target: float | None
) -> StudyRecord:
    """Return what a study says.

    Parameters
    ----------
    settings : StudySettings
        Of the study.
    results : sequence of SampleResult
        Its samples.
    target : float, optional
        Error that is good enough, in m.

    Raises
    ------
    CodecError
        If the target is not above 0.
    """
    if target is not None and not target > 0.0:
        raise CodecError(f"target of {target:g} m: must be above 0")
    conditions = summarise(settings, results, target)
    return StudyRecord(
        cell=settings.cell,
        seed=settings.seed,
        samples=len(results),
        verification=settings.verification,
        load_cases=settings.load_cases,
        target=target,
        advice=advice(conditions, target),
        varied=settings.varied,
        conditions=conditions,
        versions=settings.versions,
    )


def write_study(
    folder: Path, settings: StudySettings, results: Sequence[SampleResult], record: StudyRecord
) -> list[str]:
    """Write tables and record, each atomically; return the names of the files.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    """
    rows = [_factors(settings, number) for number in range(len(settings.conditions))]
    header = ("sample", *_FACTOR_COLUMNS, *(f"{name}[m]" for name in _ERRORS))
    table = (
        (result.number, *rows[number], *(repr(getattr(outcome.accuracy, e)) for e in _ERRORS))
        for result in results
        for number, outcome in enumerate(result.outcomes)
    )
    write_text(folder / TABLE, _csv(header, table))
    header = ("sample", *_FACTOR_COLUMNS, "spring", "unit", "compliance")
    springs = [settings.springs[each.springs] for each in settings.conditions]
    table = (
        (result.number, *rows[number], spring.name, spring.unit, repr(value))
        for result in results
        for number, outcome in enumerate(result.outcomes)
        for spring, value in zip(springs[number], outcome.compliance.tolist(), strict=True)
    )
    write_text(folder / COMPLIANCES, _csv(header, table))
    contents = record.stated(STUDY_SCHEMA)
    write_json(folder / RECORD, contents)
    return [TABLE, COMPLIANCES, RECORD]


def read_study(path: Path) -> StudyRecord:
    """Return what a study says, from its folder or its `RECORD`.

    Raises
    ------
    SchemaError, FileAccessError
        If the file holds none.
    """
    path = Path(path)
    return read_json(path / RECORD if path.is_dir() else path, StudyRecord, STUDY_SCHEMA)


def _factors(settings: StudySettings, number: int) -> tuple[str, ...]:
    condition = settings.conditions[number].condition
    return tuple(written(condition.value(key)) for key in FACTORS)


def _csv(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
