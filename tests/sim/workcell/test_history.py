"""What a pose measures depends on seed and pose, not on what happened before."""

import numpy as np
import pytest

from support.simulated import CYCLE, Session, example_cell, places

PRESS = (150.0, 0.0, -800.0)


def visit(session, place):
    """Return everything that the devices say during one pose, times from its approach."""
    session.arm.move_joints(place.q_approach, 1.0)
    session.wait_idle()
    session.devices.sensor.read(), session.devices.metrology.read()
    begin = session.clock.now()
    rows = []

    def look(cycles):
        for _ in range(cycles):
            session.clock.sleep(CYCLE)
            wrench, points = session.devices.sensor.read(), session.devices.metrology.read()
            rows.append(np.concatenate([wrench.force, wrench.moment, points.position], axis=1))
            rows[-1] = np.column_stack([wrench.time - begin, points.time - begin, rows[-1]])

    session.arm.approach(-place.normal, 0.097, 0.1, 60.0)
    look(50)
    session.arm.approach(-place.normal, 0.012, 0.005, 60.0)
    look(50)
    for force in (PRESS, (0.0, 0.0, -800.0)):
        session.arm.hold(np.array(force), 800.0)
        look(60)
    q = session.arm.state().q
    session.leave(place)
    return np.concatenate(rows), q


@pytest.fixture
def session_of():
    def make(seed=4, start=0.0):
        session = Session.of(example_cell(), seed, start)
        session.wait_idle = lambda: session.wait(type(session.arm.state().motion).IDLE)
        return session

    return make


def test_the_same_seed_gives_the_same_run(session_of):
    (a, q_a), (b, q_b) = (visit(session_of(), places()[0]) for _ in range(2))
    np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(q_a, q_b)


def test_another_seed_gives_another_run(session_of):
    (a, _), (b, _) = (visit(session_of(seed), places()[0]) for seed in (1, 2))
    assert np.abs(a[:, 2:8] - b[:, 2:8]).min(axis=0).max() > 0.0


@pytest.mark.slow
def test_a_pose_measures_the_same_first_or_last_early_or_late(session_of):
    alone, q_alone = visit(session_of(start=1000.0), places()[2])
    session = session_of()
    for place in places()[:2]:
        visit(session, place)
    session.clock.sleep(12.3456)
    after, q_after = visit(session, places()[2])
    np.testing.assert_allclose(after, alone, atol=1e-9)
    np.testing.assert_array_equal(after[:, 2:], alone[:, 2:])
    np.testing.assert_array_equal(q_after, q_alone)


@pytest.mark.slow
def test_a_pose_that_is_done_again_after_a_stop_measures_the_same(session_of):
    place = places()[1]
    alone, _ = visit(session_of(), place)
    session = session_of()
    session.near(place)
    session.touch(place)
    session.arm.hold(np.array(PRESS), 300.0)
    session.clock.sleep(1.0)
    session.arm.stop()
    session.arm.enable()
    session.leave(place)
    again, _ = visit(session, place)
    np.testing.assert_array_equal(again[:, 2:], alone[:, 2:])


def test_noise_of_one_pose_is_not_that_of_another(session_of):
    session = session_of()
    (a, _), (b, _) = (visit(session, place) for place in places()[:2])
    noise = [rows[10:40, 2:8] - rows[10:40, 2:8].mean(axis=0) for rows in (a, b)]
    assert abs(np.corrcoef(noise[0].ravel(), noise[1].ravel())[0, 1]) < 0.5
