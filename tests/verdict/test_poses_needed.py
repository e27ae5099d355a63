"""How many poses the light of a run needs, and when no number of them would do."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification import ProductionError, UnseenErrors
from elastocal.identification.recertification import Estimate
from elastocal.verdict import PosesNeeded
from elastocal.verdict.evidence import AcceptanceLimits


def of_fit(model: float, fit: float) -> ProductionError:
    """Return an error on production of two parts, in mm."""
    return ProductionError.of(20, "gears", 1e-3 * model, 1e-3 * fit, 0.2, 0.95)


def needs(parts, worst, value, high, error=None, tolerance=0.3e-3, codecs=()):
    """Return what a run needs whose errors at unseen poses are these, in mm."""
    poses = np.array(parts.dataset.poses)
    errors = np.full(len(poses), 0.05e-3)
    errors[-1] = 1e-3 * worst
    p95 = Estimate(1e-3 * value, 0.5e-3 * value, 1e-3 * high)
    mean = Estimate(float(errors.mean()), 0.04e-3, 0.08e-3)
    unseen = UnseenErrors(errors, poses, ("normal",) * len(poses), len(poses), mean, p95)
    found = replace(
        parts,
        reproduction=replace(parts.reproduction, unseen=unseen),
        limits=AcceptanceLimits(tolerance, None, "of the test"),
        codecs=codecs,
    )
    return PosesNeeded.of(found, error)


def test_a_pose_with_a_reading_beyond_the_tolerance_needs_a_neighbour(parts):
    found = needs(parts, worst=0.4, value=0.1, high=0.2)
    assert found.beside == (parts.dataset.poses[-1],)
    assert found.count == 3  # as many as register a station
    assert "readings of pose" in found.counts[0][1]


def test_an_interval_that_ends_beyond_the_tolerance_needs_more_poses(parts):
    wide = needs(parts, 0.29, 0.2, 0.31, of_fit(0.1, 0.1)).count
    wider = needs(parts, 0.29, 0.2, 0.35, of_fit(0.1, 0.1)).count
    assert 1 <= wide < wider < 100


def test_no_number_of_poses_removes_what_the_springs_leave(parts):
    found = needs(parts, worst=0.6, value=0.4, high=0.5, error=of_fit(0.1, 0.01))
    assert found.count is None
    assert "no number of poses" in found.why_not
    assert "0.400 mm" in found.why_not


def test_reasons_that_have_nothing_to_do_with_poses_are_named(parts):
    found = needs(parts, worst=0.2, value=0.1, high=0.2)
    assert found.count is None
    assert any("no codec" in str(each) for each in found.findings())


@pytest.mark.parametrize("error", [None, of_fit(0.1, 0.1)])
def test_nothing_is_needed_of_poses_that_are_within(parts, error):
    assert needs(parts, 0.2, 0.1, 0.2, error).counts == ()
