"""Verdict file ``codec.json``: the figures of a codec, for people's scripts (spec section 4)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.codec._overlap import Overlap
from elastocal.codec.data import CodecData
from elastocal.codec.index_correlation import Correlation
from elastocal.codec.index_file import IndexRecord, index_records
from elastocal.codec.variants import KEYS
from elastocal.codec.verdicts import Verdicts
from elastocal.files import write_json
from elastocal.records import StrictModel, read_json

VERDICTS_SCHEMA = "elastocal.codec_verdicts/1"
VERDICTS = "codec.json"
"""Name of the file in a codec's folder."""


class Curve(StrictModel):
    """Errors of a variant over the number of training poses."""

    n_train: tuple[int, ...]
    error_mean: tuple[float, ...]
    """Median over the verification sets of the mean error norm, in m."""
    error_max: tuple[float, ...]
    """Median over the verification sets of the largest error norm, in m."""
    search: str
    springs: str
    load_cases: str
    solver: str


class SaturationRecord(StrictModel):
    """How sure a saturation is."""

    low: int | None
    high: int | None
    settled: bool
    error: float
    last_error: float
    stays: int
    """Number of training poses from which on no error leaves the tolerance again."""
    least: int
    """Number of training poses with the smallest error."""
    least_error: float
    rises: bool
    """Whether the last error is above the smallest by more than the tolerance."""


class PairRecord(StrictModel):
    """Two variants at one number of training poses."""

    a: str
    b: str
    n_train: int
    difference: float
    """Error of ``a`` minus error of ``b``, mean over the verification sets, in m."""
    low: float | None
    high: float | None


class CrossingRecord(StrictModel):
    """From where on one of two variants is the better one."""

    a: str
    b: str
    at: int
    """Number of training poses at which the pair is judged: both have saturated."""
    better: str | None
    proved_from: int | None
    crossing: int | None


class Settings(StrictModel):
    """What the figures rest on."""

    poses: int
    training: int
    verification: int
    splits: int
    overlap: float
    """Part of its poses that a verification set shares with another one, mean over pairs."""
    ratio: float
    seed: int
    tolerance: float
    floor: float
    load_cases: tuple[str, ...]


class VerdictRecord(StrictModel):
    """The contents of ``codec.json``."""

    robot: str
    provenance: str
    settings: Settings
    variants: dict[str, Curve]
    saturation: dict[str, int]
    saturation_interval: dict[str, SaturationRecord]
    paired: tuple[PairRecord, ...]
    crossings: tuple[CrossingRecord, ...]
    indices: tuple[IndexRecord, ...] = ()
    """Where they were asked for."""
    sentences: tuple[str, ...]
    findings: tuple[str, ...]
    versions: dict[str, str]


def verdict_record(
    data: CodecData, verdicts: Verdicts, correlations: Sequence[Correlation] = ()
) -> VerdictRecord:
    """Return the figures of a codec, its verdicts, and correlations of indices if there are."""
    return VerdictRecord(
        robot=data.robot,
        provenance=data.provenance,
        settings=_settings(data, verdicts),
        variants={each.name: _curve(data, each.name) for each in data.variants},
        saturation={each.variant: each.n_train for each in verdicts.saturation},
        saturation_interval={
            each.variant: SaturationRecord(
                **{name: getattr(each, name) for name in SaturationRecord.model_fields}
            )
            for each in verdicts.saturation
        },
        paired=_pairs(data, verdicts),
        crossings=tuple(
            CrossingRecord(**{name: getattr(each, name) for name in CrossingRecord.model_fields})
            for each in verdicts.pairs
        ),
        indices=index_records(correlations),
        sentences=verdicts.sentences,
        findings=data.findings,
        versions=data.versions,
    )


def figures(record: VerdictRecord) -> dict[str, Any]:
    """Return a record as JSON-ready data, with its schema."""
    return record.stated(VERDICTS_SCHEMA)


def write_verdicts(folder: Path, record: VerdictRecord) -> Path:
    """Write ``codec.json`` into a folder, atomically; return its path.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / VERDICTS
    write_json(path, figures(record))
    return path


def read_verdicts(path: Path) -> VerdictRecord:
    """Return the validated contents of a ``codec.json``.

    Raises
    ------
    SchemaError
        If it is not JSON, has another schema or does not fit.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, VerdictRecord, VERDICTS_SCHEMA)


def _settings(data: CodecData, verdicts: Verdicts) -> Settings:
    sets, size = data.verification.shape
    return Settings(
        poses=len(data.contact),
        training=data.training_poses,
        verification=size,
        splits=sets,
        overlap=Overlap.of(data.verification, len(data.contact)).shared,
        ratio=data.options.ratio,
        seed=data.options.seed,
        tolerance=verdicts.tolerance.relative,
        floor=verdicts.tolerance.floor,
        load_cases=data.load_cases,
    )


def _curve(data: CodecData, name: str) -> Curve:
    variant = data.variants[data.index(name)]
    return Curve(
        n_train=tuple(data.n_train.tolist()),
        error_mean=tuple(np.median(data.errors(name, "mean"), axis=0).tolist()),
        error_max=tuple(np.median(data.errors(name, "max"), axis=0).tolist()),
        **{key: getattr(variant, key) for key in KEYS},
    )


def _pairs(data: CodecData, verdicts: Verdicts) -> tuple[PairRecord, ...]:
    return tuple(
        PairRecord(
            a=pair.a,
            b=pair.b,
            n_train=int(n),
            difference=float(pair.difference[k]),
            low=_known(pair.low[k]),
            high=_known(pair.high[k]),
        )
        for pair in verdicts.pairs
        for k, n in enumerate(data.n_train)
    )


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
