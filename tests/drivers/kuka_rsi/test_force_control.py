"""The admittance law against stiff contacts and long delays, and the watch for collisions."""

import math

import numpy as np
import pytest

from elastocal.cell import CollisionWatch, SensorStatus, WrenchSample
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, ForceReader, overshoot

CYCLE = 0.004
FILTER = 0.01


def respond(law: ForceLaw, stiffness: float, motion_delay: float, seconds: float = 6.0):
    """Return the force of a contact, pressed along z from 50 N to 500 N at 2 kN/s.

    A contact is a spring; the arm moves as told, `motion_delay` and a cycle later; the force comes
    through the filter of the reader, a cycle old.
    """
    late = math.ceil(motion_delay / CYCLE) + 1
    moves, at = [0.0] * late, -50.0 / stiffness
    smooth, reference, forces = -50.0, -50.0, []
    for _ in range(round(seconds / CYCLE)):
        force = stiffness * at
        smooth += CYCLE / (CYCLE + FILTER) * (force - smooth)
        reference = max(-500.0, reference - 2000.0 * CYCLE)
        speed = law.speed(np.array([0.0, 0.0, smooth - reference]))[2]
        moves.append(speed * CYCLE)
        at -= moves.pop(0)
        forces.append(force)
    return np.array(forces)


@pytest.mark.parametrize("motion_delay", [0.008, 0.02, 0.04, 0.08, 0.12])
@pytest.mark.parametrize("softer", [1.0, 0.25])
def test_it_settles_without_overshoot_against_four_newton_per_micrometre(motion_delay, softer):
    law = ForceLaw.design(4e6, motion_delay, CYCLE, 0.005)
    force = respond(law, softer * 4e6, motion_delay, 12.0)
    assert force.min() > -500.0 * 1.01
    last = round((12.0 - law.settling(softer * 4e6) - 1.0) / CYCLE)
    assert last > 0
    np.testing.assert_allclose(force[-last:], -500.0, rtol=0.01)


@pytest.mark.parametrize("motion_delay", [0.008, 0.12])
def test_the_gain_margin_is_where_it_begins_to_swing(motion_delay):
    law = ForceLaw.design(4e6, motion_delay, CYCLE, 1e3)
    margin = law.gain_margin(4e6)
    assert margin == pytest.approx(2.0 * math.pi)
    assert math.degrees(law.phase_margin(4e6)) == pytest.approx(90.0 - math.degrees(0.25))
    inside = respond(law, 0.7 * margin * 4e6, motion_delay)
    outside = respond(law, 1.6 * margin * 4e6, motion_delay)
    assert np.ptp(inside[-200:]) < 5.0
    assert np.ptp(outside[-200:]) > 500.0


def test_the_speed_is_bounded_and_keeps_its_direction():
    law = ForceLaw.design(1e6, 0.01, CYCLE, 0.005)
    speed = law.speed(np.array([3e3, 0.0, -4e3]))
    np.testing.assert_allclose(speed, [0.003, 0.0, -0.004])
    np.testing.assert_allclose(law.speed(np.array([0.0, 0.0, 1.0])), [0, 0, law.gain])


def test_a_slow_robot_presses_much_beyond_the_force_at_which_it_stops():
    assert overshoot(0.005, 4e6, 0.12) == pytest.approx(2400.0)


class Samples:
    """A feed that a test sets."""

    def __init__(self) -> None:
        self.sample: WrenchSample | None = None

    def put(self, time, force, status=SensorStatus.OK):
        self.sample = WrenchSample(time, np.array(force, dtype=float), np.zeros(3), status)

    def newest(self):
        return self.sample


def test_the_zero_takes_bias_and_weight_and_the_frame_is_the_tcps():
    samples, T = Samples(), np.eye(4)
    T[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    reader = ForceReader(samples, T, CYCLE)
    reader.begin_zero(0.0)
    for k in range(60):
        samples.put(CYCLE * k, [5.0, 7.0, -300.0])
        reader.look(CYCLE * k)
        if reader.is_zeroed(CYCLE * k):
            break
    assert CYCLE * k == pytest.approx(0.2, abs=CYCLE)
    samples.put(1.0, [15.0, 7.0, -310.0])
    reader.look(1.0)
    np.testing.assert_allclose(reader.quick_force_tcp, [0.0, 10.0, -10.0])
    assert 0.0 < reader.force_tcp[1] < 10.0


def test_an_old_sample_first_holds_the_arm_and_then_is_a_fault():
    samples = Samples()
    reader = ForceReader(samples, np.eye(4), CYCLE)
    assert reader.problem() == "force sensor has sent nothing"
    samples.put(1.0, [0, 0, 0])
    reader.look(1.01)
    assert not reader.hesitates
    reader.look(1.05)
    assert reader.hesitates
    assert reader.problem() is None
    reader.look(2.2)
    assert reader.problem() == "force sensor silent for 1.20 s"


@pytest.mark.parametrize(
    ("force", "status", "reason"),
    [
        ([0, 0, 0], SensorStatus.SATURATED, "says saturated"),
        ([0, 0, 0], SensorStatus.FAULT, "says fault"),
        ([0, np.nan, 0], SensorStatus.OK, "says NaN"),
    ],
)
def test_a_sensor_that_cannot_be_trusted_is_named(force, status, reason):
    samples = Samples()
    reader = ForceReader(samples, np.eye(4), CYCLE)
    samples.put(0.0, [1.0, 2.0, 3.0])
    reader.look(0.0)
    for k in range(1, 400):
        samples.put(CYCLE * k, force, status)
        reader.look(CYCLE * k)
    np.testing.assert_array_equal(reader.raw, [1.0, 2.0, 3.0])
    assert reader.hesitates
    assert reason in reader.problem()


def turned(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def test_turning_the_tool_is_no_collision_and_a_blow_is():
    weight, bias = np.array([0.0, 0.0, -400.0]), np.array([30.0, -20.0, 10.0])
    watch = CollisionWatch(weight, 100.0)
    for k in range(500):  # 115 degrees a second
        R = turned(2.0 * CYCLE * k)
        assert watch.look(CYCLE * k, R.T @ weight + bias, R) is None
    found = watch.look(CYCLE * 500, R.T @ (weight + np.array([0.0, 120.0, 0.0])) + bias, R)
    assert found.startswith("the force changed by")
    assert "limit 100 N" in found
