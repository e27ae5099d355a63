"""Box plots in numbers, and how variants look."""

import numpy as np
import pytest
from matplotlib.cbook import boxplot_stats

from elastocal.errors import CodecError
from elastocal.report.plots import style, variant_styles
from elastocal.report.plots._box_plots import label_step, make_boxes, round_values
from elastocal.report.plots.style import COLOURS


def test_boxes_are_those_of_matplotlib():
    values = np.random.default_rng(0).standard_normal((31, 5)) ** 3
    boxes = make_boxes(values, "error")
    for k, wanted in enumerate(boxplot_stats(values)):
        found = [boxes.q1[k], boxes.median[k], boxes.q3[k], boxes.low[k], boxes.high[k]]
        expected = [wanted[name] for name in ("q1", "med", "q3", "whislo", "whishi")]
        assert found == pytest.approx(expected)
        beyond = boxes.outlier[boxes.outlier_box == k]
        assert sorted(beyond) == pytest.approx(sorted(wanted["fliers"]))


def test_sizes_without_a_value_have_no_box():
    values = np.array([[1.0, np.nan, 3.0], [2.0, np.nan, np.nan]])
    boxes = make_boxes(values, "error")
    assert boxes.n.tolist() == [1, 3]
    assert boxes.count.tolist() == [2, 1]
    assert boxes.median.tolist() == [1.5, 3.0]


def test_nothing_to_draw_is_refused_by_name():
    with pytest.raises(CodecError, match=r"error of variant 'a' has no finite value in 4 ver"):
        make_boxes(np.full((4, 3), np.nan), "error of variant 'a'")


def test_boxes_of_a_group_lie_side_by_side_within_it():
    for count in (1, 2, 5, 11):
        looks = variant_styles([f"v{k}" for k in range(count)])
        left = [look.place - 0.5 * look.width for look in looks]
        right = [look.place + 0.5 * look.width for look in looks]
        assert all(a < b for a, b in zip(right, left[1:], strict=False))
        assert left[0] > -0.5
        assert right[-1] < 0.5


def test_a_dozen_variants_differ_without_markers():
    looks = variant_styles([f"v{k}" for k in range(2 * len(COLOURS))])
    assert len({(look.colour, look.fill == style.PAPER) for look in looks}) == len(looks)


def test_labels_keep_their_distance():
    assert [label_step(last, 3.0) for last in (5, 12, 30, 400)] == [1, 2, 5, 50]


@pytest.mark.parametrize(("low", "high"), [(0.07, 1.6), (0.13, 8.0), (1e-4, 1e3)])
def test_a_logarithmic_scale_has_some_round_labels(low, high):
    values = round_values(low, high)
    assert 3 <= len(values) <= 8
    assert all(low <= value <= high for value in values)
