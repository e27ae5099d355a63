"""Secondary encoders in production: what they see beyond the model moves the correction."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.cell import SensorLoad
from elastocal.compensation import CompensatorSettings
from elastocal.compensation.kernel import compiled, joint_deflections
from elastocal.compensation.online import Compensator, Reading
from elastocal.compensation.online.state import Status
from elastocal.elastic import layout
from elastocal.errors import CompensationError
from elastocal.identification import CalibratedModel, EncoderZero
from elastocal.robot import Robot
from support.compensated import calibrated
from support.virtual_chain import ARMS

CYCLE = 0.004
FORCE = np.array([-900.0, 120.0, 250.0])


@cache
def model(springs: str = "bearing") -> CalibratedModel:
    """Return a model whose joints 2 and 3 had encoders in its calibration."""
    robot = Robot.from_urdf(ARMS["six axes"], "tcp")
    names = robot.joint_names
    zeros = tuple(
        EncoderZero(names[joint], 1e-3 * joint, 4e-7, 2e-4, -1e-4, 2e-5) for joint in (1, 2)
    )
    return replace(calibrated(robot, layout(robot, springs)), encoders=zeros)


def compensator(average: str = "1 ms", **limits) -> Compensator:
    joints = [zero.joint for zero in model().encoders]
    settings = CompensatorSettings(
        encoders={"joints": joints, "average": average},
        limits={"rate": "1 m/s", "correction": "50 mm", **limits},
        filter={"low_pass": None, "lead": None},
        uncertain_above="50 mm",
    )
    return Compensator.of(model(), settings, SensorLoad())


def posture() -> np.ndarray:
    return np.array([0.2, -1.1, 1.3, 0.4, -0.6, 0.3])


def in_tcp(q: np.ndarray) -> np.ndarray:
    return model().model.robot.forward(q)[:3, :3].T @ FORCE


def in_air(q: np.ndarray) -> np.ndarray:
    """Return what encoders read in the air, by the formula of the model file."""
    posed = model().model.at(q)
    joints = [model().model.robot.joint_names.index(zero.joint) for zero in model().encoders]
    return np.array(
        [
            zero.offset + zero.weight * posed.joint_weight[j] + zero.sine * np.sin(q[j])
            + zero.cosine * np.cos(q[j])
            for j, zero in zip(joints, model().encoders, strict=True)
        ]
    )  # fmt: skip


def run(steps, extra=None, links=True):
    """Return states and answers of cycles in the air, then under load, encoders zeroed between."""
    made, q = compensator(), posture()
    state, answers = made.start(), []
    own = [1, 2]
    yields = model().model.joint_blocks(q, FORCE) @ model().compliance
    for step in range(steps):
        loaded = step >= steps // 2
        force = in_tcp(q) if loaded else np.zeros(3)
        seen = q[own] + in_air(q) + (yields[own] if loaded else 0.0)
        if loaded and extra is not None:
            seen = seen + extra
        reading = Reading(step * CYCLE, q.tolist(), force.tolist(), [0.0] * 3)
        state = made.condition(state, reading)
        state, answer = made.correct(state, q.tolist(), seen.tolist() if links else None)
        answers.append(answer)
        if step == steps // 2 - 1:
            state = made.zero_encoders(state)
    return state, answers


def test_the_program_gives_what_the_model_says_of_each_joint():
    q, zeros = posture(), model().encoders
    function = compiled(joint_deflections(model().model, model().compliance, zeros), 6)
    out = np.array(function(q.tolist(), FORCE.tolist(), [3.0, -4.0, 5.0]))
    yields = model().model.joint_blocks(q, FORCE, np.array([3.0, -4.0, 5.0])) @ model().compliance
    np.testing.assert_allclose(out[:2], yields[[1, 2]] + in_air(q), rtol=1e-9)
    J = model().model.robot.jacobian(q).translation
    np.testing.assert_allclose(out[2:].reshape(2, 3), J[:, [1, 2]].T, atol=1e-12)


def test_encoders_that_see_what_the_model_says_change_nothing():
    _, seen = run(60)
    _, alone = run(60, links=False)
    # While the force rises its filters are late, which encoders are not.
    np.testing.assert_allclose(seen[-1].correction, alone[-1].correction, atol=1e-12)
    assert not seen[-1].status
    assert alone[-1].status == Status.ENCODER


def test_what_they_see_beyond_the_model_moves_the_tool_by_the_jacobian():
    extra = np.array([2e-4, -1e-4])
    _, answers = run(200, extra)
    J = model().model.robot.jacobian(posture()).translation[:, [1, 2]]
    expected = model().model.deflection(model().compliance, posture(), FORCE) + J @ extra
    np.testing.assert_allclose(answers[-1].deflection, expected, atol=1e-9)
    np.testing.assert_allclose(answers[-1].correction, -expected, atol=1e-9)


def test_zeroed_encoders_leave_only_the_rest_of_the_interval():
    names = model().model.parameter_names
    seen = [f"{zero.joint}.axial" for zero in model().encoders]
    rest = [n for n, name in enumerate(names) if name not in seen]
    assert len(rest) == len(names) - 2
    O = model().model.observation_blocks(posture(), FORCE)  # noqa: E741 - paper
    scatter = np.std(model().draws[:, rest] @ O[:, rest].T, axis=0, ddof=1)
    _, answers = run(60)
    assert answers[-1].half_width == pytest.approx(1.96 * scatter.max(), rel=0.05)


def test_without_a_zero_the_model_alone_corrects():
    made, q = compensator(), posture()
    state = made.start()
    for step in range(20):
        reading = Reading(step * CYCLE, q.tolist(), in_tcp(q).tolist(), [0.0] * 3, links=[9.0, 9.0])
        state, answer = made.step(state, reading)
    alone = model().model.deflection(model().compliance, q, FORCE)
    np.testing.assert_allclose(answer.deflection, alone, atol=1e-9)


@pytest.mark.parametrize("links", [None, [0.1], [float("nan"), 0.1], [float("inf"), 0.1]])
def test_a_link_that_is_not_read_keeps_what_was_seen_last_and_says_so(links):
    state, answers = run(200, np.array([2e-4, 0.0]))
    made, q = compensator(), posture()
    reading = Reading(201 * CYCLE, q.tolist(), in_tcp(q).tolist(), [0.0] * 3)
    state, answer = made.correct(made.condition(state, reading), q.tolist(), links)
    assert answer.status & Status.ENCODER
    np.testing.assert_allclose(answer.deflection, answers[-1].deflection, atol=1e-9)


@pytest.mark.parametrize("lost", [2.0 * np.pi, -0.02, 3.2e-3])
def test_a_zeroed_encoder_that_loses_its_count_is_not_followed(lost):
    extra = np.array([2e-4, 0.0])
    state, sound = run(200, extra)
    made, q = compensator(), posture()
    yields = model().model.joint_blocks(q, FORCE) @ model().compliance
    links = q[[1, 2]] + in_air(q) + yields[[1, 2]] + extra + [lost, 0.0]
    for step in range(201, 230):
        reading = Reading(step * CYCLE, q.tolist(), in_tcp(q).tolist(), [0.0] * 3)
        state, answer = made.correct(made.condition(state, reading), q.tolist(), links.tolist())
        assert answer.status & Status.ENCODER
    np.testing.assert_allclose(answer.deflection, sound[-1].deflection, atol=1e-9)


@pytest.mark.slow
def test_noise_is_smoothed_over_the_stated_time():
    made, q = compensator("100 ms"), posture()
    rng, state, beyond = np.random.default_rng(0), made.start(), []
    for step in range(4000):
        seen = q[[1, 2]] + in_air(q) + 1e-5 * rng.standard_normal(2)
        reading = Reading(step * CYCLE, q.tolist(), [0.0] * 3, [0.0] * 3, links=seen.tolist())
        state, _ = made.step(state, reading)
        beyond.append(state.beyond)
    share = 1.0 - np.exp(-CYCLE / 0.1)
    expected = 1e-5 * np.sqrt(share / (2.0 - share))
    assert np.std(beyond[200:]) == pytest.approx(expected, rel=0.2)


def test_no_reading_of_encoders_exceeds_the_limits():
    made, q = compensator(correction="1 mm", rate="0.03 m/s", fade="0.005 m/s"), posture()
    rng, state, before = np.random.default_rng(1), made.start(), np.zeros(3)
    for step in range(300):
        links = rng.choice([0.0, 5.0, -900.0, np.nan, 1e308], 2).tolist()
        reading = Reading(step * CYCLE, q.tolist(), in_tcp(q).tolist(), [0.0] * 3, links=links)
        state, answer = made.step(state, reading)
        state = made.zero_encoders(state) if step == 50 else state
        correction = np.array(answer.correction)
        assert np.linalg.norm(correction) <= 1e-3 + 1e-12
        assert np.linalg.norm(correction - before) <= 0.03 * CYCLE + 1e-12
        before = correction


def test_a_joint_that_had_no_encoder_in_the_calibration_is_refused():
    name = model().model.robot.joint_names[0]
    with pytest.raises(CompensationError, match="had no secondary encoder in the calibration"):
        Compensator.of(model(), CompensatorSettings(encoders={"joints": [name]}))
