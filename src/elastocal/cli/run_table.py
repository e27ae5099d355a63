"""What `elastocal run` shows: the steps beforehand, the figures afterwards."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from elastocal.cli.run_session import Finished, Prepared
from elastocal.procedure import Event, PoseLog, commits, itinerary, read_journal


def dry_figures(job: Prepared) -> dict[str, Any]:
    """Return the steps of a run as JSON data."""
    steps = itinerary(job.plan, job.settings)
    return {
        "poses": len(job.plan.poses),
        "load_cases": [name for name, _ in job.settings.loads],
        "force_limit": job.settings.force_limit,
        "seconds": sum(step.seconds for step in steps),
        "warnings": list(job.warnings),
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
    for warning in job.warnings:
        console.print(f"warning: {warning}", soft_wrap=True, markup=False)


def figures(job: Prepared, finished: Finished) -> dict[str, Any]:
    """Return the key figures of a run as JSON data."""
    entries, result, summary = read_journal(job.folder.journal), finished.result, finished.summary
    return {
        "run": str(job.folder.path),
        "state": result.end.value,
        "arm": result.location.value,
        "message": result.message,
        "poses": len(job.plan.poses),
        "committed": len(commits(entries)),
        "given_up": list(result.given_up),
        "readings": _readings(summary, commits(entries)),
        "failed_attempts": sum(entry.event is Event.FAULT for entry in entries),
        "seconds": entries[-1].time - entries[0].time,
        "dataset": str(job.folder.dataset) if summary is not None else None,
        "warnings": list(job.warnings if summary is None else summary["warnings"]),
        "problem": str(finished.problem) if finished.problem is not None else None,
    }


def _readings(summary: Mapping[str, Any] | None, logs: Sequence[PoseLog]) -> dict[str, int]:
    """Return the number of readings by status, as derived; else as the journal has them."""
    if summary is not None:
        return {status: n for status, n in summary["readings"]["counts"].items() if n}
    windows = [window for log in logs for window in log.windows if window.load_case is not None]
    return dict(Counter(window.status.value for window in windows))


def show_result(console: Console, job: Prepared, finished: Finished) -> None:
    """Print how a run ended."""
    found, result = figures(job, finished), finished.result
    readings = ", ".join(f"{count} {status}" for status, count in found["readings"].items())
    console.print(
        f"{result.end.value}: {found['committed']} of {found['poses']} poses committed"
        f" ({readings or 'no readings'}{'' if finished.summary else ', not derived'}),"
        f" {found['seconds'] / 60.0:.1f} min,"
        f" failed attempts: {found['failed_attempts']}; the arm is {result.location.value}",
        soft_wrap=True,
    )
    if result.message:
        console.print(result.message, soft_wrap=True, markup=False)
    if finished.summary is not None:
        for warning in found["warnings"]:
            console.print(f"warning: {warning}", soft_wrap=True, markup=False)
    if found["dataset"]:
        console.print(
            f"wrote [bold]{job.folder.dataset}[/bold] and {job.folder.summary.name}:"
            f" `elastocal calibrate {job.folder.dataset} --out model.json`",
            soft_wrap=True,
        )
