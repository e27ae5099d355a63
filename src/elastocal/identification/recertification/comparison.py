"""Compare two calibrations of one cell: what changed, and whether it matters (recertification)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.elastic import check_vectors
from elastocal.errors import IdentificationError, RobotError, SpringError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.model_file import CalibrateResult, read_model
from elastocal.identification.recertification._judgement import judge, load_note, notes_on
from elastocal.identification.recertification._rows import compare_rows
from elastocal.identification.recertification._spread import Spread
from elastocal.identification.recertification._springs import common_springs, compare_springs
from elastocal.identification.recertification.result import CompareResult, CompareSummary
from elastocal.records import read_json
from elastocal.robot import Robot

_PROBES, _SEED = 8, 0
_LENGTH, _ANGLE = 1e-4, 1e-4
"""Largest difference of two descriptions of one robot, in m and rad: on a lever of 2 m it changes
a deflection by less than a part in ten thousand."""


def recertify_files(
    old: Path,
    new: Path,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    limit: float | None = None,
) -> CompareResult:
    """Compare two model files; as `recertify`, with a note where the loads were others.

    Parameters
    ----------
    old, new : Path
        Model files of `elastocal calibrate`.
    q, force, moment, limit
        As for `recertify`.

    Raises
    ------
    SchemaError, FileAccessError
        If a file is no model or cannot be read.
    IdentificationError, SpringError, RobotError
        See `recertify`.
    """
    if Path(old).resolve() == Path(new).resolve():
        raise IdentificationError(f"{old} and {new} are one and the same file: nothing to compare")
    found = recertify(
        _read_named(old),
        _read_named(new),
        q,
        force,
        moment,
        limit=limit,
        names=(str(old), str(new)),
    )
    note = load_note(*(_measured_deflection(path) for path in (old, new)))
    if note is None:
        return found
    return replace(found, summary=replace(found.summary, notes=(*found.summary.notes, note)))


def recertify(
    old: CalibratedModel,
    new: CalibratedModel,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    limit: float | None = None,
    names: tuple[str, str] = ("the old model", "the new model"),
) -> CompareResult:
    """Compare two calibrations of one cell.

    Parameters
    ----------
    old, new : CalibratedModel
        The calibrations, of the same robot and tcp.
    q : array_like, shape (row, joint), optional
        Joint positions at which predictions are compared, in rad or m. Without rows only
        springs are compared.
    force : array_like, shape (row, 3), optional
        Force on the robot at the tcp in base, in N; needed with ``q``.
    moment : array_like, shape (row, 3), optional
        Moment on the robot about the tcp in base, in N·m.
    limit : float, optional
        Largest change of predicted deflection that is accepted at these rows, in m.
    names : tuple of str
        What to call the models in a refusal.

    Raises
    ------
    IdentificationError
        If the models are of different robots or tool centre points, are one and the same, or the
        limit is not a positive number.
    SpringError, RobotError
        If rows have another shape or are not finite.
    """
    if limit is not None and not 0.0 < limit < np.inf:
        raise IdentificationError(f"limit {limit:g} m: a largest accepted change is above 0")
    check_same_robot(old.model.robot, new.model.robot, names)
    if np.array_equal(old.compliance, new.compliance) and np.array_equal(old.draws, new.draws):
        raise IdentificationError(
            f"{names[0]} and {names[1]} are one and the same calibration: nothing to compare"
        )
    spread = Spread.of(old, new)
    loads = None if q is None else _checked_rows(new, q, force, moment)
    rows = None if loads is None else compare_rows(old, new, spread, *loads)
    verdict, reason = judge(rows, limit)
    springs = compare_springs(old, new, spread)
    moved = sorted(
        (each for each in springs if each.moved), key=lambda each: each.certainty, reverse=True
    )
    common = [spring.name for spring in common_springs(old, new)]
    compared = {term.spring for change in springs for term in change.terms}
    only_old, only_new = (
        tuple(name for name in each.model.spring_names if name not in common) for each in (old, new)
    )
    outside = 0 if loads is None else _count_outside_limits(new.model.robot, loads[0])
    result = CompareSummary(
        robot=new.model.robot.name,
        tcp=new.model.robot.tip,
        old_provenance=old.provenance,
        new_provenance=new.provenance,
        springs=springs,
        moved=tuple(each.name for each in moved),
        not_compared=tuple(name for name in common if name not in compared),
        only_old=only_old,
        only_new=only_new,
        deflection=None if rows is None else rows.summary(),
        limit=limit,
        verdict=verdict,
        reason=reason,
        notes=notes_on(old, new, not only_old and not only_new, outside),
    )
    return CompareResult(result, rows)


def check_same_robot(old: Robot, new: Robot, names: tuple[str, str]) -> None:
    """Refuse two robots that are not the same, or not with the same tool centre point.

    Parameters
    ----------
    old, new : Robot
        The robots.
    names : tuple of str
        What they belong to, for the message.

    Raises
    ------
    IdentificationError
        If joints, kinematics or tool centre points differ.
    """
    a, b = names
    if old.joint_names != new.joint_names or old.revolute != new.revolute:
        raise IdentificationError(
            f"{a} and {b} are of different robots: {old.name} has the joints"
            f" {', '.join(old.joint_names)}, {new.name} has {', '.join(new.joint_names)}"
        )
    q = _probes(old)
    last = [robot.forward(q) @ np.linalg.inv(robot.chain.T_last_tip) for robot in (old, new)]
    off, turned = _apart(*last)
    if not (off <= _LENGTH and turned <= _ANGLE):
        raise IdentificationError(
            f"{a} ({old.name}) and {b} ({new.name}) are of different robots: at the same joints"
            f" their last links are {1e3 * off:.3g} mm and {np.degrees(turned):.3g}° apart"
        )
    off, turned = _apart(old.chain.T_last_tip[None], new.chain.T_last_tip[None])
    if not (off <= _LENGTH and turned <= _ANGLE):
        raise IdentificationError(
            f"{a} (tcp {old.tip}) and {b} (tcp {new.tip}) have different tool centre points,"
            f" {1e3 * off:.3g} mm and {np.degrees(turned):.3g}° apart: calibrate both for one"
        )


def _checked_rows(
    model: CalibratedModel, q: ArrayLike, force: ArrayLike | None, moment: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Return rows as arrays, or refuse them by shape or value."""
    joints = model.model.robot.check_positions(q)
    if force is None:
        raise SpringError("rows have joint positions q but no force")
    loads = {"force": force} | ({} if moment is None else {"moment": moment})
    vectors = {name: check_vectors(name, each) for name, each in loads.items()}
    for name, array in vectors.items():
        if joints.ndim != 2 or not len(joints) or array.shape != (len(joints), 3):
            raise SpringError(
                f"{name} {array.shape} does not have a row for each of q {joints.shape}"
            )
    return joints, vectors["force"], vectors.get("moment")


