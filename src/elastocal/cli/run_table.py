"""What `elastocal run` shows: the steps beforehand, the figures afterwards."""

from collections import Counter
from typing import Any

from rich.console import Console
from rich.table import Table

from elastocal.cli.run_session import Prepared
from elastocal.procedure.entries import Event
from elastocal.procedure.itinerary import itinerary
from elastocal.procedure.job import End, Result
from elastocal.procedure.journal import commits, read_journal


def dry_figures(job: Prepared) -> dict[str, Any]:
    """Return the steps of a run as JSON data."""
    steps = itinerary(job.plan, job.settings)
    return {
        "poses": len(job.plan.poses),
        "load_cases": [name for name, _ in job.settings.loads],
        "force_limit": job.settings.force_limit,
        "seconds": sum(step.seconds for step in steps),
        "steps": [
            {
                "pose": step.pose,
                "step": step.step.value,
                "what": step.what,
                "seconds": round(step.seconds, 3),
            }
            for step in steps
        ],
    }


def show_itinerary(console: Console, job: Prepared) -> None:
    """Print the steps of a run with their times."""
    table = Table("pose", "step", "what", "s", "until", box=None, pad_edge=False)
    total = 0.0
    for step in itinerary(job.plan, job.settings):
        total += step.seconds
        pose = "" if step.pose is None else str(step.pose)
        table.add_row(pose, step.step.value, step.what, f"{step.seconds:.1f}", f"{total:.0f}")
    console.print(table)
    console.print(
        f"{len(job.plan.poses)} poses, {len(job.settings.loads)} load cases,"
        f" about {total / 60.0:.0f} min; force limit {job.settings.force_limit:.0f} N."
        " Nothing was moved.",
        soft_wrap=True,
    )


def figures(job: Prepared, result: Result) -> dict[str, Any]:
    """Return the key figures of a run as JSON data."""
    entries = read_journal(job.folder.journal)
    logs = commits(entries)
    statuses = Counter(
        window.status.value
        for log in logs
        for window in log.windows
        if window.load_case is not None
    )
    return {
        "run": str(job.folder.path),
        "state": result.end.value,
        "arm": result.stand.value,
        "message": result.message,
        "poses": len(job.plan.poses),
        "committed": len(logs),
        "given_up": list(result.given_up),
        "readings": dict(statuses),
        "failed_attempts": sum(entry.event is Event.FAULT for entry in entries),
        "seconds": entries[-1].time - entries[0].time,
        "dataset": str(job.folder.dataset) if result.end is End.DONE else None,
    }


def show_result(console: Console, job: Prepared, result: Result) -> None:
    """Print how a run ended."""
    found = figures(job, result)
    readings = ", ".join(f"{count} {status}" for status, count in found["readings"].items())
    console.print(
        f"{result.end.value}: {found['committed']} of {found['poses']} poses committed"
        f" ({readings or 'no readings'}), {found['seconds'] / 60.0:.1f} min,"
        f" failed attempts: {found['failed_attempts']}; the arm is {result.stand.value}",
        soft_wrap=True,
    )
    if result.message:
        console.print(result.message, soft_wrap=True, markup=False)
    if found["dataset"]:
        console.print(
            f"wrote [bold]{job.folder.dataset}[/bold] and {job.folder.summary.name}:"
            f" `elastocal calibrate {job.folder.dataset} --out model.json`",
            soft_wrap=True,
        )
