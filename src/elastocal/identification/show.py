"""Show a calibration: a user's questions, in their order, as blocks for every shell.

How well does it fit; is it better than simpler models; which springs are really known, and how
well; which readings look wrong.
"""

from collections.abc import Iterator, Sequence

from elastocal.blocks import Block, Bullets, Cell, Grade, Graded, Heading, Paragraph, Row, Table
from elastocal.elastic import Unit, unit_of
from elastocal.identification.budget import ErrorBudget
from elastocal.identification.contact import LATERAL, NORMAL, ContactFigure, ContactSummary
from elastocal.identification.encoders import EncoderSummary
from elastocal.identification.figures import (
    CalibrationSummary,
    RungSummary,
    SpringSummary,
    SumSummary,
    SuspiciousReading,
    ladder_sentence,
)
from elastocal.identification.frames import FrameSummary
from elastocal.identification.rungs import AUTO
from elastocal.identification.spring_sums import Term, describe_briefly, sum_text
from elastocal.identification.uncertainty import Coverage
from elastocal.wording import (
    Phrase,
    counted,
    lengths_with_interval,
    mm,
    phrase,
    phrases,
    sentences,
    springs_and_parameters,
    um,
)

_USUAL_UNIT = unit_of("rad/(N*m)")
"""Unit of most springs, shown in the heads; other springs name their own."""
_MOST_SAID = 10.0
"""Half an interval by its value, from which on its size says nothing more."""
_MOST_SUSPICIOUS = 10
_DIRECTIONS = {NORMAL: phrase("along the normal"), LATERAL: phrase("sideways")}
_FEW_TERMS = 3
"""Most springs of a hidden combination that is written out; larger ones are counted."""
_WELL, _FAIRLY = 0.2, 0.5
"""Half an interval by its value, up to which a spring is known well, or fairly well."""


def show_calibration(figures: CalibrationSummary) -> Iterator[Block]:
    """Yield the blocks of a calibration.

    Parameters
    ----------
    figures : CalibrationSummary
        Its figures.
    """
    count = figures.springs_total if figures.spring_count is None else figures.spring_count
    yield Paragraph(
        phrase(
            "{robot}: {springs}, {readings} readings at {poses} poses, measured deflection {mean}"
            " mean, {most} max",
            robot=figures.robot,
            springs=springs_and_parameters(count, figures.springs_total),
            readings=figures.readings,
            poses=figures.poses,
            mean=mm(figures.deflection.mean),
            most=mm(figures.deflection.max),
        )
    )
    yield _errors(figures)
    if figures.coverage is not None:
        yield Paragraph(_coverage(figures.coverage))
    if figures.production:
        yield Paragraph(figures.production.sentence())
    yield from show_ladder(figures.ladder)
    if len(figures.ladder) > 1 and figures.settings and figures.settings.springs == AUTO:
        yield Paragraph(ladder_sentence(figures.ladder))
    yield spring_table(figures.springs)
    yield from show_unseen(
        figures.springs,
        (figures.unobservable, figures.hidden),
        (figures.rank, figures.rank_attainable, figures.springs_total),
        figures.condition,
    )
    yield from show_sums(figures.sums)
    yield from _frames(figures.frames)
    yield from show_contact(figures.contact)
    yield from show_encoders(figures.encoders, figures.held_out.mean)
    yield from show_budget(figures.budget)
    yield from _suspicious(figures.suspicious)


def _errors(figures: CalibrationSummary) -> Table:
    mean, fit, held_out = figures.deflection.mean, figures.residual, figures.held_out
    rows: list[Row] = [
        (
            phrase("at left-out poses ({refits} refits)", refits=held_out.folds),
            mm(held_out.mean),
            f"{held_out.mean / mean:.2%}",
            "" if held_out.p95 is None else mm(held_out.p95),
            mm(held_out.max),
        ),
        (
            phrase("at the poses fitted"),
            *(mm(fit.mean), f"{fit.mean / mean:.2%}", mm(fit.p95), mm(fit.max)),
        ),
    ]
    if (check := figures.check) is not None:
        share = f"{check.mean / check.deflection:.2%}"
        name = phrase("at {cases}, not fitted", cases=", ".join(check.load_cases))
        rows.append((name, mm(check.mean), share, mm(check.p95), mm(check.max)))
        noise = phrase("not known") if check.noise is None else mm(check.noise)
        rows.append((phrase("noise there"), noise, "", "", ""))
    heads = phrases("Error norm", "Mean", "Of deflection", "95 %", "Largest")
    return Table(phrase("How well the model fits"), heads, tuple(rows))


