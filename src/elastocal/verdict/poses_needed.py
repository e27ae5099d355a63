"""Poses that would bring a light to green, or why no number of poses does.

Each reason why the light of a run is not green is asked whether poses settle it. A pose whose
reading is predicted wrong by more than the tolerance gets a neighbour. The interval of the 95 %
error narrows with the root of the number of poses. A codec that does not show that the error has
stopped to fall needs training sets a quarter larger than those up to which it may still fall. What
the springs leave, and whatever is missing, damaged or contradictory, no number of poses settles.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from elastocal.errors import present
from elastocal.findings import Finding, Kind, as_count
from elastocal.identification import ProductionError
from elastocal.results import brief_repr
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.findings import NOT_COVERED, NOT_SETTLED, STILL_FALLING
from elastocal.verdict.headline import poses_to_settle
from elastocal.verdict.judgement import Light, judge_evidence
from elastocal.wording import mm

_MOST = 100
"""Poses that are added at most."""
_LEAST = 3
"""Poses from which stations are registered."""

FOR_THE_LIGHT = Kind(
    "plan.more-reason", "{poses} more: {reason}", shown={"poses": as_count("pose")}
)
NOT_BY_POSES = Kind("plan.more-cannot", "no number of poses changes that {reason}")


@brief_repr
@dataclass(frozen=True)
class PosesNeeded:
    """Numbers of poses that would bring a light to green, and what none would change."""

    counts: tuple[tuple[int, str], ...]
    """Numbers of poses, each with its reason."""
    beside: tuple[int, ...]
    """Poses that need a neighbour."""
    why_not: str
    """Why no number of poses makes the light green; empty: some may."""
    others: tuple[str, ...]
    """Reasons that have nothing to do with poses."""

    @property
    def count(self) -> int | None:
        """Number of poses that settles all that poses can; None: there is nothing."""
        if self.why_not or not self.counts:
            return None
        return max(_LEAST, *(number for number, _ in self.counts))

    @property
    def why_none(self) -> str:
        """Why no pose is needed, or none is of use."""
        if self.why_not:
            return self.why_not
        if self.others:
            return f"no number of poses changes that {self.others[0]}"
        return "its light is green"

    def findings(self) -> Iterator[Finding]:
        """Yield the reasons, and what no pose settles."""
        for number, reason in self.counts:
            yield FOR_THE_LIGHT(poses=number, reason=reason)
        for reason in (*((self.why_not,) if self.why_not else ()), *self.others):
            yield NOT_BY_POSES(reason=reason)

    @classmethod
    def of(cls, evidence: Evidence, error: ProductionError | None) -> "PosesNeeded":
        """Return what the evidence of a run says of poses.

        Parameters
        ----------
        evidence : Evidence
            With plan and dataset.
        error : ProductionError or None
            Error to expect on production, where it is known.
        """
        judged = judge_evidence(evidence)
        if judged.light is Light.GREEN:
            return cls((), (), "", ())
        if evidence.unseen is None or evidence.limits.tolerance is None:
            why = "; ".join(judged.reasons[:1]) or "there is no tolerance to judge by"
            return cls((), (), why, ())
        tolerance = evidence.limits.tolerance
        counts, why_not = [], ""
        beyond = evidence.unseen.pose[evidence.unseen.error > tolerance]
        beside = tuple(dict.fromkeys(map(int, beyond)))
        if beside:
            reason = f"readings of pose {', '.join(map(str, beside))} are beyond the tolerance"
            counts.append((len(beside), reason))
        wider = _for_interval(evidence, tolerance, error)
        if wider is None:
            why_not = _why_no_number(evidence, tolerance)
        elif wider:
            counts.append((wider, "the interval of the 95 % error is to end within the tolerance"))
        best, data = evidence.saturation, evidence.calibrated_from
        if best is not None and data is not None and (n := poses_to_settle(best, len(data.poses))):
            counts.append((n, "a codec is to show that the error no longer falls"))
        coverage = evidence.coverage
        if coverage is not None and not coverage.is_enough:
            counts.append((_LEAST, coverage.sentence()))
        settled = {each.name for each in (STILL_FALLING, NOT_SETTLED, NOT_COVERED)}
        others = tuple(
            str(each)
            for each in judged.reasons
            if isinstance(each, Finding) and each.kind not in settled
        )
        return cls(tuple(counts), beside, why_not, others)


def _for_interval(
    evidence: Evidence, tolerance: float, error: ProductionError | None
) -> int | None:
    """Return how many poses narrow the interval of the 95 % error enough; None: no number does."""
    unseen = present(evidence.unseen, "errors at unseen poses")
    p95, poses = unseen.p95, unseen.poses
    if p95.high <= tolerance:
        return 0
    # What the springs leave stays; the part of the fit falls with the number of poses.
    model = 1.0 if error is None else error.model / error.error
    if model * p95.value >= tolerance:
        return None
    for count in range(1, _MOST + 1):
        share = poses / (poses + count)
        value = p95.value * math.sqrt(model**2 + (1.0 - model**2) * share)
        if value + (p95.high - p95.value) * math.sqrt(share) <= tolerance:
            return count
    return None


def _why_no_number(evidence: Evidence, tolerance: float) -> str:
    p95 = present(evidence.unseen, "errors at unseen poses").p95
    return (
        f"95 % of errors are below {mm(p95.value)} ({mm(p95.low)} to {mm(p95.high)}), of which the"
        f" springs leave too much for a tolerance of {mm(tolerance)}: no number of poses up to"
        f" {_MOST} makes the light green"
    )
