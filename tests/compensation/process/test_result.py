import numpy as np
import pytest

from elastocal.compensation.process import compare_deviations, pooled
from elastocal.compensation.process.statistics import DeviationStatistics


def test_figures_are_those_of_absolute_deviations():
    figures = DeviationStatistics.of(np.array([-3e-3, 1e-3]))
    assert (figures.mean, figures.max) == (2e-3, 3e-3)
    assert figures.standard_deviation == pytest.approx(1e-3)


def test_the_reduction_is_what_has_gone():
    line = compare_deviations("all", [np.array([1.0, 3.0])], [np.array([-0.5]), np.array([0.3])])
    assert line.reduction.mean == pytest.approx(0.8)
    assert line.reduction.max == pytest.approx(1.0 - 0.5 / 3.0)


def test_a_correction_that_makes_it_worse_has_a_negative_reduction():
    assert compare_deviations("all", [np.ones(2)], [2.0 * np.ones(2)]).reduction.mean == -1.0


def test_pooled_figures_are_those_of_all_points_at_once():
    rng = np.random.default_rng(0)
    parts = [rng.standard_normal(n) for n in (5, 50, 17)]
    after = [0.1 * part for part in parts]
    each = [compare_deviations("one", [b], [a]) for b, a in zip(parts, after, strict=True)]
    together, at_once = pooled("all", each), compare_deviations("all", parts, after)
    assert together.before.mean == pytest.approx(at_once.before.mean)
    assert together.before.standard_deviation == pytest.approx(at_once.before.standard_deviation)
    assert together.after.max == at_once.after.max
    assert together.points == 72
