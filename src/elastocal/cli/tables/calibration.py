"""Print what ``calibrate`` and ``report`` found: a user's questions, in their order.

How well does it fit; is it better than simpler models; which springs are really known, and how
well; which readings look wrong.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from elastocal.cli.output import bold, dim, green, print_remarks, red, yellow
from elastocal.elastic import Unit, unit_of
from elastocal.identification import (
    AUTO,
    CalibrateResult,
    CalibrationSummary,
    Coverage,
    ErrorBudget,
    FrameSummary,
    SpringSummary,
    SuspiciousReading,
    describe_briefly,
    ladder_sentence,
)
from elastocal.wording import (
    counted,
    lengths_with_interval,
    mm,
    springs_and_parameters,
)

if TYPE_CHECKING:
    from elastocal.workflows import ReportResult

_USUAL_UNIT = unit_of("rad/(N*m)")
"""The unit of most springs stands in the headings; other springs name their own."""
_MOST_SUSPICIOUS = 10


def show_calibration(console: Console, result: CalibrateResult, out: Path) -> None:
    """Print the figures of a calibration for a person."""
    figures = result.calibration
    if figures is not None:
        _show_figures(console, figures)
    console.print(f"\nmodel written to {bold(str(out))}")


def _show_figures(console: Console, figures: CalibrationSummary) -> None:
    _show_fit(console, figures)
    _show_ladder(console, figures)
    console.print()
    console.print(_spring_table(figures))
    _show_groups(console, figures)
    _show_frames(console, figures.frames)
    _show_budget(console, figures.budget)
    _show_suspicious(console, figures.suspicious)
    print_remarks(console, "warning", figures.warnings)


def _show_fit(console: Console, figures: CalibrationSummary) -> None:
    mean, peak = figures.deflection.mean, figures.deflection.max
    fit, held_out = figures.residual, figures.held_out
    console.print(
        f"{bold(figures.robot)}: {_springs(figures)},"
        f" {figures.readings} readings at {figures.poses} poses,"
        f" measured deflection {mm(mean)} mean, {mm(peak)} max"
    )
    table = Table(box=None, pad_edge=False)
    for heading in ("error norm", "mean", "of deflection", "95 %", "max"):
        table.add_column(heading, justify="left" if heading == "error norm" else "right")
    table.add_row(
        f"at left-out poses ({held_out.folds} refits)",
        bold(mm(held_out.mean)),
        f"{held_out.mean / mean:.2%}",
        "" if held_out.p95 is None else mm(held_out.p95),
        mm(held_out.max),
    )
    table.add_row(
        "at the poses fitted", mm(fit.mean), f"{fit.mean / mean:.2%}", mm(fit.p95), mm(fit.max)
    )
    if (check := figures.check) is not None:
        label = f"at {', '.join(check.load_cases)}, not fitted"
        share = check.mean / check.deflection
        table.add_row(label, mm(check.mean), f"{share:.2%}", mm(check.p95), mm(check.max))
        table.add_row("noise there", "not known" if check.noise is None else mm(check.noise))
    console.print(table)
    if figures.coverage is not None:
        console.print(_coverage_line(figures.coverage), soft_wrap=True)
    if figures.production:
        console.print(figures.production.sentence(), soft_wrap=True)


def _coverage_line(coverage: Coverage) -> str:
    measured, fit = coverage.measurement, coverage.fit
    inside = f"not known: {measured.reason}"
    if measured.share is not None:
        inside = (
            f"{measured.share:.1%} of {measured.count} components at left-out poses lay inside"
            f" ({measured.nominal:.0%} should)"
        )
    return (
        f"interval of a measurement: {inside}; interval of the fit: coverage not known"
        f" ({fit.reason})"
    )


def _springs(figures: CalibrationSummary) -> str:
    count = figures.springs_total if figures.spring_count is None else figures.spring_count
    return springs_and_parameters(count, figures.springs_total)


def _show_ladder(console: Console, figures: CalibrationSummary) -> None:
    """Print the models that were tried, the one that was taken, and why."""
    ladder = figures.ladder
    if len(ladder) < 2:
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("springs", "numbers", "at left-out poses", "worse than the best by", ""):
        table.add_column(heading, justify="left" if heading in ("springs", "") else "right")
    for rung in ladder:
        mean, low, high = (
            1e6 * value
            for value in (rung.difference.mean, rung.difference.low, rung.difference.high)
        )
        worse = f"{mean:.1f} µm ({low:.1f} to {high:.1f})" if low != high else ""
        table.add_row(
            rung.springs,
            str(rung.parameters),
            mm(rung.held_out),
            worse,
            bold("taken") if rung.chosen else "",
        )
    console.print(table)
    if figures.settings is not None and figures.settings.springs == AUTO:
        console.print(ladder_sentence(ladder))


def _show_frames(console: Console, frames: Sequence[FrameSummary]) -> None:
    """Print the frames that were estimated with the springs, each number with its interval."""
    if not frames:
        return
    table = Table("frame of", "against its references", box=None, pad_edge=False)
    for axis in "xyz":
        table.add_column(axis, justify="right", no_wrap=True)
    for frame in frames:
        parts = (
            ("tracker shift, µm", frame.translation, frame.half_width[:3]),
            ("tracker turn, µrad", frame.rotation, frame.half_width[3:6]),
            ("marker in tcp frame, µm", frame.marker, frame.half_width[6:]),
        )
        for name, (what, part, half) in zip((frame.name, "", ""), parts, strict=True):
            numbers = zip(part, half, strict=True)
            table.add_row(name, what, *(f"{1e6 * x:.0f} ±{1e6 * h:.0f}" for x, h in numbers))
    console.print(table)


def _show_budget(console: Console, budget: ErrorBudget | None) -> None:
    """Print what the error is made of, and what each term takes from it."""
    if budget is None:
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("error budget", "rms", "95 %", "known from"):
        table.add_column(heading, justify="right" if heading in ("rms", "95 %") else "left")
    for name, part in budget.parts:
        value, span = lengths_with_interval(part.error, part.low, part.high)
        table.add_row(name, value, span, part.source)
    console.print()
    console.print(table)
    terms = Table(box=None, pad_edge=False)
    for heading in ("term", "taken", "takes away", "95 %", "error"):
        terms.add_column(heading, justify="left" if heading == "term" else "right")
    for term in budget.terms:
        value, span = lengths_with_interval(term.worth, term.low, term.high)
        other = "" if term.error is None else f"{mm(term.error)} {term.toggled}"
        terms.add_row(term.label, "yes" if term.taken else "no", value, span, other or term.reason)
    console.print(terms)


def _spring_table(figures: CalibrationSummary) -> Table:
    """Return a row a spring; linear springs, rare, name their own units."""
    table = Table(box=None, pad_edge=False)
    # Where the terminal is narrow, words fold; a number that is cut would be another number.
    table.add_column("spring", overflow="fold")
    table.add_column(f"compliance\n{_USUAL_UNIT.shown}", justify="right", no_wrap=True)
    table.add_column("95 %\ninterval", justify="right", no_wrap=True)
    table.add_column(f"stiffness\n{_USUAL_UNIT.stiffness}", justify="right", no_wrap=True)
    table.add_column("known?", overflow="fold")
    above = ""
    for spring in figures.springs:
        # What a gear amounts to at its torque stands under its first row, without the name again.
        further = bool(above) and spring.name.startswith(f"{above} ")
        name = spring.name.removeprefix(above) if further else spring.name
        above = above if further else spring.name
        table.add_row(f" {name}" if further else name, *_spring_row(spring))
    return table


def _spring_row(spring: SpringSummary) -> tuple[str, ...]:
    """Return the cells of a spring behind its name."""
    shown = unit_of(spring.unit)
    values = (spring.compliance, spring.low, spring.high)
    value, low, high = (shown.factor * each for each in values)
    unit = "" if shown == _USUAL_UNIT else f" {shown.shown}"
    if spring.too_weak:
        note = yellow("too weak to see")
        return dim(f"({value:.4f}{unit})"), "", "", note
    if not spring.observable:
        note = yellow(f"in group {spring.group}")
        return dim(f"({value:.4f}{unit})"), "", "", note
    return (
        f"{value:.4f}{unit}",
        f"{low:.3f} … {high:.3f}",
        _stiffness(value, shown),
        _known(value, low, high, spring.at_bound) + (", prior" if spring.prior else ""),
    )


def _stiffness(value: float, unit: Unit) -> str:
    if not value > 0.0:
        return "rigid" if value == 0.0 else ""
    name = "" if unit == _USUAL_UNIT else f" {unit.stiffness}"
    return f"{1.0 / value:.3f}{name}" if unit.stiffness else ""


def _known(value: float, low: float, high: float, at_bound: bool) -> str:
    if at_bound:
        open_end = f"above {low:.3f}" if low < value else "at bound"
        return yellow(f"below {high:.3f}" if high > value else open_end)
    if value == 0.0:
        return ""
    relative = (high - low) / 2.0 / abs(value)
    colour = green if relative < 0.2 else yellow if relative < 0.5 else red
    return colour(f"±{relative:.0%}")


def _show_groups(console: Console, figures: CalibrationSummary) -> None:
    weak = sum(spring.too_weak for spring in figures.springs)
    if weak:
        console.print(
            f"{counted(weak, 'spring')} too weak to see: a sensible value deflects the arm by less"
            " than the noise of the readings hides",
            soft_wrap=True,
        )
    if not figures.unobservable:
        every = "" if weak else "every spring is observable; "
        if figures.rank < figures.springs_total:
            every = (
                f"rank {figures.rank} of {figures.springs_total}: what the readings leave open,"
                " the bounds of the springs settle; "
            )
        console.print(f"{every}condition number {_number(figures.condition)}", soft_wrap=True)
        return
    missing = figures.rank_attainable - figures.rank
    meaning = (
        "these combinations change no deflection under a force, so their springs have no value of"
        " their own; predictions do not need one"
        if missing <= 0
        else f"{missing} more directions could be seen with other poses or load cases, so not all"
        " of these combinations are harmless"
    )
    console.print(
        f"\nrank {figures.rank} of {figures.springs_total} (condition number"
        f" {_number(figures.condition)}): {meaning}"
    )
    for number, group in enumerate(figures.unobservable, start=1):
        console.print(f"   group {number}, not by itself: {describe_briefly(group)}")


def _number(condition: float) -> str:
    """Return a condition number: its last digits mean nothing."""
    return f"{float(f'{condition:.3g}'):.0f}"


def _show_suspicious(console: Console, suspicious: tuple[SuspiciousReading, ...]) -> None:
    if not suspicious:
        console.print("no reading looks wrong")
        return
    many = "reading looks" if len(suspicious) == 1 else "readings look"
    console.print(f"\n{yellow(f'{len(suspicious)} {many} wrong')} (robust score):")
    for reading in suspicious[:_MOST_SUSPICIOUS]:
        note = f" {red('set aside as a blunder')}" if reading.set_aside else ""
        off = mm(reading.residual)
        console.print(
            f"   pose {reading.pose} {reading.load_case}: {off} off,"
            f" score {reading.score:.1f}{note}"
        )
    if len(suspicious) > _MOST_SUSPICIOUS:
        console.print(f"   … and {len(suspicious) - _MOST_SUSPICIOUS} more (--json lists all)")
    first = suspicious[0]
    console.print(f"   to leave one out: --exclude {first.pose}:{first.load_case}")


def show_report(console: Console, result: "ReportResult") -> None:
    """Print the verdict of a report."""
    verdict = result.verdict
    console.print(f"{bold(verdict.word)}{result.light}: {verdict.meaning} {verdict.sentence}")
    for reason in verdict.reasons:
        console.print(f"   {reason}")
    console.print(f"written to {result.files}")