def _coverage(coverage: Coverage) -> str:
    measured, fit = coverage.measurement, coverage.fit
    if measured.share is None:
        inside = phrase("not known: {reason}", reason=measured.reason)
    else:
        inside = phrase(
            "{share} of {count} components at left-out poses lay inside ({nominal} should)",
            share=f"{measured.share:.1%}",
            count=measured.count,
            nominal=f"{measured.nominal:.0%}",
        )
        if measured.low_share is not None:
            inside = phrase(
                "{inside}, {share} of those at low load",
                inside=inside,
                share=f"{measured.low_share:.1%}",
            )
    return phrase(
        "interval of a measurement: {inside}; interval of the fit: coverage not known ({reason})",
        inside=inside,
        reason=fit.reason,
    )


def show_ladder(ladder: Sequence[RungSummary]) -> Iterator[Block]:
    """Yield the models that were tried at the same left-out poses; nothing of a single one."""
    if len(ladder) < 2:
        return
    heads = phrases("Springs", "Numbers", "At left-out poses", "Above the best allowed")
    rows = tuple(
        (
            rung.springs,
            str(rung.parameters),
            mm(rung.held_out),
            _worse(rung),
            phrase("taken") if rung.chosen else "",
        )
        for rung in ladder
    )
    yield Table(phrase("Models at the same left-out poses"), (*heads, ""), rows)


def _worse(rung: RungSummary) -> str:
    found = rung.difference
    if found.low == found.high:
        return ""
    low, high = (um(each).removesuffix(" µm") for each in (found.low, found.high))
    return phrase("{value} ({low} to {high})", value=um(found.mean), low=low, high=high)


def spring_table(springs: Sequence[SpringSummary]) -> Table:
    """Return a row a spring; linear springs, rare, name their own units.

    Parameters
    ----------
    springs : sequence of SpringSummary
        In the order of the model.
    """
    heads = (
        phrase("Spring"),
        phrase("Compliance, {unit}", unit=_USUAL_UNIT.shown),
        phrase("95 % interval"),
        phrase("Stiffness, {unit}", unit=_USUAL_UNIT.stiffness),
        phrase("Known?"),
    )
    rows, above = list[Row](), ""
    for spring in springs:
        # The total of a gear at its torque follows its first row, without repeating the name.
        further = bool(above) and spring.name.startswith(f"{above} ")
        name = phrase("  {name}", name=_further(spring.name, above)) if further else spring.name
        above = above if further else spring.name
        rows.append((name, *_spring_cells(spring)))
    return Table(phrase("Compliances"), heads, tuple(rows))


def _further(name: str, above: str) -> str:
    """Return the name of a further row of a gear without that of the gear."""
    figure = name.parts.get("figure") if isinstance(name, Phrase) else None
    return figure if isinstance(figure, Phrase) else name.removeprefix(f"{above} ")


def _spring_cells(spring: SpringSummary) -> tuple[Cell, ...]:
    shown = unit_of(spring.unit)
    value, low, high = (
        shown.factor * each for each in (spring.compliance, spring.low, spring.high)
    )
    unit = "" if shown == _USUAL_UNIT else f" {shown.shown}"
    if spring.too_weak or not spring.observable:
        return f"({value:.4f}{unit})", "", "", _hidden(spring)
    return (
        f"{value:.4f}{unit}",
        f"{low:.3f} … {high:.3f}",
        _stiffness(value, high, shown),
        _known(value, low, high, spring),
    )


def _hidden(spring: SpringSummary) -> Cell:
    weak = phrase("too weak to see")
    text = weak if spring.too_weak else phrase("in group {group}", group=spring.group)
    return Graded(text, "fair")


