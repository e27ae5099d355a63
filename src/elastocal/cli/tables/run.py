"""What `elastocal run` shows: the steps beforehand, the figures afterwards."""

from rich.console import Console
from rich.table import Table

from elastocal.records import record
from elastocal.workflows import DryRunResult, RunResult


@record()
class PlannedStepFigures:
    """A step of ``run --dry-run --json``."""

    pose: int | None
    step: str
    what: str
    seconds: float


@record()
class DryRunFigures:
    """The figures of ``run --dry-run --json``."""

    poses: int
    load_cases: tuple[str, ...]
    force_limit: float
    seconds: float
    warnings: tuple[str, ...]
    steps: tuple[PlannedStepFigures, ...]


def dry_figures(found: DryRunResult) -> DryRunFigures:
    """Return the steps of a run as its record."""
    return DryRunFigures(
        poses=found.poses,
        load_cases=found.load_cases,
        force_limit=found.force_limit,
        seconds=found.seconds,
        warnings=found.warnings,
        steps=tuple(
            PlannedStepFigures(step.pose, step.step.value, step.what, round(step.seconds, 3))
            for step in found.steps
        ),
    )


def show_itinerary(console: Console, found: DryRunResult) -> None:
    """Print the steps of a run with their times."""
    table = Table("pose", "step", "what", "s", "until", box=None, pad_edge=False)
    total = 0.0
    for step in found.steps:
        total += step.seconds
        pose = "" if step.pose is None else str(step.pose)
        table.add_row(pose, step.step.value, step.what, f"{step.seconds:.1f}", f"{total:.0f}")
    console.print(table)
    console.print(
        f"{found.poses} poses, {len(found.load_cases)} load cases,"
        f" about {total / 60.0:.0f} min; force limit {found.force_limit:.0f} N."
        " Nothing was moved.",
        soft_wrap=True,
    )
    for warning in found.warnings:
        console.print(f"warning: {warning}", soft_wrap=True, markup=False)


def show_run(console: Console, result: RunResult) -> None:
    """Print how a run ended."""
    found = result.figures
    derived = "" if found.dataset else ", not derived"
    console.print(
        f"{found.state}: {found.committed} of {found.poses} poses committed"
        f" ({found.counts() or 'no readings'}{derived}),"
        f" {found.seconds / 60.0:.1f} min,"
        f" failed attempts: {found.failed_attempts}; the arm is {found.arm}",
        soft_wrap=True,
    )
    if found.message:
        console.print(found.message, soft_wrap=True, markup=False)
    if found.dataset:
        for warning in found.warnings:
            console.print(f"warning: {warning}", soft_wrap=True, markup=False)
        console.print(
            f"wrote [bold]{found.dataset}[/bold] and summary.json:"
            f" `elastocal calibrate {found.dataset} --out model.json`",
            soft_wrap=True,
        )
