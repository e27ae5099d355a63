"""The process path before and after correction (paper Fig. 11 and 13, Table 1)."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from elastocal import blocks
from elastocal.compensation.process import (
    CourseDeviation,
    DeviationComparison,
    DeviationStatistics,
    SeedMean,
    SeedMeans,
    SimulatedProcess,
    SimulateProcessResult,
)
from elastocal.report.document.section import Section, flattened
from elastocal.report.plots import course_figure, process_maps
from elastocal.units import in_unit
from elastocal.verdict import Evidence, has_own_process
from elastocal.wording import Phrase, counted, mm, phrase, phrases, sentences


@dataclass(frozen=True)
class PublishedCase:
    """A case of the paper's Table 1, in mm and parts of 1."""

    title: str
    before: tuple[float, float, float]
    after: tuple[float, float, float]
    reduction: tuple[float, float, float]
    measures: Phrase
    """What its figures hold, in a sentence."""


PAPER = {
    "afp": PublishedCase(
        "Robotized AFP processing of a 3D thermoplastic aerostructure",
        (0.570, 0.956, 0.100), (0.061, 0.285, 0.046), (0.8930, 0.7019, 0.5400),
        phrase(
            "The paper measures the side deviation of the head by a 6D probe on the real machine:"
            " what is left there holds backlash, dynamics and servo errors beside what the model"
            " misses."
        ),
    ),
    "machining": PublishedCase(
        "Robotized roughing of an Al-7075 aerospace part",
        (0.597, 2.050, 0.725), (0.101, 0.520, 0.342), (0.8308, 0.7463, 0.5283),
        phrase(
            "The paper scans the part: before and after hold geometry, cutter, fixture and dynamics"
            " beside the elastic deviation, which is all that is simulated here."
        ),
    ),
}  # fmt: skip
"""Table 1 of Monsarrat et al., RCIM 2024: mean, maximum and standard deviation."""
_DEVIATIONS = {
    "afp": phrase("Absolute value of lateral deviation"),
    "machining": phrase("Absolute value of the error normal to the part"),
}
_SIDE_BY_SIDE = phrase(
    "The paper's figures are of its real cell, those above them of the simulated one, which counts"
    " the path under force against the same path in the air: elastic deviation and what friction,"
    " delay and sensor leave of it. They stand side by side for their size, not as a repetition;"
    " that a seed's deviation without correction is near the paper's is chance."
)
_HEADS = ("", *phrases("Mean", "Max", "St. dev."))


def _body(evidence: Evidence) -> Iterator[blocks.Block]:
    record = evidence.process
    if record is None:
        text = phrase("No process path was run, so the effect of the correction was not verified.")
        yield blocks.Paragraph(text)
        return
    yield blocks.Paragraph(
        phrase(
            "Simulated, and no evidence for a real cell: the simulated robot followed the path"
            " under process forces, once as programmed and once with the online compensator of a"
            " calibrated model."
        ),
        "banner",
    )
    if not has_own_process(evidence):
        yield blocks.Paragraph(
            phrase("Not valid for this report: the process is of another model, tool or run."),
            "banner",
        )
    yield from _table_1(record)
    seed = record.courses[0].seed
    yield from _pictures(
        [trace for trace in record.courses if trace.seed == seed], evidence.limits.tolerance
    )
    if record.table.budget:
        yield blocks.Details(phrase("Error budget"), (_budget(record.table.budget),))
    rows = tuple(flattened(record.table.settings))
    settings = blocks.Table(phrase("Settings, SI units"), phrases("Key", "Value"), rows, 2)
    yield blocks.Details(phrase("Settings of the compensator"), (settings,))


def _table_1(record: SimulatedProcess) -> Iterator[blocks.Block]:
    table, rows = record.table, list[blocks.Row]()
    deviation = _DEVIATIONS.get(
        table.process, phrase("Absolute deviation, {direction}", direction=table.direction)
    )
    spatial = phrase("3-D deviation")
    named = [(deviation, line.name, line) for line in table.lines]
    named += [(spatial, line.name, line) for line in table.spatial[-1:]]
    for each in table.loads:
        text = phrase(
            "at {load} of the load, {name}", load=f"{each.load:g}", name=each.lines[-1].name
        )
        named += [(deviation, text, each.lines[-1]), (spatial, text, each.spatial[-1])]
    if table.posture is not None:
        text = phrase("in the programmed posture")
        named += [(deviation, text, table.posture.lines[-1])]
        named += [(spatial, text, table.posture.spatial[-1])]
    for what, name, line in named:
        title = phrase(
            "{what}, {name} ({points} points), without correction in mm",
            what=what,
            name=name,
            points=line.points,
        )
        rows += [
            (title, *_mm(line.before)),
            (phrase("With correction in mm"), *_mm(line.after)),
            (phrase("Reduction"), *(f"{share:.2%}" for share in _three(line.reduction))),
        ]
    paper = PAPER.get(table.process)
    if paper is not None:
        rows += [
            (
                phrase("Paper, without correction in mm"),
                *(f"{value:.3f}" for value in paper.before),
            ),
            (phrase("Paper, with correction in mm"), *(f"{value:.3f}" for value in paper.after)),
            (phrase("Paper, reduction"), *(f"{share:.2%}" for share in paper.reduction)),
        ]
    yield blocks.Table(_title(paper), _HEADS, tuple(rows))
    if len(table.runs) > 1 and table.means:
        yield _means(table.means)
    if paper is not None:
        yield blocks.Paragraph(sentences([_SIDE_BY_SIDE, paper.measures]), "sub")
    if table.posture is not None:
        yield blocks.Paragraph(
            phrase("Posture: {sentence}.", sentence=table.posture.sentence), "sub"
        )
    # How much of production is covered stands on the first page already.
    notes = (note for note in table.notes if " lie within " not in note)
    yield blocks.Bullets((*_truth(table), *notes), "sub")


