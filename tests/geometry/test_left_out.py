"""What a fit leaves out is a blunder of the tracker, or the arm, whose figures count it."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.geometry import GeometryModel, GeometryProblem, geometry_model
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from support.by_day import some_by_day
from support.measured_arms import ARMS, MARKERS, Measured, kuka, measure, universal

NOISE = 3e-5


def fitted(measured: Measured, rows: np.ndarray | None = None) -> GeometryModel:
    data = measured.data if rows is None else measured.data.rows(rows)
    problem = GeometryProblem(measured.robot, data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    return geometry_model(problem, found, "test")


def elsewhere(measured: Measured, rows: np.ndarray, joint: int, by: float) -> Measured:
    """Return positions of an arm one of whose joints stands off at some rows."""
    q = measured.data.q.copy()
    q[rows, joint] += by
    before, after = (
        T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], MARKERS)
        for T in map(measured.truth.forward, (measured.data.q, q))
    )
    R = measured.T_station_base[0, :3, :3]
    markers = measured.data.markers + (after - before) @ R.T
    return replace(measured, data=replace(measured.data, markers=markers))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_an_error_of_the_arm_counts_in_what_is_stated(seed):
    """As much is stated as unseen rows miss by: it was 0.312 for 0.427 mm."""
    plain = measure(kuka(), 400, stations=1, noise=NOISE, seed=seed)
    off = np.flatnonzero(plain.data.q[:, 2] > 1.6)
    measured = elsewhere(plain, off, 1, 1.5e-3)
    seen = np.arange(400) < 240
    model, unseen = fitted(measured, seen), measured.data.rows(~seen)
    each = np.linalg.norm(model.predict(unseen) - unseen.markers, axis=2).mean(axis=1)
    is_off = np.isin(np.flatnonzero(~seen), off)
    share = np.isin(np.flatnonzero(seen), off).mean()
    error = share * each[is_off].mean() + (1.0 - share) * each[~is_off].mean()
    assert len(off) > 30
    assert model.blunders == ()
    assert model.held_out.chosen.mean == pytest.approx(error, rel=0.15)
    assert model.held_out.chosen.mean > 3 * NOISE
    said = " ".join(map(str, model.findings))
    assert "their markers agree: it is the arm" in said
    assert "where joint_a3 is" in said


def test_one_marker_that_is_off_is_a_blunder():
    measured = measure(kuka(), 80, stations=1, noise=NOISE)
    markers = measured.data.markers.copy()
    markers[[3, 50], 1] += 3e-3
    model = fitted(replace(measured, data=replace(measured.data, markers=markers)))
    assert model.blunders == (3, 50)
    assert not [each for each in model.findings if "markers agree" in str(each)]


def test_figures_stand_with_and_without_blunders():
    model = fitted(measure(kuka(), 60, stations=1, noise=NOISE, blunders=3))
    assert len(model.blunders) == 3
    assert model.held_out.chosen.max < 3e-4
    assert model.with_blunders.chosen.max > 1e-2
    assert model.with_blunders.chosen.mean > 10 * model.held_out.chosen.mean


@pytest.mark.slow
def test_blunders_all_over_are_no_cluster():
    for seed in range(5):
        model = fitted(measure(universal(), 120, stations=1, noise=NOISE, blunders=12, seed=seed))
        assert not [each for each in model.findings if "left out lie where" in str(each)]


def test_a_cluster_by_the_sum_of_two_joints_is_named():
    """As of a coupled axis: one marker, so that nothing says whether it is the arm."""
    plain = measure(universal(), 300, markers=1, stations=1, noise=NOISE)
    markers = plain.data.markers.copy()
    there = np.flatnonzero(plain.data.q[:, 1] + plain.data.q[:, 2] > 2.2)
    markers[there] += np.random.default_rng(1).normal(0.0, 5e-3, (len(there), 1, 3))
    model = fitted(replace(plain, data=replace(plain.data, markers=markers)))
    (said,) = (str(each) for each in model.findings if "left out lie where" in str(each))
    assert "where j2 + j3 is" in said


@pytest.mark.slow
@pytest.mark.parametrize("arm", some_by_day(ARMS))
@pytest.mark.parametrize("markers", [1, 3])
def test_six_bad_poses_of_twenty_are_found(arm, markers):
    for seed in range(4):
        measured = measure(ARMS[arm](), 20, markers=markers, stations=1, blunders=6, seed=seed)
        assert set(fitted(measured).blunders) == measured.blunders