def _count_outside_limits(robot: Robot, q: FloatArray) -> int:
    """Return how many rows of joint positions lie outside the robot's limits."""
    return int(np.sum(np.any(robot.limits.margin(q) < 0.0, axis=1)))


def _probes(robot: Robot) -> FloatArray:
    """Return configurations at which two robots would show that they differ."""
    limits = robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    rng = np.random.default_rng(_SEED)
    return np.vstack([np.zeros(len(lower)), rng.uniform(lower, upper, (_PROBES, len(lower)))])


def _apart(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Return the largest distance in m and angle in rad between frames, shape (n, 4, 4)."""
    distance = np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1)
    # The Frobenius norm of the difference of two rotations is sqrt(8) sin(angle / 2).
    chord = np.linalg.norm(a[:, :3, :3] - b[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
    return float(distance.max()), float(2.0 * np.arcsin(np.minimum(chord.max(), 1.0)))


def _read_named(path: Path) -> CalibratedModel:
    """Return the model of a file; of two files, a refusal has to say which."""
    try:
        return read_model(path)
    except (SpringError, RobotError) as error:
        raise type(error)(f"{path}: {error}") from error


def _measured_deflection(path: Path) -> float | None:
    """Return the mean measured deflection that a model file states, in m; None: none."""
    figures = read_json(path, CalibrateResult).calibration
    return None if figures is None else figures.deflection.mean
