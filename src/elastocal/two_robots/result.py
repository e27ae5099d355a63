"""The result of a calibration of two robots: its record, and how it is shown."""

from collections.abc import Iterable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Bullets, Facts, Heading, Paragraph, Table
from elastocal.findings import Finding, Grade
from elastocal.identification import Term
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.two_robots.calibration import PairCalibration
from elastocal.wording import counted, mm, phrase, phrases


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

    def show(self) -> Iterable[Block]:
        """Return the error at left-out poses, each arm, the contact, and what is not seen."""
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
        return (
            (phrase("Presses"), str(self.readings)),
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
        grave = [each for each in self.findings if _grade(each) is not Grade.NOTE]
        notes = [each for each in self.findings if _grade(each) is Grade.NOTE]
        if grave or notes or self.hidden:
            yield Heading(phrase("What the presses do not see"))
        for each in grave:
            yield Bullets((each,), "warnings")
            if each.advice:
                yield Paragraph(each.advice, "advice")
        yield Bullets(tuple(notes))
        if self.hidden:
            yield Paragraph(
                phrase(
                    "Combinations of springs that noise hides, so that the prior decides: {count}.",
                    count=len(self.hidden),
                )
            )

    @classmethod
    def of(cls, cell: str, found: PairCalibration, files: tuple[str, str]) -> "PairResult":
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
        )


def _grade(finding: Finding) -> Grade | None:
    return finding.grade
