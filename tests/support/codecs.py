"""Small codecs of a simulated campaign, and what belongs to them."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from elastocal.codec import (
    CodecAnalysis,
    CodecData,
    Verdicts,
    analyse,
    cross_validate,
    judge,
    make_variants,
)
from elastocal.codec._prepared import PreparedVariant, prepared_variants
from elastocal.dataset import Readings
from support.cells import Cell, rich_truth, robot

POSES = 10


@dataclass(frozen=True, eq=False)
class Judged:
    """A codec with everything that its pictures need."""

    readings: Readings
    data: CodecData
    verdicts: Verdicts
    trainees: tuple[PreparedVariant, ...]
    insight: CodecAnalysis


@cache
def judged() -> Judged:
    """Return a codec that compares 6 with 18 springs."""
    readings = Cell(rich_truth(), poses=POSES, seed=4).readings()
    data = cross_validate(robot(), readings, make_variants({"springs": ("actuated", "bearing")}))
    trainees = prepared_variants(robot(), readings, data)
    insight = analyse(robot(), readings, data, with_indices=True)
    return Judged(readings, data, judge(data), trainees, insight)


def without_errors(data: CodecData, variant: str) -> CodecData:
    """Return a codec of which one variant has no number."""
    errors = np.array(data.error_mean)
    errors[data.index(variant)] = np.nan
    return replace(data, error_mean=errors)


def renamed(data: CodecData, *names: str) -> CodecData:
    """Return a codec whose variants have other names."""
    variants = tuple(
        replace(each, name=name) for each, name in zip(data.variants, names, strict=True)
    )
    return replace(data, variants=variants)
