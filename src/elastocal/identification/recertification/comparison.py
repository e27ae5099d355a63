"""Compare two calibrations of one cell: what changed, and whether it matters (recertification).

The verdict is given in words: pass, fail or undecided, what would decide, and caveats.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError, RobotError, SpringError
from elastocal.identification.calibrated import CalibratedModel, check_rows
from elastocal.identification.model_file import CalibrateResult
from elastocal.identification.recertification._changes import (
    Loads,
    Spread,
    common_ground,
    common_springs,
    compare_rows,
    compare_springs,
    taken,
)
from elastocal.identification.recertification.result import (
    CommonGround,
    CompareResult,
    CompareSummary,
    RowComparison,
    Verdict,
)
from elastocal.records import read_json
from elastocal.robot import Robot
from elastocal.wording import counted

_MOST = 20
"""Beyond this many times the poses nobody measures."""
_PLAN = re.compile(r"\bplan ([0-9a-f]{12,})\b")
_LIKE = 1.25
"""Mean measured deflections further apart than by this factor come from other loads."""
_PROBES, _SEED = 8, 0
_LENGTH, _ANGLE = 1e-4, 1e-4
"""Largest difference of two descriptions of one robot, in m and rad: on a lever of 2 m it changes
a deflection by less than a part in ten thousand."""


def _judge(
    deflection: RowComparison | None, limit: float | None, ground: CommonGround | None = None
) -> tuple[Verdict | None, str]:
    """Return the verdict on the largest change against a limit in m, and why.

    Parameters
    ----------
    deflection : RowComparison, optional
        Over the rows that matter; None: there are none.
    limit : float, optional
        Largest accepted change, in m.
    ground : CommonGround, optional
        Rows that both campaigns cover, where that is known.
    """
    if limit is None:
        return None, "no limit was given, so nothing was judged"
    if deflection is None and ground is not None and ground.rows:
        return None, (
            f"not judged: none of {counted(ground.rows, 'row')} lies where both campaigns measured"
        )
    if deflection is None:
        return None, (
            "not judged: a limit is held against the poses and forces that matter, and no rows were"
            " given"
        )
    largest, allowed = deflection.largest, f"the limit of {1e3 * limit:g} mm"
    where = ""
    if ground is not None and ground.left_out:
        where = f" over the {ground.rows_covered} of {ground.rows} rows that both campaigns cover"
    found = (
        f"the largest change{where} is {_mm(largest.value)}"
        f" ({1e3 * largest.low:.3f} to {_mm(largest.high)}, 95 %)"
    )
    if largest.high <= limit:
        return Verdict.PASS, f"{found}, all of it within {allowed}"
    if largest.low > limit:
        return Verdict.FAIL, f"{found}, all of it beyond {allowed}"
    decides = _what_decides(deflection, limit)
    return Verdict.UNDECIDED, f"{found}, and {allowed} lies in between; {decides}"


def _what_decides(deflection: RowComparison, limit: float) -> str:
    """Return what would decide a verdict that is open, if the estimate stays.

    The old calibration cannot be repeated: that arm is gone. Only the new one's part of the
    variance shrinks, as one over its poses.
    """
    largest = deflection.largest
    passing = largest.value < limit
    half = largest.high - largest.value if passing else largest.value - largest.low
    row = int(deflection.high.argmax()) if passing else deflection.where
    share = float(deflection.old_share[row])
    spare = (abs(limit - largest.value) / half) ** 2 - share
    times = math.inf if not spare > 0.0 else (1.0 - share) / spare
    limits = f"limits of {_mm(largest.high)} and more would pass"
    if largest.low > 0.0:
        limits += f", limits below {_mm(largest.low)} fail"
    if not times <= _MOST:
        return f"more poses in the new calibration alone will hardly decide it; {limits}"
    return (
        f"about {max(math.ceil(10.0 * times) / 10.0, 1.1):.1f} times as many poses in the new"
        f" calibration would decide it, if the estimate stays; {limits}"
    )


def _mm(length: float) -> str:
    return f"{1e3 * length:.3f} mm"


def _notes_on(
    old: CalibratedModel,
    new: CalibratedModel,
    same_springs: bool,
    outside: int,
    ground: CommonGround | None = None,
) -> tuple[str, ...]:
    """Return what a reader has to know beside the figures, a sentence each.

    Parameters
    ----------
    old, new : CalibratedModel
        What is compared.
    same_springs : bool
        Whether the models have the same springs.
    outside : int
        Number of rows outside the joint limits.
    ground : CommonGround, optional
        What both campaigns cover, where it is known.
    """
    notes = []
    if not same_springs:
        notes.append(
            "the models have different springs: a spring's value depends on which others are in the"
            " model, so the springs do not tell whether the robot changed; predictions do, as far"
            " as both models can express the arm"
        )
    if old.provenance and old.provenance == new.provenance:
        notes.append(
            f"both models state the same origin ({old.provenance}): calibrations of one set of"
            " readings are not independent, and the intervals do not hold for them"
        )
    elif ground is None and not _same_plan(old, new):
        notes.append(
            "the models do not state one and the same plan: the intervals hold if both calibrations"
            " spread their poses over the same region under the same forces; elsewhere the arm does"
            " what springs cannot express, and this looks like a change"
        )
    if ground is not None and ground.left_out:
        notes.append(
            f"{ground.left_out} of {counted(ground.rows or 0, 'row')} lie outside of what both"
            " campaigns cover, by pose or by load, and were left out: nothing is known of them"
        )
    if outside:
        notes.append(f"{outside} rows lie outside the joint limits of the robot")
    return tuple(notes)


def _load_note(old: float | None, new: float | None) -> str | None:
    """Return what other loads do to a comparison, or None where they were alike.

    Parameters
    ----------
    old, new : float, optional
        Mean measured deflection of each calibration, in m; None: not known.
    """
    if old is None or new is None or not (old > 0.0 and new > 0.0):
        return None
    if not abs(np.log(new / old)) > np.log(_LIKE):
        return None
    return (
        f"the arm was deflected by {1e3 * old:.3f} mm on average in the old calibration and by"
        f" {1e3 * new:.3f} mm in the new one: with other forces gears that stiffen under load look"
        " like a change"
    )


def _same_plan(old: CalibratedModel, new: CalibratedModel) -> bool:
    plans = [_PLAN.search(each.provenance) for each in (old, new)]
    return plans[0] is not None and plans[1] is not None and plans[0][1] == plans[1][1]


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
    (old_model, old_deflection), (new_model, new_deflection) = _read(old), _read(new)
    names = (str(old), str(new))
    found = recertify(old_model, new_model, q, force, moment, limit=limit, names=names)
    note = _load_note(old_deflection, new_deflection)
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
    loads = None if q is None else _checked_rows(new.model.robot, q, force, moment)
    ground, number = common_ground(old, new, loads)
    rows = None
    if loads is not None and len(number):
        rows = compare_rows(old, new, spread, *taken(loads, number), number)
    verdict, reason = _judge(rows, limit, ground)
    springs = compare_springs(old, new, spread)
    if ground is not None and not ground.springs_judged:
        springs = tuple(replace(each, moved=False) for each in springs)
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
        notes=_notes_on(old, new, not only_old and not only_new, outside, ground),
        ground=ground,
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
    robot: Robot, q: ArrayLike, force: ArrayLike | None, moment: ArrayLike | None
) -> Loads:
    """Return rows as arrays, or refuse them by shape or value."""
    if force is None:
        raise SpringError("rows have joint positions q but no force")
    joints, forces, moments = check_rows(robot, q, force, moment)
    if not len(joints):
        raise SpringError(f"force {forces.shape} does not have a row for each of q {joints.shape}")
    return joints, forces, moments


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


def _read(path: Path) -> tuple[CalibratedModel, float | None]:
    """Return the model of a file, and the mean measured deflection that it states, in m."""
    found = read_json(path, CalibrateResult)
    figures = found.calibration
    try:
        return found.calibrated, None if figures is None else figures.deflection.mean
    except (SpringError, RobotError) as error:
        # Of two files, a refusal has to say which.
        raise type(error)(f"{path}: {error}") from error
