"""Pass, fail or undecided, and what would decide."""

import math

from elastocal.identification.recertification.result import DeflectionChange, Verdict

_MOST = 20
"""Beyond this many times the poses nobody measures."""


def judge(deflection: DeflectionChange | None, limit: float | None) -> tuple[Verdict | None, str]:
    """Return the verdict on the largest change against a limit in m, and why.

    Parameters
    ----------
    deflection : DeflectionChange, optional
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
    largest, said = deflection.largest, f"the limit of {1e3 * limit:g} mm"
    found = (
        f"the largest change is {_mm(largest.value)}"
        f" ({1e3 * largest.low:.3f} to {_mm(largest.high)}, 95 %)"
    )
    if largest.high <= limit:
        return Verdict.PASS, f"{found}, all of it within {said}"
    if largest.low > limit:
        return Verdict.FAIL, f"{found}, all of it beyond {said}"
    return Verdict.UNDECIDED, f"{found}, and {said} lies in between; {_decides(deflection, limit)}"


def _decides(deflection: DeflectionChange, limit: float) -> str:
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
