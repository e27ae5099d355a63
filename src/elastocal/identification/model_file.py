"""Model file ``*.json``: a calibrated model with its draws, observability and provenance."""

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import JsonValue

from elastocal.elastic import ElasticModel, Hinge
from elastocal.errors import SchemaError
from elastocal.files import sha256, write_json
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.observability import Observability, Term
from elastocal.identification.options import MINIMUM_DRAWS
from elastocal.records import StrictModel, read_json
from elastocal.robot import Robot

SCHEMA = "elastocal.model/1"


class RobotRecord(StrictModel):
    """The robot, whole, so that a model file needs no other file."""

    name: str
    urdf: str
    urdf_sha256: str
    base: str
    tcp: str


class SpringRecord(StrictModel):
    """One spring."""

    name: str
    joint: str
    axis: tuple[float, float, float]
    revolute: bool
    distal: bool
    offset: tuple[float, float, float]


class TermRecord(StrictModel):
    """One spring of an unobservable combination."""

    spring: str
    weight: float


class ObservabilityRecord(StrictModel):
    """What the data determined."""

    rank: int
    condition: float
    observable: tuple[bool, ...]
    unobservable: tuple[tuple[TermRecord, ...], ...]


class ModelRecord(StrictModel):
    """A model file without its schema key."""

    robot: RobotRecord
    springs: tuple[SpringRecord, ...]
    compliance: tuple[float, ...]
    draws: tuple[tuple[float, ...], ...]
    observability: ObservabilityRecord
    provenance: str
    misfit: float | None = None
    """See `CalibratedModel.misfit`; none where it is not known, as in files of elastocal 0.1.0."""
    calibration: dict[str, JsonValue]
    """The figures of the calibration that made the model; see `summary`."""


def write_model(path: Path, calibrated: CalibratedModel, calibration: dict[str, Any]) -> None:
    """Write a model file atomically.

    Parameters
    ----------
    path : Path
        The file.
    calibrated : CalibratedModel
        The model.
    calibration : dict
        Its `summary`.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    robot, seen = calibrated.model.robot, calibrated.observability
    record = ModelRecord(
        robot=RobotRecord(
            name=robot.name,
            urdf=robot.urdf,
            urdf_sha256=robot.urdf_hash,
            base=robot.base,
            tcp=robot.tip,
        ),
        springs=tuple(
            SpringRecord(**{name: getattr(spring, name) for name in SpringRecord.model_fields})
            for spring in calibrated.model.springs
        ),
        compliance=tuple(calibrated.compliance.tolist()),
        draws=tuple(tuple(draw) for draw in calibrated.draws.tolist()),
        observability=ObservabilityRecord(
            rank=seen.rank,
            condition=seen.condition,
            observable=seen.observable,
            unobservable=tuple(
                tuple(TermRecord(spring=term.spring, weight=term.weight) for term in group)
                for group in seen.unobservable
            ),
        ),
        provenance=calibrated.provenance,
        misfit=calibrated.misfit if np.isfinite(calibrated.misfit) else None,
        calibration=calibration,
    )
    data = record.stated(SCHEMA)
    write_json(path, data)


def read_model(path: Path) -> CalibratedModel:
    """Return the calibrated model of a file.

    Raises
    ------
    SchemaError
        If the file is not a model of a known version, or contradicts itself.
    FileAccessError
        If it cannot be read.
    """
    record = read_record(path)
    if sha256(record.robot.urdf) != record.robot.urdf_sha256:
        raise SchemaError(f"{path}: robot.urdf was changed: its hash is not robot.urdf_sha256")
    springs = tuple(Hinge(**spring.model_dump()) for spring in record.springs)
    n = len(springs)
    if len(record.draws) < MINIMUM_DRAWS:
        raise SchemaError(f"{path}: {len(record.draws)} draws, at least {MINIMUM_DRAWS} are needed")
    for name, rows in (("compliance", (record.compliance,)), ("draws", record.draws)):
        if any(len(row) != n for row in rows) or not rows:
            raise SchemaError(f"{path}: {name} must have one number for each of {n} springs")
    if record.misfit is not None and not 0.0 <= record.misfit < np.inf:
        raise SchemaError(f"{path}: misfit {record.misfit:g} must be 0 or more")
    seen = record.observability
    if len(seen.observable) != n or not 0 <= seen.rank <= n:
        raise SchemaError(f"{path}: observability (rank {seen.rank}) does not fit {n} springs")
    robot = Robot.from_urdf(record.robot.urdf, record.robot.tcp, record.robot.base)
    return CalibratedModel(
        ElasticModel(robot, springs),
        np.array(record.compliance),
        np.array(record.draws),
        Observability(
            seen.rank,
            n,
            seen.condition,
            seen.observable,
            tuple(
                tuple(Term(term.spring, term.weight) for term in group)
                for group in seen.unobservable
            ),
        ),
        record.provenance,
        float("nan") if record.misfit is None else record.misfit,
    )


def read_record(path: Path) -> ModelRecord:
    """Return the validated contents of a model file.

    Raises
    ------
    SchemaError
        If it is not JSON, or not a model of a known version.
    FileAccessError
        If it cannot be read.
    """
    return read_json(path, ModelRecord, SCHEMA)
