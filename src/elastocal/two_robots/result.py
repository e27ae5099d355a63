"""The result of a calibration of two robots: its record, and how it is shown."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Bullets, Facts, Heading, Paragraph, Table
from elastocal.findings import Finding, Grade
from elastocal.identification import MOST_TERMS, Term, describe_briefly
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.two_robots.calibration import (
    LEFT_OUT,
    LOOKS_WRONG,
    MANY_ASIDE,
    SET_ASIDE,
    PairCalibration,
)
from elastocal.two_robots.cooperation import CooperationSummary
from elastocal.wording import counted, mm, phrase, phrases

_LEAST_WEIGHT = 0.05
"""Weight of a spring in a combination, of 1 at most, below which a line leaves it out."""
_WRONG = (MANY_ASIDE.name, SET_ASIDE.name, LOOKS_WRONG.name, LEFT_OUT.name)
"""Kinds of findings on single presses."""


@brief_repr
@record()
class ContactCompliance:
    """A compliance of the contact of both tips, as it was found."""

    name: str
    compliance: float
    """In m/N."""
    low: float
    """Lower end of its 95 % interval, in m/N."""
    high: float


@brief_repr
@record()
class ArmFigures:
    """What is known of one arm."""

    name: str
    robot: str
    model: str
    """Its model file in the folder of the result."""
    springs: int
    known_alone: int
    """Parameters that the presses determine each for itself."""
    before: bool
    """Whether its model was known before."""


@brief_repr
@record()
class TriedSprings:
    """Springs that were tried at the same left-out poses."""

    springs: str
    held_out: float
    """Mean error of the relative displacement at left-out poses, in m."""


@record("elastocal.two-robots/1", eq=False, sealed=True)
class PairResult(Result):
    """Both arms from presses on each other: what ``calibrate-pair`` returns and writes."""

    cell: str
    arms: tuple[ArmFigures, ArmFigures]
    base_transform: FloatArray
    """Base of the second robot in that of the first, shape (4, 4)."""
    springs: str
    """Name of the springs of the arms that were not known before."""
    poses: int
    readings: int
    tracked: bool
    """Whether a tracker measured both tools."""
    deflection: float
    """Mean relative displacement less what the controllers say, in m."""
    held_out: float
    """Mean error of it at left-out poses, in m."""
    held_out_max: float
    """Largest one, in m."""
    folds: int
    """Refits by which poses were left out."""
    contact: tuple[ContactCompliance, ...]
    tried: tuple[TriedSprings, ...]
    unobservable: tuple[tuple[Term, ...], ...]
    """Combinations of springs of both arms that the presses do not see; ``ARM:joint.axis``."""
    hidden: tuple[tuple[Term, ...], ...]
    """Combinations that noise hides."""
    findings: tuple[Finding, ...]
    cooperation: CooperationSummary | None = None
    """Relative deviation at the presses, before and after a correction that the cell's weights and
    limits share; none where a corrected press is out of reach."""
    set_aside: int = 0
    """Presses beside `readings` that were left out of the fit as blunders."""

    def sections(self) -> Iterator[tuple[str, str, Iterable[Block]]]:
        """Yield identifier, title and contents of each section of the page."""
        yield "result", phrase("Both arms"), self._result()
        if self.unobservable or self.hidden:
            yield "unseen", phrase("What the presses do not tell apart"), self._unseen()
        title = phrase("Relative deviation of the tools, before and after")
        yield "deviation", title, self._deviation()

    def show(self) -> Iterable[Block]:
        """Return the sections of the page under one another."""
        for number, (_, title, blocks) in enumerate(self.sections()):
            if number:
                yield Heading(title)
            yield from blocks

    def _result(self) -> Iterator[Block]:
        """Yield the error at left-out poses, each arm, the contact, and the findings."""
        measured = (
            phrase("A tracker measured both tools.")
            if self.tracked
            else phrase(
                "No tracker measured: the tools held each other at {poses}.",
                poses=counted(self.poses, "pose"),
            )
        )
        yield Paragraph(measured, "sentence")
        yield Facts(self.facts())
        yield Table(
            phrase("Arms"),
            phrases("Arm", "Robot", "Model", "Parameters", "Known alone"),
            tuple(
                (each.name, each.robot, each.model, each.springs, each.known_alone)
                for each in self.arms
            ),
            texts=3,
        )
        if self.contact:
            yield Table(
                phrase("Contact of both tips, with its 95 % interval"),
                phrases("Direction", "Compliance [nm/N]", "Low", "High"),
                tuple(
                    (
                        phrase(each.name),
                        *(f"{1e9 * v:.1f}" for v in (each.compliance, each.low, each.high)),
                    )
                    for each in self.contact
                ),
            )
        yield from self._findings()

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the presses, and the error at left-out poses."""
        share = self.held_out / self.deflection
        presses = str(self.readings)
        if self.set_aside:
            presses = phrase(
                "{count}, and {aside} set aside as blunders",
                count=self.readings,
                aside=self.set_aside,
            )
        return (
            (phrase("Presses"), presses),
            (phrase("Poses"), str(self.poses)),
            (phrase("Springs"), self.springs),
            (phrase("Relative displacement, mean"), mm(self.deflection)),
            (
                phrase("Error at left-out poses, mean"),
                phrase(
                    "{error} ({share}), {folds} refits",
                    error=mm(self.held_out),
                    share=f"{share:.1%}",
                    folds=self.folds,
                ),
            ),
            (phrase("Error at left-out poses, largest"), mm(self.held_out_max)),
        )

    def _findings(self) -> Iterable[Block]:
        wrong = [each for each in self.findings if each.kind in _WRONG]
        if wrong:
            yield Heading(phrase("Presses that look wrong or were left out"))
        for each in wrong:
            yield Bullets((each,), "warnings")
            yield Paragraph(each.advice, "advice")
        others = [each for each in self.findings if each not in wrong]
        grave = [each for each in others if _grade(each) is not Grade.NOTE]
        notes = [each for each in others if _grade(each) is Grade.NOTE]
        if grave or notes or self.hidden:
            yield Heading(phrase("What the presses do not see"))
        for each in grave:
            yield Bullets((each,), "warnings")
            if each.advice:
                yield Paragraph(each.advice, "advice")
        yield Bullets(tuple(notes))

    def _unseen(self) -> Iterator[Block]:
        """Yield the combinations that presses or noise leave open: of both arms, then of each."""
        for arm in ("", *(each.name for each in self.arms)):
            unobservable, hidden = (
                [group for group in groups if _arm_of(group) == arm]
                for groups in (self.unobservable, self.hidden)
            )
            lines = tuple(_lines(unobservable, hidden, f"{arm}:" if arm else ""))
            if lines:
                alone = (
                    phrase("Of {arm} alone", arm=arm) if arm else phrase("Of both arms together")
                )
                yield Heading(alone)
                yield Bullets(lines)
        yield Paragraph(
            phrase(
                "Springs with less than {share} of the largest weight in a combination are not"
                " written.",
                share=f"{_LEAST_WEIGHT:.0%}",
            )
        )
        yield Paragraph(
            phrase(
                "Do not use single values: what they predict together was tested, and nothing else."
            )
        )

    def _deviation(self) -> Iterator[Block]:
        """Yield what a correction with the weights and limits of the cell brings at the presses."""
        found = self.cooperation
        if found is None:
            yield Paragraph(
                phrase(
                    "Nothing is said of a correction: with the cell's weights and limits, an arm"
                    " cannot reach a corrected press."
                )
            )
            return
        yield Paragraph(
            phrase(
                "How far the tools yield from each other at the presses of this campaign, against"
                " unloaded arms, and what a correction by compensate-pair takes of each arm, shared"
                " as the cell file says. After it the same models predict no deviation but what"
                " limits leave; at left-out poses they err by {error} on average, and that"
                " remains.",
                error=mm(self.held_out),
            ),
            "sentence",
        )
        yield from found.show()

    @classmethod
    def of(
        cls,
        cell: str,
        found: PairCalibration,
        files: tuple[str, str],
        cooperation: CooperationSummary | None = None,
    ) -> "PairResult":
        """Return the record of a calibration, with the names of both model files."""
        first, second = (
            ArmFigures(
                name,
                robot.name,
                file,
                len(model.model.parameters),
                sum(model.observability.observable),
                name in found.known,
            )
            for name, robot, file, model in zip(
                found.pair.names, found.pair.robots, files, found.models, strict=True
            )
        )
        held = found.held_out
        return cls(
            cell=cell,
            arms=(first, second),
            base_transform=found.pair.T_first_second,
            springs=found.springs,
            poses=len(np.unique(found.pair.first.pose)),
            readings=len(found.pair),
            tracked=found.pair.tracked,
            deflection=found.deflection,
            held_out=held.mean,
            held_out_max=held.max,
            folds=held.folds,
            contact=tuple(ContactCompliance(*each) for each in found.contact),
            tried=tuple(TriedSprings(*each) for each in found.tried),
            unobservable=found.seen.unobservable,
            hidden=found.seen.hidden,
            findings=found.findings,
            cooperation=cooperation,
            set_aside=sum(each.kind == SET_ASIDE.name for each in found.findings),
        )


