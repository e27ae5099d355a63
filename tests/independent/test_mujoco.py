"""On an arm made by another physics engine, elastocal finds what it should (issue 13).

The arm is `independent.mujoco_truth`; the estimator sees only what instruments show of it. Its
predictions are judged at poses that it has not seen, against one press from rest. Needs the extra
``[nightly]``.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.identification import (
    CalibratedModel,
    FitOptions,
    Prediction,
    calibrate,
    choose_model,
    with_knowledge,
)
from elastocal.robot import Robot
from independent.arms import ANOTHER_TOOL, ARMS, drawing, poses
from independent.mujoco_truth import Campaign, Laws, MujocoArm, Procedure, campaign, true_deflection

pytestmark = pytest.mark.slow

POSES, UNSEEN = 31, 50
HALF_A_MINUTE = np.radians(0.5 / 60.0)
LINEAR = Laws()
HARD = Laws(softening=0.6, bending=True)
STICKING = Laws(softening=0.6, bending=True, lost_motion=HALF_A_MINUTE)
QUIET = Procedure(marker_noise=0.0, force_noise=0.0)
FIVE_LOADS_AND_A_LOW_ONE = Procedure(levels=(0.45,), force_noise=1.0)
CONDITIONED = Procedure(levels=(0.45,), force_noise=1.0, residual=1.0, conditioned=True)
COURSES = {"full": (1.0,), "half": (0.5,), "half after full": (1.0, 0.5), "reversed": (1.0, -0.5)}
"""Presses one after another, from rest, as parts of a load case; the last one is judged."""


@cache
def robot(arm: str) -> Robot:
    return Robot.from_urdf(drawing(arm).urdf, "tcp")


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


@dataclass(frozen=True)
class Course:
    """Presses at unseen poses, one after another, of which the last one is judged."""

    name: str
    another_tool: bool
    q: np.ndarray
    """Shape (pose, joint), in rad."""
    presses: list[np.ndarray]
    """Forces on the robot at the tcp in base, each of shape (pose, 3), in N."""
    true: np.ndarray
    """True deflection of the last, shape (pose, 3), in m."""

    def friction(self, model: ElasticModel) -> np.ndarray | None:
        """Return what friction bears at the last; None without friction."""
        if not len(model.friction):
            return None
        borne = torque = np.zeros((len(self.q), len(model.friction)))
        for force in self.presses:
            now = model.load_torques(self.q, force)[:, model.friction.axis]
            limit = model.friction.limit
            borne, torque = np.clip(borne + now - torque, -limit, limit), now
        return borne

    def predicted(self, fitted: CalibratedModel) -> Prediction:
        """Return what a calibrated model predicts of it."""
        model = fitted.with_tool(ANOTHER_TOOL) if self.another_tool else fitted
        return model.predict(self.q, self.presses[-1], friction=self.friction(model.model))


@cache
def courses(arm: str, laws: Laws) -> tuple[Course, ...]:
    """Return each of `COURSES` at unseen poses, and the first two with another tool."""
    found = []
    for another_tool in (False, True):
        real, rng = MujocoArm(drawing(arm, another_tool), laws), np.random.default_rng(777)
        q, five = poses(arm, UNSEEN, 777), drawing(arm).loads_tcp
        loads = five[rng.integers(len(five), size=UNSEEN)]
        turned = [real.rigid(each)[:3, :3] @ load for each, load in zip(q, loads, strict=True)]
        force = np.array(turned)
        for name, levels in list(COURSES.items())[: 2 if another_tool else None]:
            presses = [level * force for level in levels]
            name = f"{name}, another tool" if another_tool else name
            true = true_deflection(real, q, *presses)
            found.append(Course(name, another_tool, q, presses, true))
    return tuple(found)


@cache
def calibrated(
    laws: Laws,
    how: Procedure,
    springs: str = "auto",
    arm: str = "kuka",
    count: int = POSES,
    seed: int = 1,
) -> CalibratedModel:
    """Return what elastocal makes of a campaign."""
    rng, measured_by = np.random.default_rng(seed), MujocoArm(drawing(arm), laws)
    seen = readings(campaign(measured_by, poses(arm, count, seed), how, rng), how.conditioned)
    choice = choose_model(robot(arm), seen, springs, FitOptions())
    options = with_knowledge(FitOptions(), choice.known, choice.model, seen)
    print(arm, choice.taken)
    return calibrate(choice.model, seen, rng, options, ladder=choice.ladder).calibrated


def relative_errors(
    laws: Laws,
    how: Procedure,
    springs: str = "auto",
    arm: str = "kuka",
    count: int = POSES,
) -> dict[str, float]:
    """Return the mean error at unseen poses over the mean deflection, for each of `courses`."""
    fitted, errors = calibrated(laws, how, springs, arm, count), {}
    for course in courses(arm, laws):
        error = np.linalg.norm(course.predicted(fitted).deflection - course.true, axis=1)
        errors[course.name] = float(error.mean() / np.linalg.norm(course.true, axis=1).mean())
    print(", ".join(f"{name} {error:.2%}" for name, error in errors.items()))
    return errors


@cache
def coverage(laws: Laws, how: Procedure) -> dict[str, tuple[float, float]]:
    """Return the mean share of components at unseen poses inside the two intervals, four arms.

    Of the fit the true deflections, of a measurement the same with the noise of a tracker; for
    each of `courses`.
    """
    inside: dict[str, list[tuple[float, float]]] = {}
    for arm in ARMS:
        fitted, rng = calibrated(laws, how, arm=arm), np.random.default_rng(2)
        for course in courses(arm, laws):
            found, true = course.predicted(fitted), course.true
            seen = true + np.sqrt(2.0) * how.marker_noise * rng.standard_normal(true.shape)
            fit = np.mean((found.low <= true) & (true <= found.high))
            reading = np.mean((found.measured_low <= seen) & (seen <= found.measured_high))
            inside.setdefault(course.name, []).append((float(fit), float(reading)))
    found = {name: tuple(np.mean(each, axis=0).round(3)) for name, each in inside.items()}
    print(found)
    return found


def of_four_arms(laws: Laws, how: Procedure, count: int = POSES) -> dict[str, tuple[float, float]]:
    """Return mean and largest of the errors of the four arms, for each of `courses`."""
    each = [relative_errors(laws, how, arm=arm, count=count) for arm in ARMS]
    found = {name: [errors[name] for errors in each] for name in each[0]}
    return {name: (float(np.mean(errors)), max(errors)) for name, errors in found.items()}


@pytest.mark.parametrize("arm", ARMS)
def test_the_engine_and_pinocchio_agree_on_the_arm_of_the_drawing(arm):
    """Two readers of one URDF: what they disagree on would pass for deflection."""
    real = MujocoArm(drawing(arm), LINEAR)
    for q in poses(arm, 5, 0):
        np.testing.assert_allclose(real.rigid(q), robot(arm).forward(q), atol=1e-12)
        _, torque = real.equilibrium(q, np.zeros(3), np.zeros(len(real.k)))
        # The arm gives way under its own weight, so its torques are not quite those of the drawing.
        weight = robot(arm).gravity_torques(q)
        np.testing.assert_allclose(torque[real.is_gear], -weight, atol=0.01 * np.abs(weight).max())


def test_dahl_friction_leaves_its_lost_motion_between_a_torque_and_its_opposite():
    arm = MujocoArm(drawing("kuka"), Laws(lost_motion=HALF_A_MINUTE, dahl=50.0))
    large = np.where(arm.is_gear, 20.0 * arm.friction_limit, 0.0)
    rest, still = np.zeros(len(arm.k)), np.zeros(len(arm.k))
    forth = arm.slide(arm.slide(rest, still, large), large, still)
    back = arm.slide(arm.slide(rest, still, -large), -large, still)
    lost = (back - forth)[arm.is_gear] / arm.k[arm.is_gear]
    np.testing.assert_allclose(np.abs(lost), HALF_A_MINUTE, rtol=0.05)


def test_sag_under_gravity_is_told_from_deflection():
    """The small arms give way by centimetres, where what is bent bends otherwise."""
    for arm in ("kuka", "fanuc"):
        found = relative_errors(LINEAR, QUIET, arm=arm)
        assert max(found["full"], found["half"]) < 0.002
    found = of_four_arms(LINEAR, QUIET)
    assert found["full"][1] < 0.005
    assert found["half"][1] < 0.010


def test_bending_links_stiffening_gears_and_noise_leave_less_than_one_percent():
    found = of_four_arms(HARD, FIVE_LOADS_AND_A_LOW_ONE)
    assert found["full"][0] < 0.0075
    assert found["half"][0] < 0.0100
    assert found["full"][1] < 0.0125


def test_half_a_minute_of_lost_motion_leaves_one_percent_at_full_load_and_a_half_more_at_half():
    found = of_four_arms(STICKING, FIVE_LOADS_AND_A_LOW_ONE)
    assert found["full"][0] < 0.010
    assert found["half"][0] < 0.015
    assert found["half after full"][0] < 0.026


def test_without_friction_memory_lost_motion_leaves_several_times_as_much():
    bearing = relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE, "bearing")["full"]
    assert bearing > 4.0 * relative_errors(STICKING, FIVE_LOADS_AND_A_LOW_ONE)["full"]


def test_after_a_conditioning_press_a_press_from_rest_is_off_by_two_and_a_half_percent():
    found = of_four_arms(STICKING, CONDITIONED)
    assert found["full"][0] < 0.025
    assert found["half"][0] < 0.025


def test_six_poses_leave_a_few_percent_and_no_more_than_ten():
    for how in (FIVE_LOADS_AND_A_LOW_ONE, CONDITIONED):
        found = of_four_arms(STICKING, how, 6)
        assert found["full"][0] < 0.040
        assert found["full"][1] < 0.100


@pytest.mark.parametrize(
    ("laws", "how"),
    [
        (HARD, FIVE_LOADS_AND_A_LOW_ONE),
        (STICKING, FIVE_LOADS_AND_A_LOW_ONE),
        (STICKING, CONDITIONED),
    ],
    ids=["hard", "friction", "conditioned"],
)
def test_both_intervals_hold_at_every_load_and_with_another_tool(laws, how):
    for fit, reading in coverage(laws, how).values():
        assert 0.85 <= fit <= 0.99
        assert reading >= 0.93


def test_another_tool_leaves_some_two_percent():
    """Wrist springs that presses hardly turn took all of the noise: 3.8 to 5.5 %, once 19 %."""
    for laws, how in ((HARD, FIVE_LOADS_AND_A_LOW_ONE), (STICKING, CONDITIONED)):
        found = of_four_arms(laws, how)["full, another tool"]
        assert found[0] < 0.03
        assert found[1] < 0.05


@pytest.mark.xfail(
    strict=True,
    reason="0.6 %; the bound of an estimator that is told the law is 0.32 %, 0.41 on the KUKA",
)
def test_hard_truth_leaves_the_0_42_percent_of_issue_30():
    assert of_four_arms(HARD, FIVE_LOADS_AND_A_LOW_ONE)["full"][0] < 0.0042


@pytest.mark.xfail(
    strict=True, reason="3 %: 2 % without friction, since pulls load gears beyond all presses"
)
def test_reversals_leave_the_2_6_percent_of_issue_30():
    assert of_four_arms(STICKING, FIVE_LOADS_AND_A_LOW_ONE)["reversed"][0] < 0.026
