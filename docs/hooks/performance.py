"""Fill the page on performance: ``<!-- benchmarks -->`` becomes the newest of every figure.

``make bench`` appends them to ``benchmarks/history.csv``, each with its reference of the same run.
"""

import csv
from pathlib import Path

HISTORY = Path(__file__).parents[2] / "benchmarks" / "history.csv"
_MARK = "<!-- benchmarks -->"
_HEAD = ("figure", "measured", "reference in the same run", "ratio", "asked")
_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


def on_page_markdown(markdown: str, **_: object) -> str:
    """Fill the table in."""
    return markdown.replace(_MARK, table()) if _MARK in markdown else markdown


def table() -> str:
    """Return the newest of every figure, in the order in which figures first appeared."""
    newest: dict[str, dict[str, str]] = {}
    with HISTORY.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            newest[row["figure"]] = row
    lines = [_HEAD, ("---",) * len(_HEAD), *map(_cells, newest.values())]
    days = sorted({row["date"] for row in newest.values()})
    when = days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"
    rows = [f"| {' | '.join(line)} |" for line in lines]
    return "\n".join((*rows, "", f"Measured {when}."))


def _cells(row: dict[str, str]) -> tuple[str, ...]:
    taken, asked = float(row["seconds"]), row["aim_seconds"]
    reference, other, ratio = row["reference"], row["reference_seconds"], ""
    if other:
        reference = f"{reference}, {_shown(float(other))}"
        times = float(other) / taken
        ratio = f"{times:.3g}" if times >= 1.0 else f"1/{1.0 / times:.3g}"
    if asked:
        asked = _shown(float(asked)) + ("" if taken <= float(asked) else ": **short**")
    return row["figure"], _shown(taken), reference, ratio, asked


def _shown(duration: float) -> str:
    factor, unit = next((each for each in _UNITS if duration >= each[0]), _UNITS[-1])
    return f"{duration / factor:.3g} {unit}"
