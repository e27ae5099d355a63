"""Fill the page on studies with what a campaign costs: ``<!-- cluster: table -->``, ``… plan``.

The figures stand in ``benchmarks/cluster.json``, which ``python benchmarks/cluster.py`` measures.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

FIGURES = Path(__file__).parents[2] / "benchmarks" / "cluster.json"
Run = dict[str, Any]
_MARK = re.compile(r"<!-- cluster: (table|plan) -->")
_MANY, _WORKERS = 10**6, 200
"""Campaigns and workers of the example."""
_BAND, _MINUTE, _KILO, _MEGA, _GIGA = 0.8, 60.0, 1e3, 1e6, 1e9


def on_page_markdown(markdown: str, **_: object) -> str:
    """Fill the marks in."""
    made: dict[str, Callable[[list[Run]], str]] = {"table": table, "plan": plan}
    return _MARK.sub(lambda mark: made[mark[1]](json.loads(FIGURES.read_text("utf-8"))), markdown)


def largest(runs: list[Run]) -> Run:
    """Return the run of most campaigns, the newest of them: what is quoted."""
    return max(reversed(runs), key=lambda run: run["campaigns"])


def table(runs: list[Run]) -> str:
    """Return the figures of the largest run as a table."""
    figures = largest(runs)
    memory = ((role, _memory(rows["mb"])) for role, rows in figures["memory_mb"].items())
    tables = figures["tables_bytes"]
    rows = (
        ("processor time of a worker, a campaign", _milliseconds(figures["worker_s_a_campaign"])),
        ("network, a campaign, all directions", f"{figures['bytes_a_campaign'] / _KILO:.1f} kB"),
        ("arms a task, at most", f"{figures['largest_task_samples']}"),
        ("processor time of the scheduler, a task", _milliseconds(figures["scheduler_s_a_task"])),
        ("processor time of the command, a task", _milliseconds(figures["command_s_a_task"])),
        *((f"memory of the {role.rstrip(' 12')}{', its nanny with it' * ('worker' in role)}", said)
          for role, said in memory if role != "worker 2"),
        ("finished arms on the disk", f"{figures['store_bytes'] / _MEGA:.1f} MB"),
        *((f"`{name}`", f"{size / _MEGA:.1f} MB") for name, size in tables.items()),
    )  # fmt: skip
    lines = (("what", "measured"), ("---", "---"), *rows)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def plan(runs: list[Run]) -> str:
    """Return how the figures were measured, and what follows for many workers."""
    figures = largest(runs)
    samples, campaigns = figures["samples"], figures["campaigns"]
    task = figures["largest_task_samples"] * campaigns / samples * figures["worker_s_a_campaign"]
    busiest = max(figures["scheduler_s_a_task"], figures["command_s_a_task"])
    minutes = _MANY * figures["worker_s_a_campaign"] / _WORKERS / _MINUTE
    carried = _MANY * figures["bytes_a_campaign"] / _GIGA
    tables = _MANY / campaigns * sum(figures["tables_bytes"].values()) / _GIGA
    compared = "are equal bit for bit" if figures["same_as_one_process"] else "are not equal"
    return (
        f"Measured {figures['date']}: {campaigns} campaigns ({samples} arms), a scheduler and two"
        " workers on one machine of two cores that other work shared. One worker was killed at a"
        " third and replaced, the command at two thirds and given again:"
        f" {figures['begun_twice']} arms were begun twice, those under way at a kill. The first"
        f" arms of the run and those of one process {compared} ([decision 155]"
        "(../decisions/0155-studies-on-many-workers.md) tells of a run whose arms were not, and"
        " why).\n\n"
        f"A full task takes {task:.1f} s of a worker. Per task the busier of scheduler and command"
        f" took {_milliseconds(busiest)}, all that it did while it waited counted: one of each"
        f" carries at least {_BAND * task / busiest:.0f} workers at {_BAND:.0%} of a core. On"
        f" {_WORKERS} workers 10⁶ campaigns would take {minutes:.0f} minutes beside the start, with"
        f" {carried:.1f} GB on the network and {tables:.1f} GB of tables, if one scheduler carries"
        " so many; that was not tried."
    )


def _milliseconds(duration: float) -> str:
    return f"{_KILO * duration:.0f} ms"


def _memory(mb: list[float]) -> str:
    """Return the memory after a tenth of the looks and at the last one."""
    early = mb[max(1, len(mb) // 10)]
    return f"{early:.0f} MB early, {mb[-1]:.0f} MB at the end"
