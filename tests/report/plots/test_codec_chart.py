"""Printed charts of a codec."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.text import Text

from elastocal.codec import AXES
from elastocal.errors import CodecError
from elastocal.report.plots import (
    analysis_charts,
    codec_chart,
    compliance_chart,
    index_chart,
    style,
    variant_styles,
)
from elastocal.report.plots._box_plots import PALE
from elastocal.report.plots.analysis_charts import spring_boxes
from elastocal.report.plots.codec_chart import error_boxes, saturation_words
from elastocal.report.plots.style import tint
from support.codecs import judged, renamed, without_errors


@pytest.fixture(scope="module")
def known():
    return judged()


def boxes_in(axes) -> list[PathPatch]:
    """Return the boxes of each look, before their whiskers and behind their medians."""
    return [each for each in axes.patches if each.get_fill() and each.get_zorder() == 3]


def points_in(axes, marker: str) -> np.ndarray:
    """Return the places of all marks of a kind, shape (mark, 2)."""
    lines = [each.get_xydata() for each in axes.lines if each.get_marker() == marker]
    return np.concatenate([*lines, np.empty((0, 2))])


def texts_of(figure) -> str:
    drawn = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
    titles = [axes.get_title(loc) for axes in figure.axes for loc in ("left", "center", "right")]
    return "\n".join([*(text.get_text() for text in drawn), *titles])


def overlapping(figure) -> list[tuple[str, str]]:
    """Return pairs of visible texts that cover each other."""
    figure.canvas.draw()
    unseen = {
        id(tick.label1)
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    texts = [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and id(text) not in unseen
    ]
    boxes = [(text.get_text(), text.get_window_extent().shrunk(0.98, 0.7)) for text in texts]
    return [
        (boxes[i][0], boxes[j][0])
        for i in range(len(boxes))
        for j in range(i)
        if boxes[i][1].overlaps(boxes[j][1])
    ]


def test_mean_stands_above_maximum_in_millimetres(known):
    below, above, _ = codec_chart(known.data, known.verdicts).axes
    assert below.get_ylabel().startswith("Maximum error in mm")
    assert above.get_ylabel().startswith("Mean error in mm")
    assert above.get_position().y0 > below.get_position().y1
    medians = np.median(known.data.errors("bearing", "max"), axis=0)
    (found,) = (error_boxes(known.data, "max", "norm")[1].median,)
    assert found == pytest.approx(1e3 * medians)


def test_every_box_is_inside_its_panel(known):
    for axis in AXES:
        for axes in codec_chart(known.data, known.verdicts, axis).axes[:2]:
            low, high = axes.get_ylim()
            drawn = np.concatenate([each.get_path().vertices for each in boxes_in(axes)])
            assert low < drawn[:, 1].min() < drawn[:, 1].max() < high
            values = points_in(axes, "o")[:, 1]
            assert np.all((low < values) & (values < high))


def test_a_variant_has_its_colour_and_a_box_for_every_size(known):
    axes = codec_chart(known.data, known.verdicts).axes[0]
    for each, look in zip(boxes_in(axes), variant_styles(["a", "b"]), strict=True):
        assert np.sum(each.get_path().codes == Path.MOVETO) == known.data.n_train[-1]
        assert to_hex(each.get_edgecolor()) == look.colour
    assert [to_hex(each.get_edgecolor()) for each in boxes_in(axes)] == [
        style.BLUE,
        style.VERMILLION,
    ]


def test_saturation_is_told_with_its_interval(known):
    text = texts_of(codec_chart(known.data, known.verdicts))
    for found in known.verdicts.saturation:
        assert saturation_words(found) in text
    first = replace(known.verdicts.saturation[0], n_train=3, low=2, high=5, last=7)
    assert saturation_words(first) == (
        "actuated: from 3 training poses on, steadily from 4 (95 % interval 2 to 5)"
    )
    assert "no interval" in saturation_words(replace(first, low=None))
    assert (
        saturation_words(replace(first, n_train=7)) == "actuated: still falls at 7 training poses"
    )


def test_saturation_of_the_norm_is_not_drawn_into_other_axes(known):
    figure = codec_chart(known.data, known.verdicts, "x")
    assert len(figure.axes) == 2
    assert "along x of base in mm" in figure.axes[0].get_ylabel()
    assert "aturat" not in texts_of(figure)


@pytest.mark.slow
def test_no_text_covers_another(known):
    charts = (
        codec_chart(known.data, known.verdicts),
        compliance_chart(known.data, known.insight.seen),
        index_chart(known.data, known.insight.indices, known.insight.correlations),
    )
    assert [overlapping(figure) for figure in charts] == [[], [], []]


def test_a_dollar_in_a_name_is_no_formula(known):
    data = renamed(known.data, "a$b_$c^", "b")
    figure = codec_chart(data, known.verdicts)
    figure.canvas.draw()
    (legend,) = figure.legends
    assert legend.get_texts()[0].get_text() == r"a\$b_\$c^"


def test_a_variant_without_errors_is_refused_by_name(known):
    with pytest.raises(CodecError, match="mean error of variant 'bearing' has no finite value"):
        codec_chart(without_errors(known.data, "bearing"), known.verdicts)


def test_an_unknown_axis_is_refused(known):
    with pytest.raises(CodecError, match=r"unknown 'w' of an error \(allowed: x, y, z, norm\)"):
        codec_chart(known.data, known.verdicts, "w")


# compliances -------------------------------------------------------------------------------


def test_every_spring_has_a_panel_with_a_readable_unit(known):
    figure = compliance_chart(known.data, known.insight.seen)
    names = [axes.get_title("left") for axes in figure.axes]
    assert sorted(names) == sorted(known.data.springs[1].names)
    assert {axes.get_ylabel() for axes in figure.axes} == {"µrad/(N·m)"}
    first = names[:3]
    assert {name.partition(".")[0] for name in first} == {"joint_1"}


@pytest.mark.slow
def test_of_many_springs_those_without_a_finding_have_no_panel(known, monkeypatch):
    monkeypatch.setattr(analysis_charts, "_MOST_SPRINGS", 10)
    found = {
        name
        for each, labels in zip(known.insight.seen, known.data.springs, strict=True)
        for name, share in zip(labels.names, each.share[-1], strict=True)
        if share >= 0.5
    }
    springs = set().union(*(labels.names for labels in known.data.springs))
    assert found
    assert found < springs
    figure = compliance_chart(known.data, known.insight.seen)
    assert {axes.get_title("left") for axes in figure.axes} == found
    left = f"Not drawn: {len(springs) - len(found)} of {len(springs)} springs"
    assert left in texts_of(figure)
    assert not overlapping(figure)


def test_springs_that_are_not_told_apart_say_so(known):
    figure = compliance_chart(known.data, known.insight.seen)
    marks = {axes.get_title("left"): axes.get_title("right") for axes in figure.axes}
    assert marks["joint_2.axial"] == ""
    assert marks["joint_5.axial"] == "not told apart (bearing)"
    assert marks["joint_5.z"] == "not told apart"
    assert "joint_5.axial - joint_6.y" in texts_of(figure).replace("\n", " ")


def test_boxes_of_training_sets_that_tell_nothing_are_hollow(known):
    figure = compliance_chart(known.data, known.insight.seen)
    (axes,) = [each for each in figure.axes if each.get_title("left") == "joint_5.axial"]
    faces = [to_hex(each.get_facecolor()) for each in boxes_in(axes)]
    assert faces == [tint(style.BLUE), style.PAPER]
    *_, bearing = boxes_in(axes)
    assert to_hex(bearing.get_edgecolor()) == tint(style.VERMILLION, PALE)


def test_boxes_beyond_the_scale_have_an_arrow(known):
    compliance = [np.array(each) for each in known.data.compliance]
    compliance[1][:, 0, 0] = 1.0
    data = replace(known.data, compliance=tuple(compliance))
    axes = compliance_chart(data, known.insight.seen).axes[0]
    top = axes.get_ylim()[1]
    arrows = [x for x, y in points_in(axes, "^") if y == pytest.approx(top)]
    assert 1.0 + variant_styles(["actuated", "bearing"])[1].place in arrows
    assert all(0.5 < x < 1.5 for x in arrows)


def test_springs_at_zero_can_be_seen(known):
    compliance = (known.data.compliance[0], np.zeros_like(known.data.compliance[1]))
    for axes in compliance_chart(
        replace(known.data, compliance=compliance), known.insight.seen
    ).axes:
        low, high = axes.get_ylim()
        assert low < -0.03 * high


def test_compliances_are_those_of_the_fits(known):
    place = known.data.springs[1].names.index("joint_3.x")
    (found,) = [e for e in spring_boxes(known.data, known.insight.seen) if e.spring == "joint_3.x"]
    assert list(found.boxes) == ["bearing"]
    wanted = 1e6 * np.median(known.data.compliance[1][:, :, place], axis=0)
    assert found.boxes["bearing"].median == pytest.approx(wanted)


def test_a_variant_without_compliances_is_refused_by_name(known):
    compliance = (np.full_like(known.data.compliance[0], np.nan), known.data.compliance[1])
    with pytest.raises(CodecError, match=r"compliance joint_1\.axial of variant 'actuated' has no"):
        compliance_chart(replace(known.data, compliance=compliance), known.insight.seen)


# indices -----------------------------------------------------------------------------------


def test_indices_show_their_correlation_with_the_mean_error(known):
    figure = index_chart(known.data, known.insight.indices, known.insight.correlations)
    growth = figure.axes[0]
    assert growth.get_title() == "All sizes of a split"
    assert [text.get_text() for text in growth.get_yticklabels()][:2] == ["O1", "O2"]
    drawn = [line.get_xdata() for line in growth.lines if len(line.get_xdata()) == 10]
    wanted = [
        each.correlation
        for each in known.insight.correlations
        if (each.variant, each.error, each.kind) == ("bearing", "mean", "growth")
    ]
    assert drawn[1] == pytest.approx(wanted)


def test_a_variant_without_indices_is_refused_by_name(known):
    with pytest.raises(CodecError, match="variant 'bearing' has no indices"):
        index_chart(known.data, known.insight.indices[:1], known.insight.correlations)
    with pytest.raises(CodecError, match="variant 'actuated' has no indices"):
        index_chart(
            known.data,
            known.insight.indices,
            [each for each in known.insight.correlations if each.variant == "bearing"],
        )
