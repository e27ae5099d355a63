"""Compare two calibrations of one cell: what changed, and whether it matters (recertification).

The verdict is given in words: pass, fail or undecided, what would decide, and caveats.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elastocal.errors import IdentificationError, RobotError, SpringError
from elastocal.identification.calibrated import CalibratedModel, check_rows
from elastocal.identification.figures import CalibrationSummary
from elastocal.identification.model_file import CalibrateResult
from elastocal.identification.recertification._changes import (
    Spread,
    common_ground,
    compare_calibrated_poses,
    compare_rows,
    compare_springs,
)
from elastocal.identification.recertification._sums import common_springs, shared_numbers
from elastocal.identification.recertification.arms import (
    ComparedRows,
    arm_notes,
    check_same_robot,
    count_outside_limits,
    model_on,
)
from elastocal.identification.recertification.result import (
    CommonGround,
    CompareResult,
    CompareSummary,
    RowComparison,
    SpringChange,
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
    if ground is not None and ground.rows and not ground.alike:
        notes.append(
            f"the campaigns were made at other poses or loads ({ground.old_covered:.0%} and"
            f" {ground.new_covered:.0%} of their readings lie where the other measured too): the"
            " intervals of the change hold what springs cannot express"
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


def _frame_note(old: CalibrationSummary | None, new: CalibrationSummary | None) -> str | None:
    """Return what frames that were estimated do to a comparison; None where they were alike."""
    free = [
        "none" if each is None or each.settings is None else each.settings.free_frame
        for each in (old, new)
    ]
    if free[0] == free[1]:
        return None
    return (
        f"the old calibration estimated frames of the tracker by: {free[0]}, the new one by:"
        f" {free[1]}; a tracker or marker that moved looks like a change where none were estimated"
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
    rows: ComparedRows | None = None,
    limit: float | None = None,
) -> CompareResult:
    """Compare two model files; as `recertify`, with a note on other loads or free frames.

    Parameters
    ----------
    old, new : Path
        Model files of `elastocal calibrate`.
    q, force, moment, rows, limit
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
    (old_model, old_figures), (new_model, new_figures) = _read(old), _read(new)
    names = (str(old), str(new))
    found = recertify(old_model, new_model, q, force, moment, rows=rows, limit=limit, names=names)
    notes = [_frame_note(old_figures, new_figures)]
    if not (old_model.model.bears_weight and new_model.model.bears_weight):
        means = [
            None if each is None else each.deflection.mean for each in (old_figures, new_figures)
        ]
        notes.append(_load_note(*means))
    said = tuple(note for note in notes if note is not None)
    return replace(found, summary=replace(found.summary, notes=(*found.summary.notes, *said)))


