"""Fill pages with Table 1 over truths and seeds: ``<!-- process table: afp -->``.

The figures stand in ``gallery/process_figures.json``, which ``python -m gallery.process_figures``
writes; the paper's row comes from the report's own copy of it.
"""

import json
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.pages import Page

from elastocal.report.document.sections.process import PAPER

_QUOTED = Path(__file__).parent / "gallery" / "process_figures.json"
_MARK = re.compile(r"<!-- process table: (\S+) -->")
_HEAD = ("truth", "springs", "deviation", "mean, mm", "reduction", "max, mm", "reduction")


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:  # noqa: ARG001 (mkdocs')
    """Return the page with the tables in place of their marks."""
    return _MARK.sub(lambda mark: _table(mark[1]), markdown)


def _table(kind: str) -> str:
    cases = json.loads(_QUOTED.read_text(encoding="utf-8"))
    rows = [
        (case["preset"], f"`{case['springs']}`", *_measured(means))
        for case in cases
        if case["kind"] == kind
        for means in case["means"]
    ]
    seeds = sorted({m["seeds"] for case in cases if case["kind"] == kind for m in case["means"]})
    table = "\n".join("| " + " | ".join(row) + " |" for row in (_HEAD, ("---",) * 7, *rows))
    paper = PAPER[kind]
    return (
        f"{table}\n| paper | 18 springs | Table 1 | {paper.before[0]:.3f} → {paper.after[0]:.3f} |"
        f" {paper.reduction[0]:.2%} | {paper.before[1]:.3f} → {paper.after[1]:.3f} |"
        f" {paper.reduction[1]:.2%} |\n\n{_over(seeds)} {paper.measures}"
    )


def _over(seeds: list[int]) -> str:
    """Return how many seeds the figures are of."""
    if seeds == [1]:
        return "A single seed: there is no interval, and another seed has other figures."
    return (
        f"Means over {' or '.join(map(str, seeds))} seeds, in brackets their 95 % interval"
        " (Student's t)."
    )


def _measured(means: dict[str, Any]) -> tuple[str, ...]:
    load = "" if means["load"] == 1.0 else f", load {means['load']:g}"
    cells = [f"{means['name']}{load}"]
    for part in ("mean", "max"):
        before, after = (1e3 * means[f"{part}_{side}"]["mean"] for side in ("before", "after"))
        share = means[f"{part}_reduction"]
        span = "" if share["low"] is None else f" ({share['low']:.1%} to {share['high']:.1%})"
        cells += [f"{before:.3f} → {after:.3f}", f"{share['mean']:.1%}{span}"]
    return tuple(cells)
