"""Print what ``tool``, ``compensate``, ``stiffness``, ``export``, ``simulate-process`` found.

Results are named for type checkers only: no command imports another one's work.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import TOOL_UNKNOWNS, ToolResult
from elastocal.compensation.process import (
    DeviationComparison,
    SeedMean,
    SimulateProcessResult,
)
from elastocal.wording import plus_minus, readable

if TYPE_CHECKING:
    from elastocal.workflows import (
        ChosenStiffness,
        CompensateResult,
        ExportResult,
        ExternalAxis,
        StiffnessResult,
    )

_SHOWN = {"mass": ("kg", 1.0), "sensor": ("deg", 180.0 / np.pi), "force": ("N", 1.0)}
_SHOWN |= {"centre": ("mm", 1e3), "moment": ("N*m", 1.0)}

_AXES = ("fx", "fy", "fz", "mx", "my", "mz")
_DETERMINED = 0.75
"""Share of an entry's prior variance that is gone where the postures halve its deviation."""


def show_tool(console: Console, record: ToolResult, out: Path) -> None:
    """Print the unknowns with their intervals."""
    rotation = Rotation.from_matrix(record.R_flange_sensor).as_rotvec()
    values = [record.mass, *rotation, *record.force_bias, *record.centre, *record.moment_bias]
    table = Table("", "value", "± (95 %)", "", title=f"{record.postures} static postures")
    for name, value in zip(TOOL_UNKNOWNS, values, strict=True):
        unit, scale = _SHOWN[name.split()[0]]
        width = record.half_width[name]
        if width is None:
            table.add_row(name, "not determined", "", "")
        elif name.startswith("sensor") and record.rotation_known:
            table.add_row(name, f"{scale * value:.4g}", "as mounted", unit)
        else:
            table.add_row(name, *plus_minus(scale * value, scale * width), unit)
    console.print(table)
    scatter = [
        ("not known" if x is None else f"{x:.3g}")
        for x in (record.force_scatter, record.moment_scatter)
    ]
    console.print(f"scatter of a component: {scatter[0]} N, {scatter[1]} N*m")
    _show_tool_ladder(console, record)
    for each in record.set_aside:
        console.print(f"set aside: {each.text}")
    for note in record.notes:
        console.print(f"Note: {note}")
    if record.undetermined:
        console.print(
            f"not determined: {', '.join(record.undetermined)}. Take more postures that turn the"
            " sensor about two axes, 30 deg apart and more."
        )
    console.print(f"written to {out}")


def _show_tool_ladder(console: Console, record: ToolResult) -> None:
    """Print the models that were tried, and what is known of the sensor's matrix."""
    if record.ladder:
        table = Table("free", "force N", "moment N*m", "", title="left of unseen postures")
        for rung in record.ladder:
            taken = "taken" if rung.chosen else ""
            table.add_row(rung.free, f"{rung.force:.3g}", f"{rung.moment:.3g}", taken)
        console.print(table)
    if record.drift is not None:
        force, moment = (", ".join(f"{x:.3g}" for x in record.drift[k : k + 3]) for k in (0, 3))
        console.print(f"drift from first to last posture: {force} N; {moment} N*m")
    if record.matrix_determined is None:
        return
    shares = np.array(record.matrix_determined)
    known = [
        f"{_AXES[i]}<-{_AXES[k]}" for i in range(6) for k in range(6) if shares[i, k] > _DETERMINED
    ]
    use = "corrects readings" if record.matrix is not None else "takes the tool's weight only"
    console.print(
        f"sensor matrix: {record.matrix_rank} of 36 directions determined, the others stay at the"
        f" identity; entries that are: {', '.join(known) or 'none alone'}. It {use}."
    )


def show_compensation(console: Console, result: "CompensateResult", out: Path) -> None:
    """Print what was corrected, and what the model predicts to be left."""
    lengths = (
        ("deviation as programmed", result.deviation),
        ("left by one first-order step", result.first_order),
        ("left by this correction", result.residual),
        ("correction", result.correction),
    )
    console.print(f"{result.rows} rows corrected, predicted by the model; written to {out}")
    console.print(f"  {'tool:':30} {result.tool}", soft_wrap=True)
    for name, length in lengths:
        console.print(
            f"  {name + ':':30} {_length_left(length.mean)} mean,"
            f" {_length_left(length.max)} max ({length.at})"
        )
    if result.program:
        console.print(f"  {'program:':30} {', '.join(result.program)}", soft_wrap=True)
    for note in result.notes:
        console.print(f"Note: {note}")


def _length_left(metres: float) -> str:
    """Return a length; what no tracker sees is not told apart from nothing."""
    return "below 0.001 mm" if 0.0 < metres < 1e-6 else readable(metres, "m")


def show_export(console: Console, result: "ExportResult", with_tool: bool) -> None:
    """Print which C files were written, and what their wrenches are."""
    console.print(f"{', '.join(result.files)} written to {result.folder}")
    console.print(f"tool: {result.tool}", soft_wrap=True)
    for note in result.notes:
        console.print(f"Note: {note}", soft_wrap=True)
    console.print(f"the filters delay a slow wrench by {1e3 * result.filter_delay:.1f} ms")
    if not with_tool:
        console.print(
            "no tool file: wrenches are taken as at the tool centre point, in its axes, bias and"
            " tool weight removed"
        )


