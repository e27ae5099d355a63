import numpy as np

from elastocal.codec.study import Condition, Sample, study_summary
from elastocal.report.plots import study_figure, themed_svg, write_study_figure
from elastocal.report.plots.style import BLUE, tint
from support.studies import settings, simulate

RESULTS = [simulate(Sample(3, number)) for number in range(6)]


def drawn(made):
    return study_figure(made, RESULTS, study_summary(made, RESULTS, 5e-5))


def ticks(figure):
    return [label.get_text() for label in figure.axes[0].get_xticklabels()]


def test_groups_are_pose_counts_in_rising_order():
    figure = drawn(settings(10, 5))
    assert ticks(figure) == ["5", "10"]
    assert figure.axes[0].get_xlabel() == "Number of calibration poses"
    assert not figure.legends


def test_boxes_show_the_samples_of_their_condition():
    figure = drawn(settings(10, 5))
    lower = figure.axes[0]
    (medians,) = [each for each in lower.patches if each.get_zorder() == 4]
    heights = {round(float(y), 9) for y in medians.get_path().vertices[:, 1]}
    expected = {
        round(1e3 * float(np.median([r.outcomes[k].error_max for r in RESULTS])), 9) for k in (0, 1)
    }
    assert heights == expected


def test_where_poses_do_not_vary_the_first_factor_that_does_is_the_axis():
    conditions = tuple(Condition(poses=10, tracker_noise=scale) for scale in (1.0, 5.0))
    figure = drawn(settings(conditions=conditions))
    assert ticks(figure) == ["1", "5"]
    assert figure.axes[0].get_xlabel() == "tracker noise"


def test_another_factor_stands_beside_with_a_legend():
    conditions = tuple(Condition(poses=poses, tracker_noise=1.0 + poses) for poses in (5, 10))
    figure = drawn(settings(conditions=conditions))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["tracker noise 6", "tracker noise 11"]


def test_the_same_study_draws_the_same_bytes(tmp_path):
    made = settings()
    record = study_summary(made, RESULTS, None)
    found = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        drawn = write_study_figure(tmp_path / name, made, RESULTS, record)
        found.append((tmp_path / name / drawn).read_bytes())
    assert found[0] == found[1]


def test_boxes_of_the_page_are_dark_where_the_page_is():
    svg = themed_svg(lambda: drawn(settings(10, 5))).decode()
    light, dark = tint(BLUE), tint(BLUE, ground=0x14)
    assert svg.count(light) == 1  # where its name is defined
    assert f"--fill0:{dark}" in svg.split("dark)")[1]
    assert "fill: var(--fill0)" in svg


def test_a_target_below_all_errors_is_within_the_axes():
    made = settings()
    figure = study_figure(made, RESULTS, study_summary(made, RESULTS, 1e-6))
    for axes in figure.axes:
        low, high = axes.get_ylim()
        assert low < 1e-3 < high
