"""Surfaces laid flat: every candidate in sight, nothing on top of another."""

import numpy as np
import pytest

from elastocal.planning.surface import sample_uniform
from elastocal.report.plots.plan_figure import flat_map
from support import tooling


@pytest.fixture(scope="module")
def on_block(block):
    points = sample_uniform(block, 400, np.random.default_rng(3))
    return points, flat_map(block, points.position, points.normal)


def test_a_block_unfolds_into_its_five_faces(on_block):
    _, flat = on_block
    assert flat.kind.startswith("unfolded")
    assert len(flat.sheets) == 5
    assert all(len(sheet.faces) == 2 for sheet in flat.sheets)


def test_unfolding_keeps_distances_on_a_face(on_block):
    points, flat = on_block
    place = flat.positions(points.position)
    for sheet in flat.sheets:
        chosen = sheet.candidates
        true = np.linalg.norm(points.position[chosen] - points.position[chosen[0]], axis=1)
        drawn = np.linalg.norm(place[chosen] - place[chosen[0]], axis=1)
        np.testing.assert_allclose(drawn, true, atol=1e-12)


def test_unfolded_faces_hang_beside_the_top_without_overlap(on_block, block):
    _, flat = on_block
    boxes = []
    for sheet in flat.sheets:
        corners = sheet.flat(block.mesh.vertices[block.mesh.faces[sheet.faces]]).reshape(-1, 2)
        boxes.append((corners.min(axis=0), corners.max(axis=0)))
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[i + 1 :]:
            assert np.any((high < other_low) | (other_high < low))
    whole = np.ptp(np.array(boxes).reshape(-1, 2), axis=0)
    # Top 0.6 x 0.4 with sides 0.3 high all round, and small gaps.
    np.testing.assert_allclose(np.sort(whole), [1.0, 1.2], atol=0.09)


def test_upward_is_away_from_the_base(on_block):
    points, flat = on_block
    place = flat.positions(points.position)
    (top,) = [s.candidates for s in flat.sheets if points.normal[s.candidates[0]][2] > 0.9]
    far, near = points.position[top, 0].argmax(), points.position[top, 0].argmin()
    assert place[top[far], 1] > place[top[near], 1]


def test_each_side_is_drawn_as_seen_from_outside(on_block):
    points, flat = on_block
    for sheet in flat.sheets:
        assert np.all(points.normal[sheet.candidates] @ sheet.towards_viewer > 0.99)


def test_a_surface_that_faces_one_way_is_one_view():
    surface = tooling.cap()
    points = sample_uniform(surface, 50, np.random.default_rng(1))
    flat = flat_map(surface, points.position, points.normal)
    (sheet,) = flat.sheets
    np.testing.assert_array_equal(sheet.candidates, np.arange(50))
    np.testing.assert_array_equal(np.sort(sheet.faces), np.arange(len(surface.mesh.faces)))
    assert flat.kind.startswith("seen along its mean normal")


def test_a_ball_is_seen_from_two_sides_and_each_candidate_once(ball):
    points = sample_uniform(ball, 300, np.random.default_rng(5))
    flat = flat_map(ball, points.position, points.normal)
    assert "from behind" in flat.kind
    both = np.concatenate([sheet.candidates for sheet in flat.sheets])
    np.testing.assert_array_equal(np.sort(both), np.arange(300))
    for sheet in flat.sheets:
        assert np.all(points.normal[sheet.candidates] @ sheet.towards_viewer > -0.75)
    left, right = (sheet.flat(ball.mesh.vertices)[:, 0] for sheet in flat.sheets)
    assert left.max() < right.min()
