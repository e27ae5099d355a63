"""Uniform and blue-noise sampling."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from elastocal.cell.examples import block_mesh
from elastocal.cell.hardware import RegionEntry
from elastocal.planning.surface import SurfaceError, sample_blue_noise, sample_uniform, sampling
from elastocal.planning.surface.mesh import weld
from elastocal.planning.surface.sampling import _eliminate, _pair_weights, region_share
from elastocal.planning.surface.surface import build_surface
from support.tooling import cap, plane, soup


def test_uniform_points_fall_on_faces_in_proportion_to_their_area():
    surface = soup(block_mesh())
    points = sample_uniform(surface, 20_000, np.random.default_rng(3))
    share = np.bincount(points.face, minlength=12) / len(points)
    expected = surface.face_areas / surface.area
    deviation = np.sqrt(expected * (1 - expected) / len(points))
    assert np.all(np.abs(share - expected) < 4 * deviation)


def test_uniform_points_fill_a_triangle_evenly():
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    points = sample_uniform(soup(triangle), 20_000, np.random.default_rng(4))
    np.testing.assert_allclose(points.position.mean(axis=0), (1 / 3, 1 / 3, 0), atol=0.01)
    inner = np.all(points.barycentric > 0.2, axis=1).mean()
    assert inner == pytest.approx(0.4**2, abs=0.01)


@pytest.mark.parametrize("sample", [sample_uniform, sample_blue_noise])
def test_the_same_seed_gives_the_same_points(sample):
    first, second = (sample(cap(n=21), 300, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first.position, second.position)


def test_blue_noise_keeps_its_points_apart():
    surface = cap(n=31)
    points = sample_blue_noise(surface, 500, np.random.default_rng(6))
    assert len(points) == 500
    largest = 2 * np.sqrt(surface.area / (2 * np.sqrt(3) * 500))
    nearest = cKDTree(points.position).query(points.position, k=2)[0][:, 1]
    assert nearest.min() > 0.6 * largest
    loose = sample_uniform(surface, 500, np.random.default_rng(6))
    assert cKDTree(loose.position).query(loose.position, k=2)[0][:, 1].min() < 0.2 * largest


def test_tiles_keep_the_points_apart_but_for_some_at_their_seams(monkeypatch):
    surface = cap(n=31)
    largest = 2 * np.sqrt(surface.area / (2 * np.sqrt(3) * 3001))

    def near(points):
        nearest = cKDTree(points.position).query(points.position, k=2)[0][:, 1]
        return np.mean(nearest < 0.6 * largest)

    whole = sample_blue_noise(surface, 3001, np.random.default_rng(6))
    monkeypatch.setattr(sampling, "_LARGEST", 4000)
    points = sample_blue_noise(surface, 3001, np.random.default_rng(6))
    assert len(np.unique(points.position, axis=0)) == 3001
    assert near(whole) == 0.0
    assert 0.0 < near(points) < 0.05 < near(sample_uniform(surface, 3001, np.random.default_rng(6)))
    # No part of the surface has more of them than its area's share.
    side = np.mean(points.position[:, 0] > np.median(whole.position[:, 0]))
    assert side == pytest.approx(0.5, abs=0.01)


def test_elimination_in_rounds_removes_what_the_heap_removes():
    rng = np.random.default_rng(7)
    position = np.c_[rng.uniform(size=(200, 2)), np.zeros(200)]
    normal = np.tile([0.0, 0, 1], (200, 1))
    pairs = _pair_weights(position, normal, 50, 1.0).toarray()
    alive = np.ones(200, dtype=bool)
    for _ in range(150):  # Yuksel's loop, one by one
        weight = np.where(alive, pairs[:, alive].sum(axis=1), -np.inf)
        alive[np.argmax(weight)] = False
    np.testing.assert_array_equal(_eliminate(position, normal, 50, 1.0), np.flatnonzero(alive))


def test_the_two_sides_of_a_thin_plate_are_sampled_independently():
    sheet = plane().mesh
    both = np.concatenate([sheet.vertices, sheet.vertices - (0, 0, 1e-4)])
    faces = np.concatenate([sheet.faces, sheet.faces[:, ::-1] + len(sheet.vertices)])
    plate = build_surface(weld(both, faces, "plate"))
    points = sample_blue_noise(plate, 400, np.random.default_rng(8))
    top = points.normal[:, 2] > 0
    assert 150 < top.sum() < 250
    gap = cKDTree(points.position[top]).query(points.position[~top])[0]
    assert gap.min() < 0.01


def test_a_region_holds_all_points():
    corners = [["0 m", "0 m"], ["400 mm", "0 m"], ["0 m", "400 mm"]]
    region = RegionEntry.model_validate({"polygon": {"corners": corners}})
    surface = plane(11)
    surface = build_surface(surface.mesh, region=region)
    rng = np.random.default_rng(9)
    for sample in (sample_uniform, sample_blue_noise):
        points = sample(surface, 300, rng)
        assert len(points) == 300
        x, y, _ = points.position.T
        assert np.all((x >= 0) & (y >= 0) & (x + y <= 0.4))
    assert region_share(surface, rng) == pytest.approx(0.08, abs=0.006)


def test_a_region_moves_with_the_surface():
    box = {"min": ["-0.1 m", "-0.1 m", "-1 m"], "max": ["0.1 m", "0.1 m", "1 m"]}
    T = np.array([[0.0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])
    region = RegionEntry.model_validate({"box": box})
    surface = build_surface(plane().mesh, T, region)
    points = sample_uniform(surface, 100, np.random.default_rng(1))
    assert np.all(np.abs(points.position - (5, 6, 7)) <= 0.1 + 1e-12)


def test_an_empty_region_is_refused_with_the_extent_of_the_surface():
    box = {"min": ["5 m", "5 m", "5 m"], "max": ["6 m", "6 m", "6 m"]}
    surface = build_surface(plane().mesh, region=RegionEntry.model_validate({"box": box}))
    with pytest.raises(SurfaceError, match=r"region holds none of 20000 .* from \(-0.5, -0.5, 0\)"):
        sample_uniform(surface, 10, np.random.default_rng(0))


def test_no_points_cannot_be_asked_for():
    with pytest.raises(SurfaceError, match="0 points"):
        sample_uniform(plane(), 0, np.random.default_rng(0))
