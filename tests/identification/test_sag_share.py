"""Controllers that report positions without their sag, with a part of it, and with all of it."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.identification import FitOptions, build, calibrate, solve
from elastocal.identification.displacement import displacement_blocks, sag_blocks_between
from elastocal.robot import Robot
from elastocal.sim.arm import Linkage, Noise, bearing_truth, measure, press_forces, press_poses
from elastocal.sim.arm.elastic_arm import GRAVITY
from sim.conftest import ARM_URDF

PLANTED = 1e-6 * np.array([0.4, 0.45, 0.5, 2.0, 2.5, 3.3])
NOISE = 2e-6


def model(urdf: str = ARM_URDF) -> ElasticModel:
    robot = Robot.from_urdf(urdf, "tcp")
    return ElasticModel(robot, actuated(robot))


@cache
def pressed() -> Readings:
    """Return readings of a heavy arm, the reference some millimetres away."""
    arm = bearing_truth(Linkage.from_urdf(ARM_URDF, "tcp"), gravity=GRAVITY)
    poses = press_poses(arm.linkage, 16, np.random.default_rng(5))
    data = measure(
        arm, poses.joints, press_forces(poses.T_base_tcp), Noise(), np.random.default_rng(1)
    )
    return data.readings(model().robot.joint_names)


def showing(share: float) -> Readings:
    """Return readings that show a share of the sag between reference and load."""
    seen, arm, rng = pressed(), model(), np.random.default_rng(3)
    rows = displacement_blocks(arm, seen) + (share - 1.0) * sag_blocks_between(arm, seen)
    noise = NOISE * rng.standard_normal((len(seen), 3))
    return replace(seen, marker_displacement=seen.controller_displacement + rows @ PLANTED + noise)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_springs_are_found_whatever_share_of_the_sag_readings_show(share):
    found = calibrate(model(), showing(share), np.random.default_rng(0)).calibrated
    low, high = found.interval()
    assert ((low < PLANTED) & (high > PLANTED)).all()
    # The last joint turns the tool, whose tip is nearly on its axis.
    assert np.abs(found.compliance / PLANTED - 1.0)[:5].max() < 0.004
    assert (high - low < 0.02 * PLANTED)[:5].all()


def test_a_controller_that_takes_its_sag_out_looks_stiffer_where_all_of_it_is_expected():
    c = solve(build(model(), showing(0.1), FitOptions())).compliance
    assert (c / PLANTED - 1.0)[1] < -0.004


def test_an_arm_without_weight_has_no_share_of_it():
    weightless = model(re.sub("<inertial>.*?</inertial>", "", ARM_URDF))
    rows = displacement_blocks(weightless, pressed())
    marker = pressed().controller_displacement + rows @ PLANTED
    seen = replace(pressed(), marker_displacement=marker)
    found = calibrate(weightless, seen, np.random.default_rng(0))
    assert found.solution.compliance.shape == PLANTED.shape
    np.testing.assert_allclose(found.calibrated.compliance, PLANTED, rtol=1e-9)
