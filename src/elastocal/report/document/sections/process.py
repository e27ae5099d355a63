"""The process path before and after correction (paper Fig. 11 and 13, Table 1)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from elastocal.compensation.process import (
    CourseDeviation,
    DeviationComparison,
    DeviationStatistics,
    SimulatedProcess,
)
from elastocal.report.document import blocks
from elastocal.report.plots import course_figure, process_maps
from elastocal.verdict import Evidence
from elastocal.wording import counted, mm


@dataclass(frozen=True)
class PublishedCase:
    """A case of the paper's Table 1, in mm and parts of 1."""

    title: str
    before: tuple[float, float, float]
    after: tuple[float, float, float]
    reduction: tuple[float, float, float]


PAPER = {
    "afp": PublishedCase(
        "Robotized AFP processing of a 3D thermoplastic aerostructure",
        (0.570, 0.956, 0.100), (0.061, 0.285, 0.046), (0.8930, 0.7019, 0.5400),
    ),
    "machining": PublishedCase(
        "Robotized roughing of an Al-7075 aerospace part",
        (0.597, 2.050, 0.725), (0.101, 0.520, 0.342), (0.8308, 0.7463, 0.5283),
    ),
}  # fmt: skip
"""Table 1 of Monsarrat et al., RCIM 2024: mean, maximum and standard deviation."""
_DEVIATIONS = {
    "afp": "Absolute value of lateral deviation",
    "machining": "Absolute value of the error normal to the part",
}
_HEADS = ("", "Mean", "Max", "St. dev.")


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    record = evidence.process
    if record is None:
        text = "No process path was run, so the effect of the correction was not verified."
        yield blocks.Paragraph(text)
        return
    yield blocks.Paragraph(
        "Simulated: the simulated robot followed the path under process forces, once as programmed"
        " and once with the online compensator of a calibrated model.", "banner",
    )  # fmt: skip
    yield from _table_1(record)
    seed = record.courses[0].seed
    yield from _pictures(
        [trace for trace in record.courses if trace.seed == seed], evidence.limits.tolerance
    )
    if record.table.budget:
        yield blocks.Details("Error budget", (_budget(record.table.budget),))
    settings = blocks.Table("Settings, SI units", ("Key", "Value"),
                     tuple(blocks.flattened(record.table.settings)), 2)  # fmt: skip
    yield blocks.Details("Settings of the compensator", (settings,))


def _table_1(record: SimulatedProcess) -> Iterator[blocks.Block]:
    deviation = _DEVIATIONS.get(record.table.process, "Absolute deviation")
    rows: list[blocks.Row] = []
    for line in record.table.lines:
        head = f"{deviation}, {line.name} ({line.points} points)"
        rows += [
            (f"{head}, without correction in mm", *_mm(line.before)),
            ("With correction in mm", *_mm(line.after)),
            ("Reduction", *(f"{share:.2%}" for share in _three(line.reduction))),
        ]
    paper = PAPER.get(record.table.process)
    if paper is not None:
        rows += [
            ("Paper, without correction in mm", *(f"{value:.3f}" for value in paper.before)),
            ("Paper, with correction in mm", *(f"{value:.3f}" for value in paper.after)),
            ("Paper, reduction", *(f"{share:.2%}" for share in paper.reduction)),
        ]
    yield blocks.Table("In the form of the paper's Table 1", _HEADS, tuple(rows))
    if paper is not None:
        yield blocks.Paragraph(
            "The paper's figures are of its real cell; those above them of the simulated one. They"
            " are set side by side for their size, not as a repetition.", "sub",
        )  # fmt: skip


def _budget(lines: tuple[DeviationComparison, ...]) -> blocks.Block:
    rows = tuple(
        (
            line.name,
            *(
                f"{1e3 * b:.3f} to {1e3 * a:.3f} ({r:.1%})"
                for b, a, r in zip(
                    _three(line.before), _three(line.after), _three(line.reduction), strict=True
                )
            ),
        )
        for line in lines
    )
    caption = "Error budget of the first seed, before to after in mm (reduction)"
    return blocks.Table(caption, _HEADS, rows)


def _pictures(traces: list[CourseDeviation], tolerance: float | None) -> Iterator[blocks.Block]:
    worst = max(traces, key=lambda trace: float(np.abs(trace.before).max()))
    before, after = (
        np.concatenate([getattr(t, key) for t in traces]) for key in ("before", "after")
    )
    text = (
        f"mean {mm(float(np.abs(before).mean()))} without and {mm(float(np.abs(after).mean()))}"
        f" with correction, over {counted(len(traces), 'course')}"
    )
    yield blocks.picture(
        partial(process_maps, traces),
        f"Two maps of the path, coloured by absolute deviation: {text}",
        f"After the paper's Fig. 11e, 11f and 13b, 13c, in the plane that fits the path best:"
        f" {text}.", ".png",
    )  # fmt: skip
    yield blocks.picture(
        partial(course_figure, worst, tolerance),
        f"Deviation over time of course {worst.course}, without and with correction",
        f"After the paper's Fig. 11g: the course with the largest deviation, {worst.course}.",
    )


def _three(values: DeviationStatistics) -> tuple[float, float, float]:
    return values.mean, values.max, values.standard_deviation


def _mm(values: DeviationStatistics) -> tuple[str, ...]:
    return tuple(f"{1e3 * value:.3f}" for value in _three(values))


PROCESS = blocks.Section("process", "The process path, before and after", 70, _body)
