"""The result of a recertification: the file ``elastocal.comparison/1``, and the rows behind it."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from elastocal.arrays import FloatArray, IndexArray, Triple, triple
from elastocal.blocks import Block, Facts
from elastocal.findings import group_alike
from elastocal.identification.spring_sums import Term
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.wording import Phrase, phrase, sentences

SCHEMA = "elastocal.comparison/1"
LEAST_COVERED = 0.75
"""Share of each campaign's readings that the other must cover for the two to be alike."""


class Verdict(StrEnum):
    """The largest change of predicted deflection against a limit."""

    PASS = "pass"
    """The upper end of its interval is within the limit."""
    FAIL = "fail"
    """The lower end is beyond the limit."""
    UNDECIDED = "undecided"
    """The limit lies within the interval."""


_WORDS = {
    Verdict.PASS: phrase("Passed:"),
    Verdict.FAIL: phrase("Failed:"),
    Verdict.UNDECIDED: phrase("Not decided:"),
    None: phrase("Not judged:"),
}


@record()
class Estimate:
    """A number with its 95 % interval, in the unit that the field holding it states."""

    value: float
    low: float
    high: float

    def __contains__(self, number: float) -> bool:
        """Return whether a number lies in the interval, its ends included."""
        return self.low <= number <= self.high


@brief_repr
@record()
class SpringChange:
    """One spring, or one combination of springs, that both calibrations determine."""

    name: str
    """Name of the spring or the combination, such as ``joint_a4.axial + joint_a5.x``."""
    terms: tuple[Term, ...]
    """The sum that is compared, ``sum(weight * compliance)``; one term for a single spring."""
    unit: str
    """``rad/(N*m)`` or ``m/N``: of the first spring; the weights bring the others to it."""
    old: Estimate
    """Value of the old calibration, in `unit`."""
    new: Estimate
    """Value of the new calibration, in `unit`."""
    difference: Estimate
    """New minus old, with the 95 % interval of this difference alone, in `unit`."""
    together: Estimate
    """The same difference with the interval that holds for *all* compared springs at once with
    95 % (at least as wide), in `unit`. It decides `moved`."""
    moved: bool
    """Whether the spring changed beyond what both calibrations leave open."""

    @property
    def relative(self) -> float:
        """Difference over the old value; NaN where that is not surely above zero."""
        return self.difference.value / self.old.value if self.old.low > 0.0 else float("nan")

    @property
    def label(self) -> str:
        """Its name with the relative change, where there is one: ``joint_3.axial (+20%)``."""
        return self.name if np.isnan(self.relative) else f"{self.name} ({self.relative:+.0%})"

    @property
    def certainty(self) -> float:
        """Difference over the half-width of its interval on the side of zero."""
        d = self.difference
        width = d.value - d.low if d.value > 0.0 else d.high - d.value
        return abs(d.value) / width if width > 0.0 else float("inf")


@brief_repr
@record()
class CommonGround:
    """Common coverage of poses and loads by two campaigns; see `CoveredRows`."""

    old_covered: float
    """Share of the old campaign's readings that the new one covers."""
    new_covered: float
    """Share of the new campaign's readings that the old one covers."""
    springs_judged: bool
    """Whether that is enough to hold springs against one another."""
    rows: int | None = None
    """Number of rows that were given; none without rows."""
    rows_covered: int | None = None
    """Number of those that both campaigns cover: only these are compared."""

    @property
    def alike(self) -> bool:
        """Whether both campaigns were made at like poses and loads."""
        return min(self.old_covered, self.new_covered) >= LEAST_COVERED

    @property
    def left_out(self) -> int:
        """Number of rows that were given and not compared."""
        return (self.rows or 0) - (self.rows_covered or 0)

    @property
    def sentence(self) -> Phrase:
        """Why springs are not judged."""
        return phrase(
            "Springs are not held against one another: the campaigns were made at other poses or"
            " loads ({old} of the old readings lie where the new campaign measured, {new} of the"
            " new ones where the old one did), and what springs cannot express would look like a"
            " change.",
            old=f"{self.old_covered:.0%}",
            new=f"{self.new_covered:.0%}",
        )


@brief_repr
@record()
class LargestChange:
    """The row whose deflection changed most."""

    row: int
    """Its number among the rows that were given, from 0."""
    joints: tuple[float, ...]
    """In rad or m."""
    force: Triple
    """On the robot at the tcp in base, in N."""
    moment: Triple | None
    """On the robot at the tcp in base, in N·m; None if not given."""
    tcp_position: Triple
    """In base, in m."""
    old: Triple
    """Deflection by the old model in base, in m."""
    new: Triple
    """Deflection by the new model in base, in m."""


