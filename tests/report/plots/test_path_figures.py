"""The map of a survey: choices that coincide are all seen."""

import numpy as np
import pytest

from elastocal.compensation import (
    PathStations,
    PostureGrid,
    PostureSurvey,
)
from elastocal.report import (
    Curve,
)
from elastocal.report.plots import (
    stiffness_figure,
    style,
)

NAMES = ("as programmed", "one posture for the path", "stiffest at each station")


def drawn(stations: int):
    """Return the figure of three choices that are the same."""
    T = np.tile(np.eye(4), (stations, 1, 1))
    T[:, 0, 3] = 0.1 * np.arange(stations)
    q, k = np.zeros((stations, 4, 1, 1, 6)), np.full((stations, 4, 1, 1), 1e6)
    spins = np.linspace(0.0, 2.0 * np.pi, 4, endpoint=False)
    survey = PostureSurvey(PostureGrid(spins, np.zeros((1, 0))), q, k, {})
    held, none = np.full(stations, 1e6), np.full(stations, np.nan)
    curves = [Curve(name, held, held, held, np.zeros(stations), none) for name in NAMES]
    where = PathStations(tuple(range(2, 2 + stations)), T, q[:, 0, 0, 0])
    return stiffness_figure("arm", where, survey, curves)


@pytest.mark.parametrize("panel", [0, 1])
def test_each_choice_shows_beneath_the_next_where_they_coincide(panel):
    lines = [line for line in drawn(5).axes[panel].lines if line.get_color() != style.PAPER]
    widths = [line.get_linewidth() for line in lines]
    assert len(widths) == 3
    assert widths == sorted(set(widths), reverse=True)


def test_no_white_edge_lies_over_a_choice():
    colours = [line.get_color() for line in drawn(5).axes[0].lines]
    assert colours[:3] == [style.PAPER] * 3
    assert style.PAPER not in colours[3:]


def test_a_single_station_is_a_dot_of_each_choice_at_one_tick():
    figure = drawn(1)
    lines = [line for line in figure.axes[0].lines if line.get_color() != style.PAPER]
    sizes = [line.get_markersize() for line in lines]
    assert {line.get_marker() for line in lines} == {"o"}
    assert sizes == sorted(set(sizes), reverse=True)
    assert figure.axes[1].get_xticks().tolist() == [0.0]


def test_the_legend_names_each_choice():
    (legend,) = drawn(5).legends
    assert tuple(text.get_text() for text in legend.get_texts()) == NAMES
