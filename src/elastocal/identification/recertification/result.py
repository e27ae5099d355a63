"""What a comparison of two calibrations says."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.identification.observability import Term


class Verdict(StrEnum):
    """The largest change of predicted deflection against a limit."""

    PASS = "pass"
    """The upper end of its interval is within the limit."""
    FAIL = "fail"
    """The lower end is beyond the limit."""
    UNDECIDED = "undecided"
    """The limit lies within the interval."""


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval, in the unit that the field holding it states."""

    value: float
    low: float
    high: float

    def __contains__(self, number: float) -> bool:
        """Return whether a number lies in the interval, its ends included."""
        return self.low <= number <= self.high


@dataclass(frozen=True)
class SpringChange:
    """One spring, or one combination of springs, that both calibrations determine."""

    name: str
    """Of the spring, or the combination as a person would write it:
    ``joint_a4.axial + joint_a5.x``."""
    terms: tuple[Term, ...]
    """The sum that is compared, ``sum(weight * compliance)``; one term for a single spring."""
    unit: str
    """``rad/(N*m)`` or ``m/N``: of the first spring; the weights bring the others to it."""
    old: Estimate
    """Of the old calibration, in `unit`."""
    new: Estimate
    """Of the new calibration, in `unit`."""
    difference: Estimate
    """New minus old, with the 95 % interval that this difference has by itself, in `unit`."""
    together: Estimate
    """The same difference with the interval that holds for *all* compared springs at once with
    95 % (at least as wide), in `unit`. It decides `moved`."""

    @property
    def moved(self) -> bool:
        """Whether the spring changed beyond what both calibrations leave open."""
        return 0.0 not in self.together

    @property
    def relative(self) -> float:
        """Difference over the old value; NaN where that is not positive."""
        return self.difference.value / self.old.value if self.old.value > 0.0 else float("nan")


@dataclass(frozen=True, eq=False)
class DeflectionChange:
    """How the predicted deflection changed over given poses and loads (rows)."""

    q: FloatArray
    """Joint positions, shape (row, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None
    """Moment on the robot about the tcp in base, shape (row, 3), in N·m; None: none."""
    tcp_position: FloatArray
    """Where the tcp is, in base, shape (row, 3), in m."""
    old: FloatArray
    """Deflection by the old model in base, shape (row, 3), in m."""
    new: FloatArray
    """Deflection by the new model in base, shape (row, 3), in m."""
    low: FloatArray
    """Lower end of the 95 % interval of each row's `size`, shape (row,), in m; not below 0."""
    high: FloatArray
    """Upper end, shape (row,), in m."""
    old_share: FloatArray
    """Part of the variance of `change` that the old calibration brings, shape (row,), 0 to 1."""
    mean: Estimate
    """Mean of `size` over the rows, in m."""
    largest: Estimate
    """Largest `size` of all rows, in m; its interval allows for the search over the rows."""

    @property
    def change(self) -> FloatArray:
        """New minus old deflection in base, shape (row, 3), in m."""
        return self.new - self.old

    @property
    def size(self) -> FloatArray:
        """Norm of `change`, shape (row,), in m."""
        return np.asarray(np.linalg.norm(self.change, axis=1))

    @property
    def where(self) -> int:
        """Index of the row whose deflection changed most."""
        return int(self.size.argmax())


@dataclass(frozen=True, eq=False)
class Recertification:
    """Two calibrations of one cell, compared."""

    robot: str
    """Name of the robot, as the new model states it."""
    tcp: str
    """Link at the tool centre point."""
    old_provenance: str
    new_provenance: str
    springs: tuple[SpringChange, ...]
    """Springs and combinations that both calibrations determine, in the order of the model."""
    not_compared: tuple[str, ...]
    """Common springs that stand in no comparison: not determined by both, alone or in a sum."""
    only_old: tuple[str, ...]
    """Springs that only the old model has."""
    only_new: tuple[str, ...]
    """Springs that only the new model has."""
    deflection: DeflectionChange | None
    """Over the rows; None without rows."""
    limit: float | None
    """Largest change of deflection that is accepted, in m; None: nothing to judge."""
    verdict: Verdict | None
    """None without a limit, or without rows to judge it by."""
    reason: str
    """One sentence: why this verdict, or why none; if undecided, what would decide."""
    notes: tuple[str, ...]
    """What a reader has to know beside the figures, a sentence each."""

    @property
    def same_springs(self) -> bool:
        """Whether both models have the same springs.

        If not, a difference of one spring may come from the others in its model rather than
        from the robot.
        """
        return not self.only_old and not self.only_new

    @property
    def moved(self) -> tuple[SpringChange, ...]:
        """Springs and combinations that changed, the most certain first."""
        return tuple(
            sorted((each for each in self.springs if each.moved), key=_certainty, reverse=True)
        )


def _certainty(change: SpringChange) -> float:
    """Return the difference over the half-width of its interval on the side of zero."""
    d = change.difference
    width = d.value - d.low if d.value > 0.0 else d.high - d.value
    return abs(d.value) / width if width > 0.0 else float("inf")
