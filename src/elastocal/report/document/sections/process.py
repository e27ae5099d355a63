"""The process path before and after correction (paper Fig. 11 and 13, Table 1)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from elastocal.compensation.process import (
    CourseDeviation,
    DeviationComparison,
    DeviationStatistics,
    SeedMean,
    SeedMeans,
    SimulatedProcess,
    SimulateProcessResult,
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
    measures: str
    """What its figures hold, in a sentence."""


PAPER = {
    "afp": PublishedCase(
        "Robotized AFP processing of a 3D thermoplastic aerostructure",
        (0.570, 0.956, 0.100), (0.061, 0.285, 0.046), (0.8930, 0.7019, 0.5400),
        "The paper measures the side deviation of the head by a 6D probe on the real machine: what"
        " is left there holds backlash, dynamics and servo errors beside what the model misses.",
    ),
    "machining": PublishedCase(
        "Robotized roughing of an Al-7075 aerospace part",
        (0.597, 2.050, 0.725), (0.101, 0.520, 0.342), (0.8308, 0.7463, 0.5283),
        "The paper scans the part: before and after hold geometry, cutter, fixture and dynamics"
        " beside the elastic deviation, which is all that is simulated here.",
    ),
}  # fmt: skip
"""Table 1 of Monsarrat et al., RCIM 2024: mean, maximum and standard deviation."""
_DEVIATIONS = {
    "afp": "Absolute value of lateral deviation",
    "machining": "Absolute value of the error normal to the part",
}
_SIDE_BY_SIDE = (
    "The paper's figures are of its real cell, those above them of the simulated one, which counts"
    " the path under force against the same path in the air: elastic deviation and what friction,"
    " delay and sensor leave of it. They stand side by side for their size, not as a repetition;"
    " that a seed's deviation without correction is near the paper's is chance."
)
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
    table, rows = record.table, list[blocks.Row]()
    deviation = _DEVIATIONS.get(table.process, f"Absolute deviation, {table.direction}")
    named = [(f"{deviation}, {line.name}", line) for line in table.lines]
    named += [(f"3-D deviation, {line.name}", line) for line in table.spatial[-1:]]
    for each in table.loads:
        text = f"at {each.load:g} of the load, {each.lines[-1].name}"
        named += [(f"{deviation} {text}", each.lines[-1])]
        named += [(f"3-D deviation {text}", each.spatial[-1])]
    if table.posture is not None:
        text = "in the programmed posture"
        named += [(f"{deviation} {text}", table.posture.lines[-1])]
        named += [(f"3-D deviation {text}", table.posture.spatial[-1])]
    for name, line in named:
        rows += [
            (f"{name} ({line.points} points), without correction in mm", *_mm(line.before)),
            ("With correction in mm", *_mm(line.after)),
            ("Reduction", *(f"{share:.2%}" for share in _three(line.reduction))),
        ]
    paper = PAPER.get(table.process)
    if paper is not None:
        rows += [
            ("Paper, without correction in mm", *(f"{value:.3f}" for value in paper.before)),
            ("Paper, with correction in mm", *(f"{value:.3f}" for value in paper.after)),
            ("Paper, reduction", *(f"{share:.2%}" for share in paper.reduction)),
        ]
    yield blocks.Table("In the form of the paper's Table 1", _HEADS, tuple(rows))
    if len(table.runs) > 1 and table.means:
        yield _means(table.means)
    if paper is not None:
        yield blocks.Paragraph(f"{_SIDE_BY_SIDE} {paper.measures}", "sub")
    if table.posture is not None:
        yield blocks.Paragraph(f"Posture (paper 4.3.1): {table.posture.sentence}.", "sub")
    for note in (*_truth(table), *table.notes):
        yield blocks.Paragraph(note, "sub")


def _means(means: tuple[SeedMeans, ...]) -> blocks.Block:
    heads = ("", "Mean, before to after in mm", "Reduction", "Max, before to after in mm",
             "Reduction")  # fmt: skip
    rows = tuple(
        (
            each.title,
            f"{1e3 * each.mean_before.mean:.3f} to {1e3 * each.mean_after.mean:.3f}",
            _with_interval(each.mean_reduction),
            f"{1e3 * each.max_before.mean:.3f} to {1e3 * each.max_after.mean:.3f}",
            _with_interval(each.max_reduction),
        )
        for each in means
    )
    caption = f"Means over {means[0].seeds} seeds, 95 % interval (Student's t over the seeds)"
    return blocks.Table(caption, heads, rows)


def _with_interval(figure: SeedMean) -> str:
    if figure.low is None or figure.high is None:
        return f"{figure.mean:.1%}"
    return f"{figure.mean:.1%} ({figure.low:.1%} to {figure.high:.1%})"


def _truth(table: SimulateProcessResult) -> Iterator[str]:
    """Yield how hard the truth was, where the file says it."""
    if not table.preset:
        return
    reacts = table.process_stiffness
    forces = (
        "process forces react to the tool's shift along the surface's normal, by"
        f" {1e-3 * reacts:g} N/mm"
        if reacts
        else "process forces are given, they do not react to the tool's shift"
    )
    yield f"Truth of the simulated cell: preset {table.preset}; {forces}."


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
