"""The process path before and after correction (paper Fig. 11 and 13, Table 1)."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from elastocal import blocks
from elastocal.compensation.process import (
    CourseDeviation,
    budget_table,
    show_deviations,
    show_notes,
)
from elastocal.report.document.section import Section, flattened
from elastocal.report.plots import course_figure, process_maps
from elastocal.verdict import Evidence, has_own_process
from elastocal.wording import counted, mm, phrase, phrases


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
    yield from show_deviations(record.table)
    yield show_notes(record.table)
    seed = record.courses[0].seed
    yield from _pictures(
        [trace for trace in record.courses if trace.seed == seed], evidence.limits.tolerance
    )
    if record.table.budget:
        yield blocks.Details(phrase("Error budget"), (budget_table(record.table),))
    rows = tuple(flattened(record.table.settings))
    settings = blocks.Table(phrase("Settings, SI units"), phrases("Key", "Value"), rows, 2)
    yield blocks.Details(phrase("Settings of the compensator"), (settings,))


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


PROCESS = Section(
    "process",
    phrase("The process path"),
    phrase("What does the correction bring?"),
    70,
    _body,
)