def show_stiffness(console: Console, result: "StiffnessResult") -> None:
    """Print the choices as a table, and the notes on them."""
    summary = result.summary
    table = Table("posture", title=f"stiffness along {result.along} in N/µm")
    # Of several external axes the figure shows the first; choice.csv has all.
    rail = summary.external_axes[:1]
    for name in ("softest", "mean", "spin", *(axis.name for axis in rail), "stations"):
        table.add_column(name, justify="right")
    for choice in summary.choices:
        table.add_row(choice.name, *_cells(choice, rail), str(choice.stations))
    console.print(table)
    postures = summary.postures
    refused = ", ".join(f"{count} by {what}" for what, count in postures.refused.items() if count)
    console.print(
        f"{postures.allowed} of {postures.tried} postures are allowed"
        + (f"; refused: {refused}" if refused else "")
    )
    console.print(f"tool: {summary.tool}", soft_wrap=True)
    for note in result.notes:
        console.print(f"Note: {note}")


def _cells(choice: "ChosenStiffness", rail: "tuple[ExternalAxis, ...]") -> list[str]:
    if not choice.stations:
        return ["none"] * (3 + len(rail))
    spin = "various" if choice.spin is None else f"{np.degrees(choice.spin):.0f} deg"
    numbers = [f"{1e-6 * value:.3g}" for value in (choice.softest, choice.mean)]
    stands = [
        "various" if choice.stand is None else f"{choice.stand:.3g} {axis.unit}" for axis in rail
    ]
    return [*numbers, spin, *stands]


def show_process(console: Console, result: SimulateProcessResult) -> None:
    """Print the table in mm, the other loads, the means over seeds, and the budget below it."""
    points = f"{result.lines[-1].points} points"
    title = f"{result.cell}, {result.process}: absolute deviation in mm at {points}"
    component = f", {result.direction}" if result.direction else ""
    lines = [(line.name + component, line) for line in result.lines]
    lines += [(f"{line.name}, 3-D", line) for line in result.spatial[-1:]]
    for each in result.loads:
        name = f"{each.lines[-1].name}, load {each.load:g}"
        lines += [(name + component, each.lines[-1]), (f"{name}, 3-D", each.spatial[-1])]
    if result.posture is not None:
        last = (result.posture.lines[-1], result.posture.spatial[-1])
        lines += [
            (f"programmed posture, {what}", line)
            for what, line in zip((result.direction, "3-D"), last, strict=True)
        ]
    console.print(_deviation_table(title, lines))
    if result.posture is not None:
        console.print(f"posture: {result.posture.sentence}", soft_wrap=True)
    if len(result.runs) > 1:
        console.print(_means_table(result))
    if result.preset:
        reacts = result.process_stiffness
        forces = f"react by {1e-3 * reacts:g} N/mm" if reacts else "are given, they do not react"
        console.print(f"truth: {result.preset}; forces {forces}")
    console.print(f"tool: {result.tool}", soft_wrap=True)
    if result.budget:
        budget = [(line.name, line) for line in result.budget]
        console.print(_deviation_table(f"error budget of seed {result.runs[0].seed}", budget))
    for note in result.notes:
        console.print(f"Note: {note}", soft_wrap=True)


def _means_table(result: SimulateProcessResult) -> Table:
    """Return the means over seeds with their intervals."""
    title = f"means over {len(result.runs)} seeds (95 % interval)"
    table = Table("", title=title, show_lines=True)
    for name in ("mean in mm", "reduction", "max in mm", "reduction"):
        table.add_column(name, justify="right")
    for each in result.means:
        table.add_row(
            each.title,
            f"{_length(each.mean_before)} > {_length(each.mean_after)}",
            _share(each.mean_reduction),
            f"{_length(each.max_before)} > {_length(each.max_after)}",
            _share(each.max_reduction),
        )
    return table


def _length(figure: SeedMean) -> str:
    return f"{1e3 * figure.mean:.3f}"


def _share(figure: SeedMean) -> str:
    if figure.low is None or figure.high is None:
        return f"{100 * figure.mean:.1f} %"
    return f"{100 * figure.mean:.1f} %\n({100 * figure.low:.1f} to {100 * figure.high:.1f})"


def _deviation_table(title: str, lines: Sequence[tuple[str, DeviationComparison]]) -> Table:
    """Return a table with two lines of text a line: before and after, reduction below."""
    table = Table("before > after, reduction", title=title, show_lines=True)
    for name in ("mean", "max", "st. dev."):
        table.add_column(name, justify="right", no_wrap=True)
    for name, line in lines:
        triples = zip(line.before.values, line.after.values, line.reduction.values, strict=True)
        cells = [f"{1e3 * b:.3f} > {1e3 * a:.3f}\n{100 * r:.1f} %" for b, a, r in triples]
        table.add_row(name, *cells)
    return table
