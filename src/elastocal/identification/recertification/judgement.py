"""Pass, fail or undecided, and what would decide."""

import numpy as np

from elastocal.identification.recertification.result import (
    DeflectionChange,
    Estimate,
    Verdict,
)

_MM = 1e3


def judge(deflection: DeflectionChange | None, limit: float | None) -> tuple[Verdict | None, str]:
    """Return the verdict on the largest change against a limit in m, and why."""
    if limit is None:
        return None, "no limit was given, so nothing was judged"
    if deflection is None:
        return None, (
            "not judged: a limit needs the poses and forces that matter (--rows), which are in"
            " neither model"
        )
    largest = deflection.largest
    found = f"the largest change is {_MM * largest.value:.3f} mm" + (
        f" ({_MM * largest.low:.3f} to {_MM * largest.high:.3f} mm, 95 %)"
    )
    said = f"the limit of {_MM * limit:g} mm"
    if largest.high <= limit:
        return Verdict.PASS, f"{found}: all of its interval is within {said}"
    if largest.low > limit:
        return Verdict.FAIL, f"{found}: all of its interval is beyond {said}"
    return Verdict.UNDECIDED, f"{found}: {said} lies in its interval; {_decides(largest, limit)}"


def _decides(largest: Estimate, limit: float) -> str:
    """Return what would decide a verdict that is open."""
    value = largest.value
    needed = limit - value if value < limit else value - limit
    half = largest.high - value if value < limit else value - largest.low
    if not needed > 0.0:
        return "the change is as large as the limit, more poses will hardly decide"
    factor = np.square(half / needed)
    return (
        f"an interval {half / needed:.1f} times as narrow would decide it: about"
        f" {np.ceil(factor):.0f} times as many poses in both calibrations, if the estimate stays"
    )