@brief_repr
@record()
class DeflectionChange:
    """The change of the predicted deflection over given poses and loads (rows)."""

    rows: int
    """Number of rows that are compared."""
    mean: Estimate
    """Mean norm of the change, in m."""
    largest: Estimate
    """Largest norm of all rows, in m; its interval allows for the search over the rows."""
    where: LargestChange
    size: tuple[float, ...]
    """Norm of the change of each row that is compared, in m."""
    low: tuple[float, ...]
    """Lower end of the 95 % interval of each `size`, in m; not below 0."""
    high: tuple[float, ...]
    """Upper end, in m."""


@brief_repr
@record(SCHEMA)
class CompareSummary:
    """Two calibrations of one cell, compared."""

    robot: str
    """Name of the robot, as the new model states it."""
    tcp: str
    """Link at the tool centre point."""
    old_provenance: str
    new_provenance: str
    springs: tuple[SpringChange, ...]
    """Springs and combinations that both calibrations determine, in the order of the model."""
    moved: tuple[str, ...]
    """Names of the springs and combinations that changed, the most certain first."""
    not_compared: tuple[str, ...]
    """Common springs without comparison: not determined by both, alone or in a sum."""
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
    """Caveats that belong to the figures, a sentence each."""
    ground: CommonGround | None = None
    """None where a model does not state its domain."""
    calibrated: DeflectionChange | None = None
    """Over the readings of the new calibration that the old one covers, where no rows were given;
    None with rows, or where a model does not know where it was calibrated."""

    @property
    def springs_judged(self) -> bool:
        """Whether springs were compared; see `CommonGround`."""
        return self.ground is None or self.ground.springs_judged

    @property
    def same_springs(self) -> bool:
        """Whether both models have the same springs.

        If not, a difference of one spring may come from the others in its model rather than
        from the robot.
        """
        return not self.only_old and not self.only_new

    @property
    def verdict_sentence(self) -> Phrase:
        """The verdict and why; behind a semicolon, what would decide one that is open."""
        return sentences([_WORDS[self.verdict], f"{self.reason}."])

    @property
    def moved_sentence(self) -> Phrase:
        """Sentence on the springs that changed, the most certain first, or why none is named.

        Springs of different models only *differ*.
        """
        if not self.springs:
            return phrase("No spring is determined by both calibrations.")
        if self.ground is not None and not self.springs_judged:
            return self.ground.sentence
        if self.moved:
            return phrase(
                "Moved beyond their intervals: {names}."
                if self.same_springs
                else "Differ beyond their intervals: {names}.",
                names=", ".join(each.label for each in self.moved_springs),
            )
        return phrase(
            "Of {count} compared springs and sums of springs, not one moved beyond its interval."
            if self.same_springs
            else "Of {count} compared springs and sums of springs, not one differs beyond its"
            " interval.",
            count=len(self.springs),
        )

    @property
    def moved_springs(self) -> tuple[SpringChange, ...]:
        """The springs and combinations that changed, the most certain first."""
        springs = {each.name: each for each in self.springs}
        return tuple(springs[name] for name in self.moved)


@brief_repr
@dataclass(frozen=True, eq=False)
class RowComparison:
    """Predicted deflections of both models over given poses and loads (rows)."""

    number: IndexArray
    """Number of each row among those that were given, from 0, shape (row,)."""
    q: FloatArray
    """Joint positions, shape (row, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None
    """Moment on the robot about the tcp in base, shape (row, 3), in N·m; None: none."""
    tcp_position: FloatArray
    """Position of the tcp in base, shape (row, 3), in m."""
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

    def summary(self) -> "DeflectionChange":
        """Return the change of the deflection, as files hold it."""
        row = self.where
        where = LargestChange(
            row=int(self.number[row]),
            joints=tuple(self.q[row].tolist()),
            force=triple(self.force[row]),
            moment=None if self.moment is None else triple(self.moment[row]),
            tcp_position=triple(self.tcp_position[row]),
            old=triple(self.old[row]),
            new=triple(self.new[row]),
        )
        size, low, high = (tuple(each.tolist()) for each in (self.size, self.low, self.high))
        return DeflectionChange(len(self.q), self.mean, self.largest, where, size, low, high)


@dataclass(frozen=True, eq=False, repr=False)
class CompareResult(Result):
    """Two calibrations of one cell, compared, with the rows that it rests on."""

    summary: CompareSummary
    """The figures and the verdict, as files hold them."""
    rows: RowComparison | None
    """None without rows."""
    calibrated: RowComparison | None = None
    """See `CompareSummary.calibrated`."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        found = self.summary
        return (
            ("robot", found.robot),
            ("springs", found.moved_sentence),
            ("verdict", found.verdict_sentence),
        )

    def show(self) -> Iterator[Block]:
        """Yield the springs that moved, the change over the rows, the verdict, and the notes."""
        from elastocal.identification.recertification.show import show_comparison

        yield from show_comparison(self.summary, self.rows or self.calibrated)
        yield Facts(tuple(("note", text) for text in group_alike(self.summary.notes)))
