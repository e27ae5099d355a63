"""What a fit may claim: faint springs, models that explain too little, measured coverage."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.identification import (
    MOST_UNEXPLAINED,
    CalibrateResult,
    Calibration,
    FitOptions,
    calibrate,
    leave_poses_out,
    summary,
)
from elastocal.identification.recertification import recertify
from elastocal.identification.uncertainty import Misfit, interval, measured_coverage
from elastocal.records import from_data, to_data
from support.cells import Cell, linear_truth
from support.problems import elastic, linear_readings, planted

TRUST = FitOptions(trust_conventions=True)


@cache
def faint(noise: float = 20e-6, tcp_off_axis: float = 2e-3, seed: int = 0) -> Calibration:
    """Return a calibration in which the last joint is hardly loaded: a tcp near its axis."""
    model = elastic("actuated")
    readings, compliance = linear_readings("actuated", 0.0)
    blocks = model.observation_blocks(readings.joint_position, readings.force)
    blocks[..., -1] *= tcp_off_axis
    rng = np.random.default_rng(seed)
    d = blocks @ compliance + noise * rng.standard_normal((len(readings), 3))
    marker = readings.controller_displacement + d
    hidden = replace(readings, marker_displacement=marker)
    # The model sees the forces that load the last joint by as little.
    return calibrate(_Weak(tcp_off_axis), hidden, np.random.default_rng(0))


class _Weak(type(elastic("actuated"))):
    """The elastic model with a last joint that the load reaches by a short lever only."""

    def __init__(self, lever: float) -> None:
        whole = elastic("actuated")
        super().__init__(whole.robot, whole.springs)
        object.__setattr__(self, "lever", lever)

    def observation_blocks(self, *args, **options):
        blocks = super().observation_blocks(*args, **options)
        return blocks * np.where(np.arange(blocks.shape[-1]) == blocks.shape[-1] - 1, self.lever, 1)


NONE = np.zeros(0, dtype=bool)
"""No readings of low load."""


def test_a_spring_whose_column_is_below_the_noise_is_not_observable():
    found = faint()
    row = summary(found).springs[-1]
    assert (row.name, row.observable, row.too_weak, row.group) == (
        "joint_6.axial",
        False,
        True,
        None,
    )
    (weak,) = found.calibrated.observability.faint
    assert weak.deflection < weak.noise
    assert found.calibrated.observability.observable == (True,) * 5 + (False,)


def test_no_tight_interval_stands_beside_a_spring_that_is_too_weak_to_see():
    row = summary(faint()).springs[-1]
    assert row.low == 0.0
    assert row.high > 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "lever"), [(20e-6, 4.0), (0.0, 2e-3)])
def test_with_a_longer_lever_or_without_noise_the_same_spring_is_seen(noise, lever):
    assert faint(noise, lever).calibrated.observability.faint == ()


@pytest.mark.slow
def test_a_spring_that_is_too_weak_to_see_is_not_compared():
    old, new = (replace(faint(seed=n).calibrated, provenance=f"campaign {n}") for n in (0, 1))
    found = recertify(old, new).summary
    assert "joint_6.axial" in found.not_compared
    assert "joint_3.axial" in [each.name for each in found.springs]


def test_faint_springs_survive_the_model_file_and_older_files_have_none():
    calibrated = faint().calibrated
    data = to_data(CalibrateResult.of(calibrated))
    assert (
        from_data(CalibrateResult, data, "m").observability.faint == calibrated.observability.faint
    )
    del data["observability"]["faint"]
    assert from_data(CalibrateResult, data, "m").observability.faint == ()


@cache
def useless() -> Calibration:
    """Return a calibration of readings whose deflection is mostly none of any spring."""
    readings, _ = linear_readings("actuated", 20e-6)
    size = np.linalg.norm(readings.deflection, axis=1).mean()
    pose = np.unique(readings.pose, return_inverse=True)[1]
    kick = np.random.default_rng(0).standard_normal((pose.max() + 1, 3))[pose] * size
    marker = readings.marker_displacement + kick
    bad = replace(readings, marker_displacement=marker)
    return calibrate(elastic("actuated"), bad, np.random.default_rng(0), TRUST)


@pytest.mark.slow
def test_a_model_that_leaves_more_than_half_says_so():
    found = useless()
    assert found.calibrated.unexplained > MOST_UNEXPLAINED
    assert any("not fit for use" in text for text in found.warnings)
    assert summary(found).unexplained == pytest.approx(found.calibrated.unexplained)


def test_no_tight_interval_stands_beside_a_model_that_leaves_more_than_half():
    found = useless()
    readings = found.readings
    fit = found.calibrated.predict(readings.joint_position, readings.force)
    half = np.linalg.norm(fit.high - fit.low, axis=1) / 2.0
    assert half.mean() > found.held_out.mean


def test_a_good_model_keeps_its_intervals():
    found = calibrate(elastic(), Cell(linear_truth()).readings(), np.random.default_rng(0))
    assert found.calibrated.unexplained < 0.1
    assert found.widening < 3.0


def test_how_much_is_unexplained_is_read_back_from_the_model_file():
    found = useless()
    record = CalibrateResult.of(found.calibrated, summary(found))
    read = from_data(CalibrateResult, to_data(record), "m").calibrated
    assert read.unexplained == pytest.approx(found.calibrated.unexplained)
    assert np.isnan(CalibrateResult.of(found.calibrated).calibrated.unexplained)


@pytest.mark.slow
def test_the_interval_of_a_measurement_covers_what_it_claims():
    shares = []
    for seed in range(8):
        readings = Cell(linear_truth(), seed=seed).readings()
        coverage = calibrate(elastic(), readings, np.random.default_rng(0)).coverage
        assert coverage.measurement.count == 3 * len(readings)
        shares.append(coverage.measurement.share)
    assert np.mean(shares) == pytest.approx(0.95, abs=0.02)


def test_the_coverage_of_the_fit_is_not_claimed_but_explained():
    fit = calibrate(
        elastic(), Cell(linear_truth()).readings(), np.random.default_rng(0)
    ).coverage.fit
    assert (fit.share, fit.count, fit.nominal) == (None, 0, 0.95)
    assert "not measured" in fit.reason


def test_a_misfit_that_is_too_small_for_the_errors_lowers_the_coverage():
    problem, _ = planted(20e-6, seed=1)
    held_out = leave_poses_out(problem)
    shrunk = replace(held_out, axis_error=0.2 * held_out.axis_error)
    nothing = np.zeros((40, problem.columns))
    assert measured_coverage(problem, held_out, nothing, NONE).measurement.share > 0.9
    assert measured_coverage(problem, shrunk, nothing, NONE).measurement.share < 0.6


def test_the_coverage_at_low_load_is_that_of_its_readings():
    problem, _ = planted(20e-6, seed=1)
    held_out, nothing = leave_poses_out(problem), np.zeros((40, problem.columns))

    def measured(is_low):
        return measured_coverage(problem, held_out, nothing, is_low).measurement

    everything, size = np.ones(len(problem), dtype=bool), held_out.size
    whole, small = measured(everything), size < np.median(size)
    assert whole.low_share == whole.share
    assert measured(~everything).low_share is None
    parts = [measured(each).low_share * each.mean() for each in (small, ~small)]
    assert sum(parts) == pytest.approx(whole.share)


def test_a_left_out_reading_is_inside_where_draws_and_misfit_together_reach_it():
    """Each side by itself, and draws that all lie to one side of the estimate widen that alone."""
    problem, truth = planted(20e-6, seed=1)
    held_out = leave_poses_out(problem)
    held_out = replace(held_out, axis_error=0.3 * held_out.axis_error)
    spread = 0.02 + 0.01 * np.random.default_rng(0).normal(size=(60, problem.columns))
    deviations = truth * spread
    inside = []
    for rows, d, fold in zip(problem.O, problem.d, held_out.fold, strict=True):
        predicted = rows @ held_out.compliance[fold]
        kept = held_out.fold != fold
        others = Misfit.of(held_out.axis_error[kept], held_out.size[kept])
        error = others.error(np.linalg.norm(predicted))
        low, high = interval(deviations @ rows.T)
        down, up = np.minimum(low, 0.0), np.maximum(high, 0.0)
        off = d - predicted
        inside.append((off >= -np.hypot(down, error)) & (off <= np.hypot(up, error)))
    assert 0.1 < np.mean(inside) < 0.9
    found = measured_coverage(problem, held_out, deviations, NONE).measurement
    assert found.share == pytest.approx(np.mean(inside), abs=1e-12)


def test_with_too_few_errors_the_coverage_is_none_with_a_reason():
    problem, _ = planted(20e-6, poses=31)
    few = problem.take(np.isin(problem.block, np.unique(problem.block)[:3]) & _first(problem))
    coverage = measured_coverage(few, leave_poses_out(few), np.zeros((40, few.columns)), NONE)
    assert (coverage.measurement.share, coverage.measurement.count) == (None, 0)
    assert "too few" in coverage.measurement.reason


def _first(problem) -> np.ndarray:
    """Return whether each reading is the first of its block."""
    first = np.zeros(len(problem), dtype=bool)
    first[np.unique(problem.block, return_index=True)[1]] = True
    return first
