"""On an arm made by another physics engine, elastocal finds what it should (issue 13).

The arm is `independent.mujoco_truth`; the estimator sees only what instruments show of it. Its
predictions are judged at poses that it has not seen, against one press from rest. Needs the extra
``[nightly]``.
"""

from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.identification import FitOptions, build, choose_model, solve
from elastocal.robot import Robot, T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import Linkage, press_poses
from independent.mujoco_truth import (
    LOADS_TCP,
    Campaign,
    Laws,
    MujocoArm,
    Procedure,
    campaign,
    fresh_deflection,
)

pytestmark = pytest.mark.slow

POSES, UNSEEN = 31, 60
LINKS = ("joint_a3", "joint_a4")
HALF_A_MINUTE = np.radians(0.5 / 60.0)
LINEAR = Laws()
HARD = Laws(softening=0.6, bending=LINKS)
STICKING = Laws(softening=0.6, bending=LINKS, lost_motion=HALF_A_MINUTE)
QUIET = Procedure(marker_noise=0.0, force_noise=0.0)
FIVE_LOADS_AND_A_LOW_ONE = Procedure(levels=(0.45,))
CONDITIONED = Procedure(levels=(0.45,), residual=1.0, conditioned=True)


@cache
def urdf() -> str:
    T_flange_tcp = T_from_xyzabc(0.05, 0.0, 0.3, 0.0, np.radians(20.0), 0.0)
    return with_tool(catalogue.urdf("KR 150 R3100-2"), "flange", "tcp", T_flange_tcp)


@cache
def robot() -> Robot:
    return Robot.from_urdf(urdf(), "tcp")


def poses(count: int, seed: int) -> np.ndarray:
    """Return joints at which the tool touches a dome; where to press is no law of physics."""
    return press_poses(Linkage.from_urdf(urdf(), "tcp"), count, np.random.default_rng(seed)).joints


def readings(measured: Campaign, conditioned: bool) -> Readings:
    count, loads = measured.force.shape[:2]
    rows = (count * loads, -1)
    return Readings(
        pose=np.repeat(np.arange(count), loads),
        load_case=np.tile([f"load {number}" for number in range(loads)], count),
        joint_position=measured.joints.reshape(rows),
        force=measured.force.reshape(rows),
        controller_displacement=measured.controller_displacement.reshape(rows),
        marker_displacement=measured.marker_displacement.reshape(rows),
        reference_joint_position=np.repeat(measured.reference_joints, loads, axis=0),
        conditioned=conditioned,
    )


@cache
def relative_errors(
    laws: Laws, how: Procedure, springs: str = "auto", seed: int = 1
) -> tuple[float, float]:
    """Return the mean error at unseen poses over the mean deflection, at full and half load."""
    arm = MujocoArm(urdf(), laws)
    measured = campaign(arm, poses(POSES, seed), how, np.random.default_rng(seed))
    seen = readings(measured, how.conditioned)
    model = choose_model(robot(), seen, springs, FitOptions()).model
    compliance = solve(build(model, seen)).compliance
    q, rng = poses(UNSEEN, 777), np.random.default_rng(777)
    loads = LOADS_TCP[rng.integers(len(LOADS_TCP), size=UNSEEN)]
    force = np.array([arm.rigid(each)[:3, :3] @ load for each, load in zip(q, loads, strict=True)])
    errors = []
    for level in (1.0, 0.5):
        truth = fresh_deflection(arm, q, level * force)
        error = np.linalg.norm(model.deflection(compliance, q, level * force) - truth, axis=1)
        errors.append(float(error.mean() / np.linalg.norm(truth, axis=1).mean()))
    print(f"full load {errors[0]:.2%}, half load {errors[1]:.2%}")
    return errors[0], errors[1]


def test_the_engine_and_pinocchio_agree_on_the_arm_of_the_drawing():
    """Two readers of one URDF: what they disagree on would pass for deflection."""
    arm = MujocoArm(urdf(), LINEAR)
    for q in poses(5, 0):
        np.testing.assert_allclose(arm.rigid(q), robot().forward(q), atol=1e-12)
        _, torque = arm.equilibrium(q, np.zeros(3), np.zeros(len(arm.k)))
        # The arm gives way under its own weight, so its torques are not quite those of the drawing.
        weight = robot().gravity_torques(q)
        np.testing.assert_allclose(torque[arm.is_gear], -weight, atol=0.01 * np.abs(weight).max())


def test_dahl_friction_leaves_its_lost_motion_between_a_torque_and_its_opposite():
    arm = MujocoArm(urdf(), Laws(lost_motion=HALF_A_MINUTE, dahl=50.0))
    large = np.where(arm.is_gear, 20.0 * arm.friction_limit, 0.0)
    rest, still = np.zeros(len(arm.k)), np.zeros(len(arm.k))
    forth = arm.slide(arm.slide(rest, still, large), large, still)
    back = arm.slide(arm.slide(rest, still, -large), -large, still)
    lost = (back - forth)[arm.is_gear] / arm.k[arm.is_gear]
    np.testing.assert_allclose(np.abs(lost), HALF_A_MINUTE, rtol=0.05)


def test_sag_under_gravity_is_told_from_deflection():
    full, half = relative_errors(LINEAR, QUIET)
    assert full < 0.002
    assert half < 0.002


def test_bending_links_stiffening_gears_and_noise_leave_less_than_one_percent():
    full, half = relative_errors(HARD, FIVE_LOADS_AND_A_LOW_ONE)
    assert full < 0.0075
    assert half < 0.0125


def test_half_a_minute_of_lost_motion_leaves_one_and_a_half_percent_at_full_load():
    assert relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE)[0] < 0.015


def test_without_friction_memory_lost_motion_leaves_several_times_as_much():
    bearing = relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE, "bearing")[0]
    assert bearing > 4.0 * relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE)[0]


@pytest.mark.xfail(strict=True, reason="0.56 %; 0.15 % without noise of 15 µm")
def test_hard_truth_leaves_the_0_40_percent_of_issue_13():
    assert relative_errors(HARD, FIVE_LOADS_AND_A_LOW_ONE)[0] < 0.0040


def test_a_conditioning_press_leaves_the_2_5_percent_of_issue_13():
    assert relative_errors(STICKING, CONDITIONED)[0] < 0.025


@pytest.mark.xfail(strict=True, reason="2.1 % against 1.0 %: Dahl's law bends, ours has corners")
def test_half_load_is_no_worse_than_full_load_plus_half_a_percent():
    full, half = relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE)
    assert half < full + 0.005
