"""The verdict on a comparison in words: pass, fail or undecided, what would decide, and caveats."""

import math
import re

import numpy as np

from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.recertification.result import RowComparison, Verdict

_MOST = 20
"""Beyond this many times the poses nobody measures."""
_PLAN = re.compile(r"\bplan ([0-9a-f]{12,})\b")
_LIKE = 1.25
"""Mean measured deflections further apart than by this factor come from other loads."""


def judge(deflection: RowComparison | None, limit: float | None) -> tuple[Verdict | None, str]:
    """Return the verdict on the largest change against a limit in m, and why.

    Parameters
    ----------
    deflection : RowComparison, optional
        Over the rows that matter; None: there are none.
    limit : float, optional
        Largest accepted change, in m.
    """
    if limit is None:
        return None, "no limit was given, so nothing was judged"
    if deflection is None:
        return None, (
            "not judged: a limit is held against the poses and forces that matter, and no rows were"
            " given"
        )
    largest, allowed = deflection.largest, f"the limit of {1e3 * limit:g} mm"
    found = (
        f"the largest change is {_mm(largest.value)}"
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


def notes_on(
    old: CalibratedModel, new: CalibratedModel, same_springs: bool, outside: int
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
    elif not _same_plan(old, new):
        notes.append(
            "the models do not state one and the same plan: the intervals hold if both calibrations"
            " spread their poses over the same region under the same forces; elsewhere the arm does"
            " what springs cannot express, and this looks like a change"
        )
    if outside:
        notes.append(f"{outside} rows lie outside the joint limits of the robot")
    return tuple(notes)


def load_note(old: float | None, new: float | None) -> str | None:
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
