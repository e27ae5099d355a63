"""What the compensator remembers of friction, when it forgets, and what it never hears of."""

import numpy as np
import pytest

from elastocal.compensation.online import Compensator, Reading, Status
from support.compensated import settings
from support.geared import SLIPS, geared

Q = [0.2, -0.7, 1.1, 0.5, -0.6, 0.3]
CYCLE = 0.004
PLAIN = {
    "deadband": "0 mm",
    "filter": {"median": 1, "low_pass": None},
    "limits": {"correction": "20 mm", "rate": "1 m/s", "fade": "1 m/s"},
    "friction": {"free_below": 0.5, "free_after": "40 ms"},
}
AIR = (0.0, 0.0, 0.0)
PRESS, HALF = (300.0, -150.0, -900.0), (150.0, -75.0, -450.0)


@pytest.fixture
def compensator():
    return Compensator.of(geared(), settings(**PLAIN))


def begun(compensator):
    """Return the state after the first reading, which no time comes before: it is not used."""
    return fed(compensator, compensator.start(), PRESS)[0]


def fed(compensator, state, *forces, **changes):
    """Return the state and the answers after readings that come in time."""
    answers = []
    for force in forces:
        reading = Reading(max(state.time, 0.0) + CYCLE, Q, force, AIR)._replace(**changes)
        state, answer = compensator.step(state, reading)
        answers.append(answer)
    return state, answers


def expected(*forces):
    """Return the deflections of loads one after the other, the first pressed from rest."""
    model, c = geared().model, geared().compliance
    q, R = np.array([Q] * len(forces)), geared().model.robot.forward(Q)[:3, :3]
    f = np.array(forces) @ R.T
    weight = model.weight_torques(q)
    way = np.concatenate([weight[:1], weight + model.load_torques(q, f)])
    return model.deflection(c, q, f, friction=model.friction.path(way)[1:])


def test_presses_and_releases_are_those_of_the_model_along_its_path(compensator):
    forces = [PRESS, HALF, PRESS, AIR, HALF, (-300.0, 400.0, -200.0), HALF]
    _, answers = fed(compensator, begun(compensator), *forces)
    found = [answer.deflection for answer in answers]
    np.testing.assert_allclose(found, expected(*forces), rtol=1e-10, atol=1e-13)
    # Half the load after the whole deflects otherwise than before it.
    before = expected(HALF)[0]
    assert np.linalg.norm(found[1] - before) > 1e-5


def test_a_free_motion_wipes_the_memory_and_a_load_through_zero_does_not(compensator):
    pressed, _ = fed(compensator, begun(compensator), PRESS)
    _, through_zero = fed(compensator, pressed, AIR, HALF)
    np.testing.assert_allclose(through_zero[-1].deflection, expected(PRESS, AIR, HALF)[-1])
    _, after = fed(compensator, pressed, *[AIR] * 11, HALF)
    np.testing.assert_allclose(after[-1].deflection, expected(HALF)[0], rtol=1e-10)
    _, early = fed(compensator, pressed, *[AIR] * 9, HALF)
    np.testing.assert_allclose(early[-1].deflection, through_zero[-1].deflection, rtol=1e-10)


def test_noise_below_a_share_of_the_smallest_limit_counts_as_air(compensator):
    model, R = geared().model, geared().model.robot.forward(Q)[:3, :3]
    per_newton = np.abs(model.load_torques(Q, R @ (0.0, 0.0, 1.0))[:6]).max()
    for share, wiped in ((0.45, True), (0.55, False)):
        push = (0.0, 0.0, share * SLIPS[0] / per_newton)
        state, _ = fed(compensator, begun(compensator), PRESS, *[push] * 11)
        assert (state.unloaded == 10) == wiped


def test_the_interval_holds_what_friction_may_have_borne_before_until_it_is_wiped(compensator):
    state, told = fed(compensator, begun(compensator), AIR, HALF)
    model, c, q = geared().model, geared().compliance, np.array(Q)
    # Free: each element may bear its whole limit, whatever the others do.
    limits = np.diag(model.friction.limit)
    still = model.deflection(c, q, AIR, friction=np.zeros(len(limits)))
    moved = [model.deflection(c, q, AIR, friction=one) - still for one in limits]
    assert told[0].half_width == pytest.approx(np.abs(moved).sum(axis=0).max(), rel=1e-9)
    big = 2400.0 * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    _, wiped = fed(compensator, state, *big, HALF)
    R = model.robot.forward(Q)[:3, :3]
    f = np.array([HALF, *big, HALF]) @ R.T
    poses = np.array([q] * len(f))
    weight = model.weight_torques(poses)
    way = np.concatenate([weight[:1], weight + model.load_torques(poses, f)])
    assert np.all(np.ptp(way, axis=0)[:6] > 2.0 * max(SLIPS))
    block = model.observation_blocks(q, f[-1], friction=model.friction.path(way)[-1])
    deviation = (block @ geared().draws.T).std(axis=1, ddof=1).max()
    assert wiped[-1].half_width == pytest.approx(1.959964 * deviation, rel=1e-6)


BAD = {
    "NaN force": {"force": (np.nan, 0.0, 0.0)},
    "NaN joint": {"q": [np.nan, *Q[1:]]},
    "beyond the range": {"force": (0.0, 0.0, 2600.0)},
    "sensor says so": {"ok": False},
    "stale": {"time": 0.0},
}


@pytest.mark.parametrize("kind", BAD)
def test_readings_that_cannot_be_used_never_enter_the_memory(compensator, kind):
    state, _ = fed(compensator, begun(compensator), PRESS, HALF)
    after, answers = fed(compensator, state, PRESS, **BAD[kind])
    assert answers[0].status & Status.HELD
    assert (after.friction, after.unloaded) == (state.friction, state.unloaded)
    _, (again,) = fed(compensator, after, HALF)
    np.testing.assert_allclose(again.deflection, expected(PRESS, HALF)[-1], rtol=1e-10)


def test_when_the_correction_fades_the_memory_is_free_again(compensator):
    state, _ = fed(compensator, begun(compensator), PRESS)
    state, answers = fed(compensator, state, *[PRESS] * 40, ok=False)
    assert answers[-1].status & Status.FADED
    _, (answer,) = fed(compensator, state, HALF)
    np.testing.assert_allclose(answer.deflection, expected(HALF)[0], rtol=1e-10)


def test_a_step_keeps_the_state_it_was_given(compensator):
    state, _ = fed(compensator, begun(compensator), PRESS)
    once = fed(compensator, state, HALF, AIR, PRESS)
    assert fed(compensator, state, HALF, AIR, PRESS) == once
