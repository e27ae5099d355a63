"""Errors at unseen poses, with intervals over resampled poses."""

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, layout
from elastocal.identification import calibrate
from elastocal.identification.reproduction import unseen_errors
from support.cells import TRACKED, Cell, rich_truth, robot


@pytest.fixture(scope="module")
def calibration():
    readings = Cell(rich_truth(), poses=12, seed=3, noise=TRACKED).readings()
    model = ElasticModel(robot(), layout(robot(), "bearing"))
    return calibrate(model, readings, np.random.default_rng(0))


@pytest.mark.slow
def test_errors_are_those_of_the_calibration(calibration):
    unseen = unseen_errors(calibration, np.random.default_rng(0))
    np.testing.assert_array_equal(unseen.error, calibration.held_out.error)
    assert unseen.mean.value == calibration.held_out.mean
    assert unseen.p95.value == pytest.approx(np.percentile(calibration.held_out.error, 95))
    assert unseen.poses == unseen.folds == 12


def test_intervals_are_seeded(calibration):
    one, two = (unseen_errors(calibration, np.random.default_rng(0)) for _ in range(2))
    assert (one.mean, one.p95) == (two.mean, two.p95)


def test_the_interval_of_the_mean_is_that_of_the_pose_means(calibration):
    """Poses have as many readings each, so that the mean is that of independent pose means."""
    unseen = unseen_errors(calibration, np.random.default_rng(0))
    means = [unseen.error[unseen.pose == pose].mean() for pose in np.unique(unseen.pose)]
    expected = 1.96 * np.std(means, ddof=1) / np.sqrt(len(means))
    half = 0.5 * (unseen.mean.high - unseen.mean.low)
    assert half == pytest.approx(expected, rel=0.25)


def test_readings_beyond_a_tolerance_are_counted(calibration):
    unseen = unseen_errors(calibration, np.random.default_rng(0))
    ordered = np.sort(unseen.error)
    assert unseen.beyond(float(ordered[-3])) == 2
    assert unseen.beyond(unseen.max) == 0
    assert unseen.beyond(float("nan")) == len(unseen.error)
