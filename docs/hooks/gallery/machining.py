"""Figures of the machining example: the paper's Fig. 12 and 13."""

import shutil
from functools import partial
from pathlib import Path

from elastocal.compensation.process import CourseDeviation, Roughing
from elastocal.report.plots import (
    process_maps,
    write_figure,
)
from gallery.campaign import SEED, accuracy, campaign, example_cell, process, reduction
from gallery.placement import draw_displacements

RINGS = 1
SMALLER = {"pool: 3000": "pool: 300"}
"""Fifteen poses are found in a small pool as well."""


def make(folder: Path) -> dict[str, str]:
    """Make the figures; return what is told of each."""
    done = campaign(example_cell(folder / "cell", "machining", SMALLER), None)
    draw_displacements(folder / "displacements-machining.svg", done)
    outcome = process(done, "machining", Roughing.compensator, RINGS)
    pairs = zip(outcome.before, outcome.after, strict=True)
    traces = [CourseDeviation.of(SEED, *pair) for pair in pairs]
    write_figure(folder / "maps-machining.png", partial(process_maps, traces))
    shutil.rmtree(folder / "cell")
    return {
        "machining": accuracy(done),
        "process-machining": reduction(outcome.line("machining")),
    }