def _stiffness(value: float, high: float, unit: Unit) -> str:
    name = "" if unit == _USUAL_UNIT else f" {unit.stiffness}"
    if value == 0.0:
        # A bound says that it is rigid, the readings only how soft it is at most.
        if not (high > 0.0 and unit.stiffness):
            return phrase("rigid")
        return phrase("above {bound}", bound=f"{1.0 / high:.3f}{name}")
    return f"{1.0 / value:.3f}{name}" if unit.stiffness and value > 0.0 else ""


def _known(value: float, low: float, high: float, spring: SpringSummary) -> Cell:
    """Return how well a spring is determined separately, for values in shown units."""
    grade: Grade = "fair"
    text = _at_bound(value, low, high)
    if not (low <= value <= high or spring.at_bound):
        text, grade = phrase("outside its interval: do not use, was the file changed?"), "poor"
    elif not spring.at_bound:
        if value == 0.0:
            return ""
        half = (high - low) / 2.0 / abs(value)
        text = (
            phrase("±{share}", share=f"{half:.0%}" if half >= 0.01 else f"{half:.1%}")
            if half <= _MOST_SAID
            else phrase("more than ±{share}", share=f"{_MOST_SAID:.0%}")
        )
        grade = "good" if half < _WELL else "fair" if half < _FAIRLY else "poor"
    return Graded(phrase("{known}, prior", known=text) if spring.prior else text, grade)


def _at_bound(value: float, low: float, high: float) -> str:
    if high > value:
        return phrase("below {bound}", bound=f"{high:.3f}")
    return phrase("above {bound}", bound=f"{low:.3f}") if low < value else phrase("at bound")


def _hidden_note() -> Phrase:
    return phrase(
        "Noise hides some springs: the usual size of such springs is known better than the readings"
        " tell theirs."
    )


def condition_text(condition: float) -> str:
    """Return a condition number for people; its last digits mean nothing.

    >>> condition_text(883826.4)
    '884000'
    """
    return f"{float(f'{condition:.3g}'):.0f}"


def show_unseen(
    springs: Sequence[SpringSummary],
    open_: tuple[Sequence[Sequence[Term]], Sequence[Sequence[Term]]],
    ranks: tuple[int, int, int],
    condition: float,
) -> Iterator[Block]:
    """Yield the combinations that the readings do not determine.

    Parameters
    ----------
    springs : sequence of SpringSummary
        In the order of the model.
    open_ : tuple of two sequences of sequence of Term
        Combinations that change no deflection that was measured, and those that noise hides.
    ranks : tuple of int
        The rank, the rank that any number of poses would reach, and the number of parameters.
    condition : float
        Condition number of the column-scaled system.
    """
    (rank, _, total), (groups, hidden) = ranks, open_
    text = phrase(
        "Rank {rank} of {total}, condition number {condition}.",
        rank=rank,
        total=total,
        condition=condition_text(condition),
    )
    yield Paragraph(phrase("{rank} {meaning}", rank=text, meaning=_meaning(springs, open_, ranks)))
    if hidden and (groups or rank < total):
        yield Paragraph(_hidden_note())
    if groups or hidden:
        yield Bullets(tuple(_groups(groups, hidden)))
        yield Paragraph(
            phrase(
                "Do not use single values: what they predict together was tested, and nothing else."
            )
        )
    weak = sum(spring.too_weak for spring in springs)
    if weak:
        yield Paragraph(
            phrase(
                "{springs} too weak to see: a sensible value deflects the arm by less than the"
                " noise of the readings hides.",
                springs=counted(weak, "spring"),
            )
        )


def _groups(groups: Sequence[Sequence[Term]], hidden: Sequence[Sequence[Term]]) -> Iterator[Phrase]:
    """Yield the combinations that readings or noise leave open; large hidden ones are counted."""
    for number, each in enumerate((*groups, *hidden), start=1):
        springs = describe_briefly(each)
        if number <= len(groups):
            yield phrase("group {number}, not by itself: {springs}", number=number, springs=springs)
        elif len(each) <= _FEW_TERMS:
            yield phrase(
                "group {number}, hidden by noise: {springs}", number=number, springs=springs
            )
    large = sum(len(each) > _FEW_TERMS for each in hidden)
    if large:
        yield phrase("groups of more springs, hidden by noise: {count}", count=large)