def recertify(
    old: CalibratedModel,
    new: CalibratedModel,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    rows: ComparedRows | None = None,
    limit: float | None = None,
    names: tuple[str, str] = ("the old model", "the new model"),
) -> CompareResult:
    """Compare two calibrations of one cell.

    Parameters
    ----------
    old, new : CalibratedModel
        The calibrations, of the same robot.
    q : array_like, shape (row, joint), optional
        Joint positions at which predictions are compared, in rad or m. Without rows only
        springs are compared.
    force : array_like, shape (row, 3), optional
        Force on the robot at the tcp in base, in N; needed with ``q``.
    moment : array_like, shape (row, 3), optional
        Moment on the robot about the tcp in base, in N·m.
    rows : ComparedRows, optional
        In place of ``q``, ``force`` and ``moment``: rows with what friction remembers, the readings
        of a dataset, or those of an arm that stands otherwise than at the new calibration.
    limit : float, optional
        Largest change of predicted deflection that is accepted at these rows, in m.
    names : tuple of str
        What to call the models in a refusal.

    Raises
    ------
    IdentificationError
        If the models are of different robots, are one and the same, or the limit is not a positive
        number.
    SpringError, RobotError
        If rows have another shape or are not finite.
    """
    if limit is not None and not 0.0 < limit < np.inf:
        raise IdentificationError(f"limit {limit:g} m: a largest accepted change is above 0")
    check_same_robot(old.model.robot, new.model.robot, names)
    given = _given_rows(new.model.robot, q, force, moment, rows)
    arm = new.model.robot if given is None or given.arm is None else given.arm
    if np.array_equal(old.compliance, new.compliance) and np.array_equal(old.draws, new.draws):
        raise IdentificationError(
            f"{names[0]} and {names[1]} are one and the same calibration: nothing to compare"
        )
    spread = Spread.of(old, new)
    ground, number = common_ground(old, new, given, arm)
    changes = None
    if given is not None and len(number):
        alike = ground is None or ground.alike
        on_arm = model_on(old, arm), model_on(new, arm)
        changes = compare_rows(*on_arm, spread, given, number, alike=alike)
    measured = compare_calibrated_poses(old, new, spread) if given is None else None
    verdict, reason = _judge(changes, limit, ground)
    springs = _judged_springs(old, new, spread, ground)
    moved = sorted(
        (each for each in springs if each.moved), key=lambda each: each.certainty, reverse=True
    )
    common = [spring.name for spring in common_springs(old, new)]
    compared = _compared_springs(old, new, springs)
    only_old, only_new = (
        tuple(name for name in each.model.spring_names if name not in common) for each in (old, new)
    )
    outside = 0 if given is None else count_outside_limits(arm, given.q)
    result = CompareSummary(
        robot=new.model.robot.name,
        tcp=arm.tip,
        old_provenance=old.provenance,
        new_provenance=new.provenance,
        springs=springs,
        moved=tuple(each.name for each in moved),
        not_compared=tuple(name for name in common if name not in compared),
        only_old=only_old,
        only_new=only_new,
        deflection=None if changes is None else changes.summary(),
        limit=limit,
        verdict=verdict,
        reason=reason,
        notes=(
            *_notes_on(old, new, not only_old and not only_new, outside, ground),
            *arm_notes((old, new), arm, names),
        ),
        ground=ground,
        calibrated=None if measured is None else measured.summary(),
    )
    return CompareResult(result, changes, measured)


def _judged_springs(
    old: CalibratedModel, new: CalibratedModel, spread: Spread, ground: CommonGround | None
) -> tuple[SpringChange, ...]:
    """Return the changes of springs, of which none moved where the campaigns do not tell."""
    springs = compare_springs(old, new, spread)
    if ground is not None and not ground.springs_judged:
        return tuple(replace(each, moved=False) for each in springs)
    return springs


def _compared_springs(
    old: CalibratedModel, new: CalibratedModel, changes: tuple[SpringChange, ...]
) -> set[str]:
    """Return the names of the springs that stand in a comparison."""
    terms = {term.spring for change in changes for term in change.terms}
    return {each.spring for each in shared_numbers(old, new) if each.name in terms}


def _given_rows(
    robot: Robot,
    q: ArrayLike | None,
    force: ArrayLike | None,
    moment: ArrayLike | None,
    rows: ComparedRows | None,
) -> ComparedRows | None:
    """Return the rows that matter, or refuse them by shape or value; None: there are none."""
    if rows is not None:
        q, force, moment = rows.q, rows.force, rows.moment
        if rows.arm is not None:
            check_same_robot(rows.arm, robot, ("the robot of the rows", "that of the new model"))
    elif q is None:
        return None
    elif force is None:
        raise SpringError("rows have joint positions q but no force")
    joints, forces, moments = check_rows(robot, q, force, moment)
    if not len(joints):
        raise SpringError(f"force {forces.shape} does not have a row for each of q {joints.shape}")
    if rows is not None and rows.visit is not None and len(rows.visit) != len(joints):
        raise SpringError(f"visit has {len(rows.visit)} values for {len(joints)} rows")
    return rows or ComparedRows(joints, forces, moments)


def _read(path: Path) -> tuple[CalibratedModel, CalibrationSummary | None]:
    """Return the model of a file, and the figures of its calibration."""
    found = read_json(path, CalibrateResult)
    try:
        return found.calibrated, found.calibration
    except (SpringError, RobotError) as error:
        # Of two files, a refusal has to say which.
        raise type(error)(f"{path}: {error}") from error
