import numpy as np

from elastocal.report.plots.plan_figure import spread_labels


def _gaps(place):
    gap = np.linalg.norm(place[:, None] - place[None], axis=2)
    return gap[np.triu_indices(len(place), 1)]


def test_labels_with_room_stay():
    anchor = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]])
    np.testing.assert_array_equal(spread_labels(anchor, 0.9), anchor)


def test_a_crowd_is_moved_apart_and_stays_near():
    anchor = np.random.default_rng(0).normal(0.0, 0.3, (12, 2))
    place = spread_labels(anchor, 1.0)
    assert _gaps(place).min() > 0.95
    assert np.linalg.norm(place - anchor, axis=1).max() < 3.0


def test_labels_on_one_spot_part():
    assert _gaps(spread_labels(np.zeros((5, 2)), 1.0)).min() > 0.95


def test_one_label_stays():
    np.testing.assert_array_equal(spread_labels(np.ones((1, 2)), 1.0), np.ones((1, 2)))