def show_sums(sums: Sequence[SumSummary]) -> Iterator[Block]:
    """Yield what the readings tell of springs that noise hides, a row a sum."""
    if not sums:
        return
    rows = list[Row]()
    for each in sums:
        unit = unit_of(each.unit)
        name = "" if unit == _USUAL_UNIT else f" {unit.shown}"
        value, low, high = (unit.factor * part for part in (each.compliance, each.low, each.high))
        rows.append((sum_text(each.terms), f"{value:.4f}{name}", f"{low:.3f} … {high:.3f}"))
    heads = (
        phrase("Sum"),
        phrase("Compliance, {unit}", unit=_USUAL_UNIT.shown),
        phrase("95 % interval"),
    )
    yield Table(phrase("Sums that the readings tell of springs in a group"), heads, tuple(rows))


def _meaning(
    springs: Sequence[SpringSummary],
    open_: tuple[Sequence[Sequence[Term]], Sequence[Sequence[Term]]],
    ranks: tuple[int, int, int],
) -> str:
    (rank, attainable, total), (groups, hidden) = ranks, open_
    if not groups:
        if rank < total:
            return phrase("What the readings leave open, the bounds of the springs settle.")
        if hidden:
            return _hidden_note()
        bound = [each.name for each in springs if each.at_bound]
        if bound:
            return phrase(
                "The readings tell every spring apart, but a bound decides the value of {springs}:"
                " {names}.",
                springs=counted(len(bound), "spring"),
                names=", ".join(bound),
            )
        return phrase("Every spring is observable.")
    if attainable <= rank:
        return phrase(
            "These combinations change no deflection under a force, so their springs have no value"
            " of their own; predictions do not need one."
        )
    return phrase(
        "{missing} more directions could be seen with other poses or load cases, so that not all"
        " of these combinations are harmless.",
        missing=attainable - rank,
    )


def _frames(frames: Sequence[FrameSummary]) -> Iterator[Block]:
    """Yield the frames that were estimated with the springs, each number with its interval."""
    if not frames:
        return
    rows = list[Row]()
    for frame in frames:
        parts = (
            (phrase("tracker shift, µm"), frame.translation, frame.half_width[:3]),
            (phrase("tracker turn, µrad"), frame.rotation, frame.half_width[3:6]),
            (phrase("marker in tcp frame, µm"), frame.marker, frame.half_width[6:]),
        )
        for name, (what, part, half) in zip((frame.name, "", ""), parts, strict=True):
            numbers = zip(part, half, strict=True)
            rows.append((name, what, *(f"{1e6 * x:.0f} ±{1e6 * h:.0f}" for x, h in numbers)))
    heads = (phrase("Frame of"), phrase("Against its references"), *"xyz")
    yield Table(phrase("Frames that were estimated"), heads, tuple(rows), texts=2)


def show_contact(contact: ContactSummary | None) -> Iterator[Block]:
    """Yield where the zero of a calibration without a tracker comes from; nothing of one with."""
    if contact is None:
        return
    yield Heading(phrase("The contact that held the tool"))
    yield Paragraph(contact.sentence())
    heads = phrases(
        "Direction",
        "Stiffness, N/µm",
        "95 % interval",
        "Stated",
        "By doubled presses",
        "Distinct from the springs?",
    )
    rows = tuple(
        (
            _DIRECTIONS[each.name],
            _newton_per_um(each.compliance),
            f"{_newton_per_um(each.high)} … {_newton_per_um(each.low)}",
            phrase("free") if each.stated is None else _newton_per_um(each.stated),
            "" if each.doubled is None else _newton_per_um(each.doubled),
            _distinct(each),
        )
        for each in contact.figures
    )
    yield Table(phrase("Stiffness of one disk or tip on the tooling"), heads, rows)
    if contact.tip is not None:
        yield Paragraph(contact.tip.sentence())
    if contact.fixed:
        names = sentences([_DIRECTIONS[each] for each in contact.fixed], ", ")
        text = phrase("Not fitted, since no press loads it: {names}.", names=names)
        yield Paragraph(text)
    if not all(each.is_seen for each in contact.figures):
        yield Paragraph(
            phrase(
                "What springs imitate is as good as the contact file says, and no better: press at"
                " some places on one and on two disks, sideways too, turn the tool by ±1 rad about"
                " the normal, or use a second tip."
            )
        )


