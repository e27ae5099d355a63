"""What ``elastocal compare`` shows: which springs moved, what it does, and the verdict."""

from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from elastocal.elastic import unit_of
from elastocal.identification.recertification import (
    CompareResult,
    CompareSummary,
    Estimate,
    SpringChange,
    Verdict,
)

_USUAL_UNIT = unit_of("rad/(N*m)").shown
"""Of most springs: the heading names it, other springs their own."""
_COLOURS = {Verdict.PASS: "green", Verdict.FAIL: "red", Verdict.UNDECIDED: "yellow"}


def show_comparison(console: Console, compared: CompareResult, hint: Path | None = None) -> None:
    """Print a comparison for a person.

    Parameters
    ----------
    console : Console
        Where.
    compared : CompareResult
        The comparison.
    hint : Path, optional
        A dataset that could serve as rows.
    """
    found = compared.summary
    console.print(f"[bold]{escape(found.robot)}[/bold]: {_moved(found)}")
    if found.springs:
        sums = {each.name: f"sum {n}" for n, each in enumerate(_sums(found), start=1)}
        console.print(_spring_table(found, sums))
        for name, short in sums.items():
            console.print(f"   {short}: {name}", markup=False, soft_wrap=True)
        console.print(
            f"the interval holds for all {len(found.springs)} comparisons at once with 95 %; what"
            " has 0 outside it moved",
            soft_wrap=True,
        )
    for names, which in ((found.only_old, "old"), (found.only_new, "new")):
        if names:
            console.print(
                f"only in the {which} model: {', '.join(names)}", markup=False, soft_wrap=True
            )
    if found.not_compared:
        console.print(f"not determined by both: {', '.join(found.not_compared)}", markup=False)
    if compared.rows is not None:
        console.print(f"\n{compared.rows.sentence()}", soft_wrap=True)
    _show_verdict(console, found, hint)
    for note in found.notes:
        console.print(f"[yellow]note:[/yellow] {escape(note)}", soft_wrap=True)


def _moved(found: CompareSummary) -> str:
    if found.unmoved_sentence:
        return found.unmoved_sentence
    names = ", ".join(each.label for each in found.moved_springs)
    return f"[bold red]{found.verb}[/bold red]: {escape(names)}"


def _sums(found: CompareSummary) -> list[SpringChange]:
    return [each for each in found.springs if len(each.terms) > 1]


def _spring_table(found: CompareSummary, sums: dict[str, str]) -> Table:
    """Return a row a spring; linear springs, rare, name their own unit."""
    table = Table(box=None, pad_edge=False)
    table.add_column("spring", no_wrap=True)
    headings = (
        *(f"{name}\n{_USUAL_UNIT}" for name in ("old", "new", "change")),
        "95 %, all\nat once",
    )
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    word = "moved" if found.same_springs else "differs"
    for change in found.springs:
        unit = unit_of(change.unit)
        shown = "" if unit.shown == _USUAL_UNIT else f" {unit.shown}"
        table.add_row(
            escape(sums.get(change.name, change.name)),
            f"{unit.factor * change.old.value:.4f}{shown}",
            f"{unit.factor * change.new.value:.4f}{shown}",
            f"{unit.factor * change.difference.value:+.4f}",
            _between(change.together, unit.factor),
            f"[red]{word}[/red]" if change.moved else "",
        )
    return table


def _between(estimate: Estimate, factor: float) -> str:
    return f"{factor * estimate.low:+.3f} … {factor * estimate.high:+.3f}"


def _show_verdict(console: Console, found: CompareSummary, hint: Path | None) -> None:
    if found.limit is None:
        return
    if found.verdict is None:
        asked = "give them with --rows"
        if hint is not None:
            asked += f", e.g. {hint}, which the new model states it was calibrated on"
        console.print(f"[yellow]no verdict:[/yellow] {escape(found.reason)}; {escape(asked)}",
                      soft_wrap=True)  # fmt: skip
        return
    colour = _COLOURS[found.verdict]
    console.print(
        f"[bold {colour}]{found.verdict.value}[/bold {colour}]: {escape(found.reason)}",
        soft_wrap=True,
    )
