"""Figures of the fibre placement example: the paper's Fig. 2, 3, 7 to 11 and section 4.2.3."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np

from elastocal.codec import CodecData, Verdicts, analyse, cross_validate, judge, make_variants
from elastocal.compensation.process import CourseDeviation, FibrePlacement
from elastocal.report import write_plan_figure, write_plan_page
from elastocal.report.plots import (
    codec_chart,
    course_figure,
    displacement_figure,
    index_chart,
    process_maps,
    spring_bars,
    spring_figure,
    write_figure,
)
from gallery.campaign import SEED, Campaign, accuracy, campaign, example_cell, process, reduction

COURSES = 2
TOLERANCE = 0.3e-3
"""The paper's, of the side deviation, in m."""
CODECS = {
    "codec-search": ("search", ("cover", "ioops")),
    "codec-springs": ("springs", ("actuated", "bearing")),
    "codec-loads": ("load_cases", ("normal", "all")),
}


def make(folder: Path) -> dict[str, str]:
    """Make the figures; return what is told of each."""
    done = campaign(example_cell(folder / "cell", "afp", {}), "ioops")
    told = _plan(folder, done) | {"placement": accuracy(done)} | _springs(folder, done)
    draw_displacements(folder / "displacements-placement.svg", done)
    for name, (key, values) in CODECS.items():
        told |= _codec(folder, done, name, key, values)
    outcome = process(done, "afp", FibrePlacement.compensator, COURSES)
    traces = [
        CourseDeviation.of(SEED, *pair) for pair in zip(outcome.before, outcome.after, strict=True)
    ]
    write_figure(folder / "maps-placement.png", partial(process_maps, traces))
    longest = max(traces, key=lambda trace: float(np.abs(trace.before).max()))
    write_figure(folder / "course-placement.svg", partial(course_figure, longest, TOLERANCE))
    told["process-placement"] = reduction(outcome.line("afp"))
    shutil.rmtree(folder / "cell")
    return told


def draw_displacements(path: Path, done: Campaign) -> None:
    """Draw commanded displacements and residuals."""
    found = done.calibration
    commanded = np.linalg.norm(found.readings.controller_displacement, axis=1)
    residual = np.linalg.norm(found.residual, axis=1)
    arrays = (found.readings.pose, commanded, residual, found.used)
    write_figure(path, partial(displacement_figure, *arrays))


def _plan(folder: Path, done: Campaign) -> dict[str, str]:
    planned = done.planned
    write_plan_figure(folder / "cover-and-ioops.png", planned.surface, planned.plan, planned.pool)
    page = folder / "plan.html"
    write_plan_page(page, done.cell, planned.surface, planned.plan, planned.pool)
    # The same page wherever the site is made.
    made_in = f"{done.cell.path.parent.parent}/"
    page.write_text(page.read_text(encoding="utf-8").replace(made_in, ""), encoding="utf-8")
    search, other = planned.plan.search.spread, planned.plan.comparison.spread
    text = (
        f"{len(planned.plan.poses)} poses of {planned.plan.pool.valid} candidates; geometry alone,"
        f" nothing is fitted. Covering radius"
        f" {1e3 * search.covering_radius:.0f} mm by COVER and {1e3 * other.covering_radius:.0f} mm"
        f" by IOOPS; distance to the next pose {1e3 * search.nearest_neighbour:.0f} and"
        f" {1e3 * other.nearest_neighbour:.0f} mm; to the edge"
        f" {1e3 * search.boundary_distance:.0f} and {1e3 * other.boundary_distance:.0f} mm (means);"
        f" O1 {search.o1:.3f} and {other.o1:.3f}"
    )
    return {"cover-and-ioops": text}


def _springs(folder: Path, done: Campaign) -> dict[str, str]:
    bars = spring_bars(done.calibration.calibrated)
    write_figure(folder / "springs-placement.svg", partial(spring_figure, bars))
    readings = int(done.calibration.used.sum())
    return {
        "springs": f"{len(bars)} compliances from {readings} readings at"
        f" {len(done.planned.plan.poses)} poses, all of them fitted; with the interval that holds"
        " it with 95 %, by the bootstrap over poses, where the readings tell a spring by itself"
    }


def _codec(
    folder: Path, done: Campaign, name: str, key: str, values: tuple[str, ...]
) -> dict[str, str]:
    robot, variants = done.cell.robot, make_variants({key: values})
    data: CodecData = cross_validate(
        robot, done.readings, variants, marker_offset=done.marker, jobs=1
    )
    verdicts = judge(data)
    write_figure(folder / f"{name}.svg", partial(codec_chart, data, verdicts))
    sets, held_out = data.verification.shape
    told = {
        name: f"Norm of the error in mm at held-out poses: {sets} verification sets of {held_out},"
        f" {data.n_train[-1]} training poses at most."
        f" {_last_errors(data) if key == 'load_cases' else _sentence(verdicts)}"
    }
    if key == "springs":
        found = analyse(robot, done.readings, data, marker_offset=done.marker, with_indices=True)
        draw = partial(index_chart, data, found.indices, found.correlations)
        write_figure(folder / "indices.svg", draw)
        told["indices"] = (
            f"Rank correlation, no unit, with the error at held-out poses: {sets} verification sets"
            f" of {held_out}, training sets of 1 to {data.n_train[-1]} poses; 95 % intervals"
        )
    return told


def _sentence(verdicts: Verdicts) -> str:
    """Return the verdict on the pair of variants."""
    text = verdicts.sentences[-1]
    return text[0].upper() + text[1:]


def _last_errors(data: CodecData) -> str:
    """Return median and worst set of each variant: a mean over sets would tell the worst only."""
    parts = []
    for each in data.variants:
        errors = 1e3 * data.errors(each.name)[:, -1]
        parts.append(
            f"{np.median(errors):.3f} mm by {each.name}, {errors.max():.3f} in the worst set"
        )
    last = int(data.n_train[-1])
    return f"Median of the mean error with {last} training poses: {'; '.join(parts)}"
