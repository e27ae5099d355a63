from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.identification import CalibratedModel, Observability
from elastocal.identification.uncertainty import Misfit, interval
from support.problems import elastic
from support.virtual_chain import configurations

RNG = np.random.default_rng(0)
C = np.array([0.0, 1e-6, 2e-6, 3e-6, 4e-6, 5e-6])
DRAWS = C * RNG.uniform(0.8, 1.2, (60, 6))
SEEN = Observability(6, 3.0, (True,) * 6, ())


@pytest.fixture(scope="module")
def calibrated():
    return CalibratedModel(elastic("actuated"), C, DRAWS, SEEN, "made up")


def rows(count):
    from elastocal.sim.arm import (
        Linkage,
    )
    from support.cells import urdf

    q = configurations(Linkage.from_urdf(urdf(), "tcp"), count)
    return q, RNG.normal(0.0, 500.0, (count, 3)), RNG.normal(0.0, 100.0, (count, 3))


def test_a_prediction_is_the_deflection_of_the_model(calibrated):
    q, force, moment = rows(7)
    for m in (None, moment):
        found = calibrated.predict(q, force, m).deflection
        expected = elastic("actuated").deflection(C, q, force, m)
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-18)


def test_its_interval_is_that_of_the_predictions_of_the_draws(calibrated):
    q, force, _ = rows(7)
    each = [elastic("actuated").deflection(draw, q, force) for draw in DRAWS]
    low, high = interval(np.array(each))
    found = calibrated.predict(q, force)
    np.testing.assert_allclose(found.low, low, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found.high, high, rtol=1e-9, atol=1e-15)
    assert np.all(found.low <= found.high)


def test_what_would_be_measured_lies_within_the_misfit_and_the_fits_interval_together(calibrated):
    q, force, _ = rows(7)
    found = replace(calibrated, misfit=Misfit(20e-6, 0.05)).predict(q, force)
    below = np.hypot(found.deflection - found.low, 20e-6)
    np.testing.assert_allclose(found.measured_low, found.deflection - below, rtol=1e-9, atol=1e-15)
    assert np.all(found.measured_low <= found.low)
    assert np.all(found.measured_high >= found.high)


def test_the_true_deflection_may_be_off_by_what_grows_with_it_and_not_by_noise(calibrated):
    q, force, _ = rows(7)
    draws, found, unsplit = (
        replace(calibrated, misfit=Misfit(*each)).predict(q, force)
        for each in ((20e-6, 0.0), (20e-6, 0.05), (0.0, 0.05))
    )
    grown = 0.05 * np.linalg.norm(found.deflection, axis=1)[:, None]
    above = np.hypot(draws.high - draws.deflection, grown)
    np.testing.assert_allclose(found.high, found.deflection + above, rtol=1e-9, atol=1e-15)
    # Where the parts were not told apart, the share may be noise.
    np.testing.assert_array_equal(unsplit.high, draws.high)


def test_without_a_known_misfit_there_is_no_interval_of_a_measurement(calibrated):
    q, force, _ = rows(2)
    found = calibrated.predict(q, force)
    assert np.all(np.isnan(found.measured_low))
    assert np.all(np.isnan(found.measured_high))


def test_a_long_path_is_predicted_as_its_parts(calibrated):
    q, force, moment = rows(2003)
    calibrated = replace(calibrated, misfit=Misfit(10e-6, 0.02))
    whole = calibrated.predict(q, force, moment)
    tail = calibrated.predict(q[1990:], force[1990:], moment[1990:])
    for name in ("deflection", "low", "high", "measured_low", "measured_high"):
        np.testing.assert_allclose(
            getattr(whole, name)[1990:], getattr(tail, name), rtol=1e-12, atol=1e-15
        )


def test_no_rows_have_no_predictions(calibrated):
    assert calibrated.predict(np.zeros((0, 6)), np.zeros((0, 3))).high.shape == (0, 3)


def test_stiffness_is_infinite_where_nothing_yields(calibrated):
    np.testing.assert_allclose(calibrated.stiffness, [np.inf, 1e6, 5e5, 1e6 / 3, 2.5e5, 2e5])


def test_the_interval_of_a_compliance_is_that_of_its_draws(calibrated):
    np.testing.assert_array_equal(calibrated.interval(), interval(DRAWS))


def test_the_interval_of_a_compliance_is_the_stated_one_and_moves_no_prediction(calibrated):
    """A prediction has a meaning in every model, a spring in its own alone."""
    q, force, _ = rows(7)
    ends = np.column_stack([0.5 * C, 2.0 * C])
    told = replace(calibrated, spring_ends=np.vstack([ends, ends]))
    np.testing.assert_array_equal(told.interval(), ends.T)
    np.testing.assert_array_equal(told.predict(q, force).low, calibrated.predict(q, force).low)


def test_arrays_are_copied_and_read_only():
    c, draws = C.copy(), DRAWS.copy()
    calibrated = CalibratedModel(elastic("actuated"), c, draws, SEEN)
    c[:], draws[:] = 7.0, 7.0
    np.testing.assert_array_equal(calibrated.compliance, C)
    np.testing.assert_array_equal(calibrated.draws, DRAWS)
    for array in (calibrated.compliance, calibrated.draws):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_joints_that_are_not_finite_are_refused(calibrated):
    with pytest.raises(RobotError, match="not finite"):
        calibrated.predict(np.full((1, 6), np.nan), np.ones((1, 3)))
