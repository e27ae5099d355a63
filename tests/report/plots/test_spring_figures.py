from dataclasses import replace

import matplotlib
import numpy as np
import pytest

from elastocal.elastic import unit_of
from elastocal.identification.recertification import recertify
from elastocal.report import (
    write_recertification_figure,
)
from elastocal.report.plots import recertification_figure, spring_figure, style
from elastocal.report.plots.spring_figures import SpringBar
from support.cells import linear_truth, unseen
from support.recertified import calibrated, made_up, soft_truth


@pytest.fixture(scope="module")
def compared():
    loads = unseen(linear_truth())
    return recertify(
        calibrated(linear_truth(), 0), calibrated(soft_truth(), 50_000),
        loads.joint_position, loads.force, limit=1e-4,
    )  # fmt: skip


@pytest.fixture(scope="module")
def found(compared):
    return compared.summary


def drawn(found):
    with matplotlib.rc_context(style.print_settings()):
        figure = recertification_figure(found)
        figure.draw_without_rendering()
    return figure


def words(figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


@pytest.mark.slow
def test_every_spring_is_drawn_with_both_intervals(found):
    values, tested, rows = drawn(found).axes
    names = [label.get_text() for label in values.get_yticklabels()]
    # The readings determine 14 sums; joint_2.x moves the marker by less than their noise.
    assert len(names) == len(found.springs) == 13
    ends = [line.get_xdata() for line in values.lines if len(line.get_xdata()) == 2]
    for change in found.springs:
        for estimate in (change.old, change.new):
            assert any(np.allclose(x, [1e6 * estimate.low, 1e6 * estimate.high]) for x in ends)
    assert len(tested.lines) >= 2 * 13
    np.testing.assert_allclose(rows.lines[0].get_ydata(), 1e3 * np.array(found.deflection.size))


def test_what_moved_is_said_in_words_and_set_in_bold(found):
    figure = drawn(found)
    assert "Moved: joint_3.axial." in words(figure)
    bold = [
        label.get_text()
        for label in figure.axes[0].get_yticklabels()
        if label.get_fontweight() == "bold"
    ]
    assert bold == ["joint_3.axial"]


def test_without_rows_there_are_springs_alone(found):
    figure = drawn(replace(found, deflection=None, verdict=None, limit=None))
    assert len(figure.axes) == 2
    assert "No compared" in words(drawn(recertify(made_up(0), made_up(1)).summary))


def test_nothing_to_compare_still_makes_a_page(found):
    figure = drawn(replace(found, springs=(), moved=()))
    assert "No compared spring moved." in words(figure)


@pytest.mark.slow
def test_many_rows_are_drawn_in_groups_that_keep_the_extremes(compared):
    change = compared.rows
    many = recertify(
        calibrated(linear_truth(), 0), calibrated(soft_truth(), 50_000),
        np.tile(change.q, (20, 1)), np.tile(change.force, (20, 1)),
    )  # fmt: skip
    line = drawn(many.summary).axes[2].lines[0]
    assert len(line.get_ydata()) <= 1500
    assert line.get_ydata().max() == pytest.approx(1e3 * change.largest.value)


def test_texts_keep_inside_the_page(found):
    figure = drawn(found)
    page = figure.bbox
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert page.x0 <= box.x0 < box.x1 <= page.x1
        assert page.y0 <= box.y0 < box.y1 <= page.y1


@pytest.mark.slow
def test_the_same_comparison_gives_the_same_bytes(found, tmp_path):
    files = [write_recertification_figure(tmp_path / f"{n}.svg", found) for n in "ab"]
    assert files[0].read_bytes() == files[1].read_bytes()
    assert b"Moved beyond their intervals: joint_3.axial" in files[0].read_bytes()


def test_the_axis_holds_negative_values():
    unit = unit_of("rad/(N*m)")
    bars = [
        SpringBar("xy", unit, -0.4, -0.6, -0.1, None),
        SpringBar("xx", unit, 1.0, 0.9, 1.1, None),
    ]
    (axes,) = spring_figure(bars).axes
    left, right = axes.get_xlim()
    assert left < -0.6
    assert right > 1.1


def test_a_notebook_shows_a_figure():
    png = style.new_figure(1.0, 1.0)._repr_png_()
    assert png.startswith(b"\x89PNG")
