"""Comparison file ``*.json``: the figures of a recertification."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from elastocal.files import write_json
from elastocal.identification.recertification.result import (
    DeflectionChange,
    Estimate,
    Recertification,
    SpringChange,
)
from elastocal.records import StrictModel, read_json

SCHEMA = "elastocal.comparison/1"


class EstimateRecord(StrictModel):
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float


class TermRecord(StrictModel):
    """One spring of a sum."""

    spring: str
    weight: float


class SpringRecord(StrictModel):
    """One spring or sum of springs that both calibrations determine."""

    name: str
    terms: tuple[TermRecord, ...]
    unit: str
    old: EstimateRecord
    new: EstimateRecord
    difference: EstimateRecord
    together: EstimateRecord
    """The difference with the interval that holds for all springs at once."""
    moved: bool


class RowRecord(StrictModel):
    """The row whose deflection changed most; numbers count from 0."""

    row: int
    joints: tuple[float, ...]
    force: tuple[float, float, float]
    moment: tuple[float, float, float] | None
    tcp_position: tuple[float, float, float]
    old: tuple[float, float, float]
    """Deflection by the old model in base, in m."""
    new: tuple[float, float, float]


class DeflectionRecord(StrictModel):
    """How the predicted deflection changed, in m."""

    rows: int
    mean: EstimateRecord
    largest: EstimateRecord
    where: RowRecord
    size: tuple[float, ...]
    """Norm of the change of each row."""
    low: tuple[float, ...]
    high: tuple[float, ...]


class ComparisonRecord(StrictModel):
    """A comparison file without its schema key."""

    robot: str
    tcp: str
    old_provenance: str
    new_provenance: str
    springs: tuple[SpringRecord, ...]
    moved: tuple[str, ...]
    """Names of the springs and sums that moved, the most certain first."""
    not_compared: tuple[str, ...]
    only_old: tuple[str, ...]
    only_new: tuple[str, ...]
    deflection: DeflectionRecord | None
    limit: float | None
    """In m."""
    verdict: Literal["pass", "fail", "undecided"] | None
    reason: str
    notes: tuple[str, ...]


def comparison_record(found: Recertification) -> ComparisonRecord:
    """Return the figures of a comparison."""
    return ComparisonRecord(
        robot=found.robot,
        tcp=found.tcp,
        old_provenance=found.old_provenance,
        new_provenance=found.new_provenance,
        springs=tuple(_spring(change) for change in found.springs),
        moved=tuple(change.name for change in found.moved),
        not_compared=found.not_compared,
        only_old=found.only_old,
        only_new=found.only_new,
        deflection=None if found.deflection is None else _deflection(found.deflection),
        limit=found.limit,
        verdict=None if found.verdict is None else found.verdict.value,
        reason=found.reason,
        notes=found.notes,
    )


def figures(record: ComparisonRecord) -> dict[str, Any]:
    """Return a record as JSON-ready data, with its schema."""
    return record.stated(SCHEMA)


def write_comparison(path: Path, record: ComparisonRecord) -> None:
    """Write a comparison file atomically.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    write_json(path, figures(record))


def read_comparison(path: Path) -> ComparisonRecord:
    """Return the validated contents of a comparison file.

    Raises
    ------
    SchemaError
        If it is not JSON, has another schema or does not fit.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, ComparisonRecord, SCHEMA)


def _estimate(estimate: Estimate) -> EstimateRecord:
    return EstimateRecord(value=estimate.value, low=estimate.low, high=estimate.high)


def _spring(change: SpringChange) -> SpringRecord:
    return SpringRecord(
        name=change.name,
        terms=tuple(TermRecord(spring=term.spring, weight=term.weight) for term in change.terms),
        unit=change.unit,
        old=_estimate(change.old),
        new=_estimate(change.new),
        difference=_estimate(change.difference),
        together=_estimate(change.together),
        moved=change.moved,
    )


def _deflection(change: DeflectionChange) -> DeflectionRecord:
    return DeflectionRecord(
        rows=len(change.q),
        mean=_estimate(change.mean),
        largest=_estimate(change.largest),
        where=_row(change),
        size=tuple(change.size.tolist()),
        low=tuple(change.low.tolist()),
        high=tuple(change.high.tolist()),
    )


def _row(change: DeflectionChange) -> RowRecord:
    row = change.where
    moment = None if change.moment is None else _triple(change.moment[row])
    return RowRecord(
        row=row,
        joints=tuple(change.q[row].tolist()),
        force=_triple(change.force[row]),
        moment=moment,
        tcp_position=_triple(change.tcp_position[row]),
        old=_triple(change.old[row]),
        new=_triple(change.new[row]),
    )


def _triple(vector: Sequence[float] | Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
