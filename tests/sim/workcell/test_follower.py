"""What a robot feels that is led by commanded poses, against one whose segments are planned."""

import numpy as np
import pytest

from elastocal.cell import Motion
from elastocal.sim.workcell import PoseFollower
from support.by_day import some_by_day
from support.simulated import QUIET, Session, example_cell, places

CYCLE = 0.004


class Led:
    """A robot that stands where it has begun to be led by poses."""

    def __init__(self, like="afp", preset="kind", simulation=QUIET, **sections):
        cell = example_cell(like, simulation={"preset": preset} | simulation, **sections)
        self.session, self.place = Session.of(cell), places(like)[1]
        self.session.arm.move_joints(self.place.q_approach, 1.0)
        self.session.wait(Motion.IDLE)
        self.plant = self.session.sim.plant
        self.follower = PoseFollower(self.plant)
        self.follower.begin()

    def lead(self, T, speed=0.02, rest=0.0):
        start = self.follower.T
        steps = max(1, int(np.linalg.norm(T[:3, 3] - start[:3, 3]) / speed / CYCLE))
        for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
            between = T.copy()
            between[:3, 3] = start[:3, 3] + part * (T[:3, 3] - start[:3, 3])
            self.step(between)
        for _ in range(round(rest / CYCLE)):
            self.step(T)

    def step(self, T):
        self.session.clock.sleep(CYCLE)
        self.follower.follow(T, CYCLE)

    def shifted(self, shift):
        T = self.follower.T.copy()
        T[:3, 3] += shift
        return T

    def press(self, force=600.0):
        """Go down until the surface pushes back so much."""
        outward = -self.place.normal
        self.lead(self.shifted(0.09 * outward), 0.5)
        while np.linalg.norm(self.follower.force) < force:
            self.step(self.shifted(0.005 * CYCLE * outward))

    @property
    def seen(self):
        return self.plant.segment.path.knots.seen[-1]


@pytest.fixture(scope="module")
def pressed():
    led = Led()
    led.press()
    return led


@pytest.mark.parametrize(
    ("like", "preset", "force_off", "marker_off"),
    some_by_day([("afp", "typical", 5.0, 5e-6), ("afp", "kind", 2.0, 2e-6),
                 ("machining", "kind", 3.0, 2e-6)]),
)  # fmt: skip
def test_force_and_marker_at_rest_are_those_of_the_planned_segment(
    like, preset, force_off, marker_off
):
    planned, led = Led(like, preset), Led(like, preset)
    session = planned.session
    session.near(planned.place)
    session.touch(planned.place)
    forward = planned.plant.statics.robot.forward
    touch = forward(planned.plant.contact.q_touch)
    for gap, speed in ((1e-3, 0.5), (1e-6, 0.005)):
        above = touch.copy()
        above[:3, 3] += gap * planned.place.normal
        led.lead(above, speed, rest=0.1)
    for wanted in planned.plant.cell.file.load_cases.force_tcp[:3]:
        session.hold(wanted)
        state = planned.plant.robot_state()
        led.lead(forward(state.q), rest=0.6)
        assert np.linalg.norm(state.force) > 1000.0
        np.testing.assert_allclose(led.follower.force, state.force, atol=force_off)
        np.testing.assert_allclose(led.seen[:3], planned.seen[:3], atol=marker_off)
        np.testing.assert_allclose(led.seen[3:], planned.seen[3:], atol=1.5 * force_off)


def test_joints_bring_the_tool_where_it_is_commanded(pressed):
    T = pressed.shifted(1e-4 * pressed.follower.T[:3, 0])
    pressed.lead(T, rest=0.04)
    reached = pressed.plant.statics.robot.forward(pressed.follower.q)
    np.testing.assert_allclose(reached, T, atol=1e-9)


def test_the_contact_slides_at_coulombs_limit(pressed):
    follower, law = pressed.follower, pressed.plant.contact_law
    before = follower.contact.anchor
    pressed.lead(pressed.shifted(4e-3 * follower.T[:3, 0]), 0.01)
    force_tcp = follower.T[:3, :3].T @ follower.force
    assert law.effort(force_tcp) == pytest.approx(0.999, abs=0.01)
    assert force_tcp[0] < 0.0
    assert np.linalg.norm(follower.contact.anchor - before) > 2e-3


def test_no_force_is_left_where_the_tool_is_away(pressed):
    pressed.lead(pressed.shifted(0.01 * pressed.place.normal), rest=0.6)
    follower, statics = pressed.follower, pressed.plant.statics
    assert follower.contact is None
    assert not np.any(follower.force)
    free = statics.free(follower.q, np.zeros(3), None)
    expected = statics.path(free, free).knots.seen[0]
    np.testing.assert_allclose(pressed.seen, expected, atol=1e-6)


def test_sensor_and_tracker_miss_no_sample_while_the_robot_is_led():
    led = Led(simulation={})
    sensor, tracker = led.session.devices.sensor, led.session.devices.metrology
    sensor.read(), tracker.read()
    led.lead(led.shifted(np.array([0.0, 0.0, 0.004])), rest=0.8)
    for device in (sensor, tracker):
        time = device.read().time
        assert len(time) >= 99  # counted anew where the visit begins
        assert np.diff(time).max() < 0.02


def test_a_fault_of_the_cell_stops_the_arm():
    fault = {"kind": "robot_stop", "pose": 0, "step": "approach", "after": "50 ms"}
    led = Led(faults=[fault])
    led.lead(led.follower.T, rest=0.1)
    led.lead(led.shifted(0.04 * CYCLE * led.place.normal))
    assert (led.plant.visit, led.follower.stopped) == (0, None)
    led.lead(led.follower.T, rest=0.06)
    assert led.follower.stopped == "stopped by the safety controller"


def test_a_surface_that_a_fault_takes_away_is_not_touched():
    led = Led(faults=[{"kind": "contact_missed", "pose": 0}])
    led.lead(led.shifted(-0.12 * led.place.normal), 0.5)
    assert led.follower.contact is None