def _title(paper: PublishedCase | None) -> Phrase:
    if paper is None:
        return phrase("Deviation from the path")
    return phrase(
        "Deviation from the path; “paper” is Table 1 of Monsarrat et al., Robotics and"
        " Computer-Integrated Manufacturing, 2024"
    )


def _means(means: tuple[SeedMeans, ...]) -> blocks.Block:
    heads = ("", *phrases("Mean, before to after in mm", "Reduction", "Max, before to after in mm",
                          "Reduction"))  # fmt: skip
    rows = tuple(
        (
            each.title,
            _change(each.mean_before.mean, each.mean_after.mean),
            _with_interval(each.mean_reduction),
            _change(each.max_before.mean, each.max_after.mean),
            _with_interval(each.max_reduction),
        )
        for each in means
    )
    caption = phrase(
        "Means over {seeds} seeds, 95 % interval (Student's t over the seeds)",
        seeds=means[0].seeds,
    )
    return blocks.Table(caption, heads, rows)


def _change(before: float, after: float) -> Phrase:
    return phrase(
        "{low} to {high}", low=f"{in_unit(before, 'mm'):.3f}", high=f"{in_unit(after, 'mm'):.3f}"
    )


def _with_interval(figure: SeedMean) -> str:
    if figure.low is None or figure.high is None:
        return f"{figure.mean:.1%}"
    return phrase(
        "{value} ({low} to {high})",
        value=f"{figure.mean:.1%}",
        low=f"{figure.low:.1%}",
        high=f"{figure.high:.1%}",
    )


def _truth(table: SimulateProcessResult) -> Iterator[Phrase]:
    """Yield how hard the truth was, where the file says it."""
    if not table.preset:
        return
    reacts = table.process_stiffness
    forces = (
        phrase(
            "process forces react to the tool's shift along the surface's normal, by {rate}",
            rate=f"{1e-3 * reacts:g} N/mm",
        )
        if reacts
        else phrase("process forces are given, they do not react to the tool's shift")
    )
    yield phrase(
        "How hard the simulated robot was to calibrate: preset “{preset}”; {forces}.",
        preset=table.preset,
        forces=forces,
    )


def _budget(lines: tuple[DeviationComparison, ...]) -> blocks.Block:
    rows = tuple(
        (
            line.name,
            *(
                phrase("{change} ({share})", change=_change(b, a), share=f"{r:.1%}")
                for b, a, r in zip(
                    _three(line.before), _three(line.after), _three(line.reduction), strict=True
                )
            ),
        )
        for line in lines
    )
    caption = phrase("Error budget of the first seed, before to after in mm (reduction)")
    return blocks.Table(caption, _HEADS, rows)


def _pictures(traces: list[CourseDeviation], tolerance: float | None) -> Iterator[blocks.Block]:
    worst = max(traces, key=lambda trace: float(np.abs(trace.before).max()))
    before, after = (
        np.concatenate([getattr(t, key) for t in traces]) for key in ("before", "after")
    )
    text = phrase(
        "Absolute deviation, mean {before} without and {after} with correction, over {courses}.",
        before=mm(float(np.abs(before).mean())),
        after=mm(float(np.abs(after).mean())),
        courses=counted(len(traces), "course"),
    )
    yield blocks.Picture(
        partial(process_maps, traces), phrase("Two maps of the path. {text}", text=text), text
    )
    yield blocks.Picture(
        partial(course_figure, worst, tolerance),
        phrase(
            "Deviation over time of course {course}, without and with correction",
            course=worst.course,
        ),
        phrase(
            "The course with the largest deviation, {course}.",
            course=worst.course,
        ),
    )


def _three(values: DeviationStatistics) -> tuple[float, float, float]:
    return values.mean, values.max, values.standard_deviation


def _mm(values: DeviationStatistics) -> tuple[str, ...]:
    return tuple(f"{in_unit(value, 'mm'):.3f}" for value in _three(values))


PROCESS = Section(
    "process",
    phrase("The process path"),
    phrase("What does the correction bring?"),
    70,
    _body,
)
