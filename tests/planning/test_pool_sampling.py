"""Pools of the example cells: as many candidates as wanted, whatever the number of processes."""

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import PlanningError
from elastocal.planning import (
    cell_surface,
    pool as gathering,
    sample_pool,
)
from elastocal.planning.surface import SurfaceError
from support.by_day import some_by_day


def example(folder, like="afp", **changes):
    path, *_ = write_example(folder, like, force=True)
    text = path.read_text()
    for old, new in changes.values():
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text)
    return load_cell(path)


def gathered(cell, jobs=1, seed=0, progress=lambda *_: None):
    return sample_pool(cell, cell_surface(cell), np.random.default_rng(seed), jobs, progress)


FEW = ("pool: 3000", "pool: 120")


@pytest.mark.parametrize("sampling", some_by_day(["uniform", "blue_noise"]))
def test_there_are_as_many_candidates_as_wanted(tmp_path, sampling):
    cell = example(tmp_path, pool=("pool: 3000", f"pool: 150\n  sampling: {sampling}"))
    found = gathered(cell)
    assert len(found.pool.postures) == 150
    assert np.all(found.pool.margins.passed)
    assert len(found.points) == found.pool.sampled
    at = found.points.position[found.pool.postures.point]
    np.testing.assert_allclose(found.pool.postures.contact, at, atol=1e-8)


@pytest.mark.slow
def test_blue_noise_candidates_keep_their_distance(tmp_path):
    def nearest(sampling):
        cell = example(tmp_path, pool=("pool: 3000", f"pool: 150\n  sampling: {sampling}"))
        points = gathered(cell).pool.postures.contact
        gaps = np.linalg.norm(points[:, None] - points, axis=2)
        np.fill_diagonal(gaps, np.inf)
        return np.percentile(gaps.min(axis=1), 5)

    assert nearest("blue_noise") > 2.0 * nearest("uniform")


def test_the_number_of_processes_does_not_change_the_pool(tmp_path, monkeypatch):
    monkeypatch.setattr(gathering, "_PARALLEL_FROM", 1)
    monkeypatch.setattr(gathering, "_PART", 50)
    cell = example(tmp_path, pool=FEW)
    alone, helped = gathered(cell, jobs=1), gathered(cell, jobs=2)
    np.testing.assert_array_equal(alone.pool.postures.q, helped.pool.postures.q)
    np.testing.assert_array_equal(alone.pool.margins.margin, helped.pool.margins.margin)
    np.testing.assert_array_equal(alone.pool.refused_by, helped.pool.refused_by)


@pytest.mark.slow
def test_the_seed_decides_the_pool(tmp_path):
    cell = example(tmp_path, pool=("pool: 3000", "pool: 30"))
    one, again, other = (gathered(cell, seed=seed).pool.postures.q for seed in (0, 0, 1))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)


@pytest.mark.slow
def test_progress_counts_up_to_what_is_wanted(tmp_path):
    told = []
    gathered(example(tmp_path, pool=FEW), progress=lambda *count: told.append(count))
    assert told[0] == ("candidates", 0, 120)
    assert told[-1] == ("candidates", 120, 120)
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)


@pytest.mark.slow
def test_a_surface_out_of_reach_is_given_up_early(tmp_path):
    cell = example(tmp_path, pool=FEW, place=('xyz: ["1.85 m"', 'xyz: ["8 m"'))
    found = gathered(cell)
    assert len(found.pool.postures) == 0
    assert found.pool.bottleneck == "reach"
    assert 1000 <= found.pool.sampled < 30 * 120


def test_a_region_with_nothing_in_it_is_refused(tmp_path):
    box = '  region: {box: {min: ["5 m", "5 m", "5 m"], max: ["6 m", "6 m", "6 m"]}}\n'
    cell = example(tmp_path, pool=FEW, region=("  unit: mm   ", f"{box}  unit: mm   "))
    with pytest.raises(SurfaceError, match="the region holds none"):
        gathered(cell)


def test_a_number_of_jobs_below_one_is_refused(tmp_path):
    cell = example(tmp_path)
    with pytest.raises(PlanningError, match="0 jobs: must be at least 1"):
        gathered(cell, jobs=0)