def _arm_of(group: Sequence[Term]) -> str:
    """Return the arm whose springs a combination is of; nothing if it is of both."""
    arms = {term.spring.partition(":")[0] for term in group}
    return arms.pop() if len(arms) == 1 else ""


def _lines(
    unobservable: Sequence[Sequence[Term]], hidden: Sequence[Sequence[Term]], prefix: str
) -> Iterator[str]:
    """Yield a line a combination; springs that no press loads share one."""
    idle = [group[0].spring for group in unobservable if len(group) == 1]
    if idle:
        springs = ", ".join(name.removeprefix(prefix) for name in idle)
        yield phrase("no press loads these springs: {springs}", springs=springs)
    for group in unobservable:
        if len(group) > 1:
            yield phrase("not told apart: {springs}", springs=_written(group, prefix))
    for group in hidden:
        yield phrase("hidden by noise: {springs}", springs=_written(group, prefix))


def _written(group: Sequence[Term], prefix: str) -> str:
    """Return a combination in the arm's own names; of a large one, the springs that lead it."""
    plain = [
        Term(term.spring.removeprefix(prefix), term.weight)
        for term in group
        if abs(term.weight) >= _LEAST_WEIGHT
    ]
    if len(plain) <= MOST_TERMS:
        return describe_briefly(plain)
    leading = sorted(plain, key=lambda term: -abs(term.weight))[:MOST_TERMS]
    return phrase(
        "{springs}, and {count} more with less weight",
        springs=", ".join(term.spring for term in leading),
        count=len(plain) - MOST_TERMS,
    )


def _grade(finding: Finding) -> Grade | None:
    return finding.grade