def show_encoders(encoders: EncoderSummary | None, alone: float) -> Iterator[Block]:
    """Yield what secondary encoders brought; nothing without any.

    Parameters
    ----------
    encoders : EncoderSummary, optional
        What they brought.
    alone : float
        Mean error at left-out poses of the model alone, in m.
    """
    if encoders is None:
        return
    yield Heading(phrase("Secondary encoders"))
    if encoders.held_out is None:
        yield Paragraph(
            phrase(
                "The links were not read at the reference, so the zero of each pose is unknown:"
                " encoders show how each joint yields, and the tracker the whole."
            )
        )
    else:
        yield Paragraph(
            phrase(
                "At left-out poses the mean error is {alone} by the model alone, and {both} where"
                " the encoders are read in production, too: they see the gears, and the model"
                " predicts the rest.",
                alone=mm(alone),
                both=mm(encoders.held_out),
            )
        )
    heads = phrases("Joint", "Its encoder sees, rms", "What the model leaves of it")
    figures = zip(encoders.joints, encoders.units, encoders.seen, encoders.unexplained, strict=True)
    rows = tuple(
        (joint, f"{1e6 * seen:.3g} µ{unit}", f"{1e6 * left:.3g} µ{unit}")
        for joint, unit, seen, left in figures
    )
    yield Table(phrase("Joints with a secondary encoder"), heads, rows, texts=1)


def _newton_per_um(compliance: float) -> str:
    return phrase("rigid") if compliance <= 0.0 else f"{1e-6 / compliance:.3g}"


def _distinct(figure: ContactFigure) -> Cell:
    if figure.is_seen:
        return phrase("yes, {part} of its column", part=f"{figure.outside:.0%}")
    return Graded(phrase("no: {springs} imitate it", springs=", ".join(figure.imitators)), "fair")


def show_budget(budget: ErrorBudget | None) -> Iterator[Block]:
    """Yield what the error at left-out poses is made of, and what each term takes from it."""
    if budget is None:
        return
    yield Heading(phrase("What the error is made of"))
    yield Table(
        phrase("Parts of the root mean square error at left-out poses, which add up in quadrature"),
        phrases("Error budget", "Error", "95 % interval in mm", "Known from"),
        tuple(
            (name, *lengths_with_interval(part.error, part.low, part.high), part.source)
            for name, part in budget.parts
        ),
    )
    yield Table(
        phrase("What each term takes away; below zero where it adds"),
        (
            *phrases(
                "Term", "In the model", "Takes away", "95 % interval in mm", "Error with or without"
            ),
        ),
        tuple(
            (
                term.label,
                phrase("yes") if term.taken else phrase("no"),
                *lengths_with_interval(term.worth, term.low, term.high),
                (
                    term.reason
                    if term.error is None
                    else phrase("{error} {toggled}", error=mm(term.error), toggled=term.toggled)
                )
                or "",
            )
            for term in budget.terms
        ),
    )


def _suspicious(suspicious: Sequence[SuspiciousReading]) -> Iterator[Block]:
    if not suspicious:
        yield Paragraph(phrase("no reading looks wrong"))
        return
    yield suspicious_table(suspicious[:_MOST_SUSPICIOUS])
    if len(suspicious) > _MOST_SUSPICIOUS:
        left = len(suspicious) - _MOST_SUSPICIOUS
        yield Paragraph(phrase("… and {left} more (--json lists all)", left=left))
    for kept in [each for each in suspicious if not each.set_aside][:1]:
        key = f"{kept.pose}:{kept.load_case}"
        yield Paragraph(phrase("to leave one out: --exclude {key}", key=key))


def suspicious_table(suspicious: Sequence[SuspiciousReading]) -> Table:
    """Return the readings that look wrong to a robust fit, the worst first."""
    heads = phrases("Reading", "Off by", "Robust score", "Leverage", "What was done")
    rows = tuple(
        (
            phrase("pose {pose} {load_case}", pose=each.pose, load_case=each.load_case),
            mm(each.residual),
            f"{each.score:.1f}",
            f"{each.leverage:.2f}",
            phrase("set aside as a blunder") if each.set_aside else phrase("kept in the fit"),
        )
        for each in suspicious
    )
    return Table(phrase("Readings that look wrong"), heads, rows)
