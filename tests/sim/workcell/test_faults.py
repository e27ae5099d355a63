"""Every injected fault shows, at its pose and its moment, and not elsewhere."""

import numpy as np
import pytest

from elastocal.cell.devices import BeamState, Motion, SensorStatus
from elastocal.errors import DeviceError
from elastocal.sim.workcell import simulated_devices
from support.simulated import QUIET, Session, example_cell, places

PRESS = (100.0, 0.0, -800.0)


def session_with(fault, simulation=QUIET, like="afp"):
    return Session.of(example_cell(like, simulation=simulation, faults=[fault]))


def held(fault, visits=1, **options):
    """Return a session that holds the first load case of a visit."""
    session = session_with(fault, **options)
    for visit in range(visits):
        session.near(places()[0])
        session.touch(places()[0])
        if visit + 1 < visits:
            session.arm.hold(np.array(PRESS), 4000.0)
            session.clock.sleep(2.5)
            session.leave(places()[0])
    session.devices.sensor.read(), session.devices.metrology.read()
    session.arm.hold(np.array(PRESS), 4000.0)
    return session


def span(kind, **more):
    return {"kind": kind, "pose": 0, "step": "hold", "after": "1 s", "duration": "0.5 s", **more}


def looks(session, device, seconds=2.0):
    for _ in range(round(seconds / 0.1)):
        session.clock.sleep(0.1)
        yield session.clock.now(), device.read()


class TestBeamBreak:
    def test_no_points_come_until_the_beam_is_back(self):
        session = held(span("beam_break"))
        start = session.clock.now()
        for now, block in looks(session, session.devices.metrology):
            inside = 1.0 <= round(now - start, 6) < 1.5
            assert (block.beam is BeamState.BROKEN) is inside
        assert len(block) == 10

    def test_for_good_it_does_not_come_back(self):
        fault = span("beam_break")
        del fault["duration"]
        session = held(fault)
        session.clock.sleep(2000.0)
        session.devices.metrology.look("station_1")
        assert session.devices.metrology.read().beam is BeamState.BROKEN

    def test_another_station_may_still_see(self):
        fault = {"kind": "beam_break", "pose": 0, "step": "approach", "station": "station_2"}
        session, place = session_with(fault, like="machining"), places("machining")[0]
        session.near(place)
        for station, beam in (("station_2", BeamState.BROKEN), ("station_1", BeamState.LOCKED)):
            session.devices.metrology.look(station)
            session.clock.sleep(0.1)
            assert session.devices.metrology.read().beam is beam

    def test_at_another_visit_nothing_happens(self):
        session = held(span("beam_break", pose=1))
        assert all(b.beam is BeamState.LOCKED for _, b in looks(session, session.sim.tracker))


class TestForceSensor:
    def test_a_dropout_leaves_empty_blocks(self):
        session = held(span("ft_dropout"))
        counts = [len(block) for _, block in looks(session, session.devices.sensor)]
        assert counts.count(0) >= 4
        assert counts[-1] == 10

    def test_a_frozen_sensor_repeats_itself_with_new_times(self):
        session = held(span("ft_frozen"), simulation={})
        frozen = 0
        for _, block in looks(session, session.devices.sensor):
            assert len(block) == 10
            frozen += bool(np.ptp(block.force) and np.all(np.ptp(block.force, axis=0) == 0.0))
        assert frozen >= 4
        assert np.all(np.ptp(block.force, axis=0) > 0.0)

    def test_saturation_is_said(self):
        session = held(span("ft_saturation"))
        states = [block.status for _, block in looks(session, session.devices.sensor)]
        assert 5 <= states.count(SensorStatus.SATURATED) <= 6
        assert states[-1] is SensorStatus.OK

    def test_a_heavier_tool_is_felt_from_then_on(self):
        session = session_with({"kind": "tool_weight", "pose": 1, "mass": "3 kg"})
        found = []
        for _ in range(3):
            session.near(places()[0])
            found.append(np.linalg.norm(session.average()[0][:3] - session.sim.sensor.zero[:3]))
        assert found[1] - found[0] == pytest.approx(3 * 9.80665, rel=1e-3)
        assert found[2] == pytest.approx(found[1])


class TestArm:
    def test_a_slip_moves_marker_and_controller_alike_against_the_force(self):
        fault = {"kind": "slip", "pose": 0, "load": 0, "after": "2.5 s", "distance": "2 mm"}
        session = held(fault)
        session.clock.sleep(2.3)
        before, (wrench, marker) = session.arm.state(), session.average(0.1)
        session.clock.sleep(3.0)
        after, (wrench_after, marker_after) = session.arm.state(), session.average(0.1)
        moved = after.T_base_tcp[:3, 3] - before.T_base_tcp[:3, 3]
        along = -before.T_base_tcp[:3, 0]
        np.testing.assert_allclose(moved, 2e-3 * along, atol=3e-5)
        np.testing.assert_allclose(marker_after - marker, moved, atol=3e-5)
        np.testing.assert_allclose(wrench_after[:3], wrench[:3], atol=0.5)

    def test_a_slip_that_comes_too_late_does_not_come(self):
        session = held({"kind": "slip", "pose": 0, "after": "60 s", "distance": "2 mm"})
        session.clock.sleep(3.0)
        session.leave(places()[0])
        before = session.arm.state().q
        session.clock.sleep(60.0)
        np.testing.assert_array_equal(session.arm.state().q, before)

    def test_a_force_that_never_comes_to_rest(self):
        session = held({"kind": "never_stable", "pose": 0, "load": 0, "amplitude": "60 N"})
        session.clock.sleep(3.0)
        session.devices.sensor.read()
        session.clock.sleep(4.0)
        assert session.devices.sensor.read().force[:, 2].std() > 15.0
        session.hold(PRESS)
        session.devices.sensor.read()
        session.clock.sleep(1.0)
        assert session.devices.sensor.read().force[:, 2].std() < 1.0

    def test_a_contact_that_is_missed(self):
        session, place = session_with({"kind": "contact_missed", "pose": 0}), places()[0]
        session.near(place)
        assert not session.touch(place).in_contact
        session.near(place)
        assert session.touch(place).in_contact

    def test_it_can_be_missed_at_several_visits_in_a_row(self):
        session = session_with({"kind": "contact_missed", "pose": 0, "visits": 2})
        missed = []
        for _ in range(3):
            session.near(places()[0])
            missed.append(not session.touch(places()[0]).in_contact)
            session.arm.retract(places()[0].normal, 0.05, 0.1)
            session.wait(Motion.IDLE)
        assert missed == [True, True, False]

    def test_a_robot_stop_stands_for_its_time_and_keeps_the_force(self):
        session = held(span("robot_stop", duration="2 s"))
        session.clock.sleep(0.9)
        assert session.arm.state().motion is Motion.HOLDING
        session.clock.sleep(0.2)
        state = session.arm.state()
        assert state.motion is Motion.STOPPED
        assert "safety" in state.fault
        with pytest.raises(DeviceError, match="safety"):
            session.arm.enable()
        session.clock.sleep(2.0)
        session.arm.enable()
        assert session.arm.state().fault is None
        assert session.leave(places()[0]).motion is Motion.IDLE

    def test_a_robot_stop_strikes_in_the_middle_of_a_long_sleep(self):
        fault = {"kind": "robot_stop", "pose": 0, "step": "approach", "after": "0.4 s"}
        session, place = session_with(fault), places()[0]
        session.arm.move_joints(place.q_approach, 1.0)
        session.wait(Motion.IDLE)
        start = session.arm.state().T_base_tcp[:3, 3]
        session.arm.approach(-place.normal, 0.09, 0.1, 60.0)
        session.clock.sleep(10.0)
        way = session.arm.state().T_base_tcp[:3, 3] - start
        assert np.linalg.norm(way) == pytest.approx(0.04, rel=1e-3)

    def test_a_stale_clock_stands_while_the_arm_goes_on(self):
        session = held(span("stale_clock"))
        session.clock.sleep(1.2)
        now, state = session.clock.now(), session.arm.state()
        assert now - state.time == pytest.approx(0.2)
        session.clock.sleep(0.4)
        assert session.arm.state().time == session.clock.now()

    def test_the_reference_is_a_step_of_its_own(self):
        fault = {"kind": "robot_stop", "pose": 0, "step": "reference", "after": "0.3 s"}
        session, place = session_with(fault), places()[0]
        assert session.near(place).motion is Motion.IDLE
        session.clock.sleep(0.4)
        assert session.arm.state().motion is Motion.STOPPED


def test_a_bumped_station_stays_where_it_is():
    offset = ["0.3 mm", "0 mm", "-0.4 mm"]
    session = session_with({"kind": "station_bumped", "pose": 1, "offset": offset})
    quiet = Session.of(example_cell(simulation=QUIET))
    T, moved = quiet.sim.tracker.T_base_station("station_1"), []
    for _ in range(3):
        seen = []
        for one in (session, quiet):
            one.near(places()[0])
            one.devices.metrology.read()
            one.clock.sleep(0.1)
            seen.append(one.devices.metrology.read().position[-1])
        moved.append(T[:3, :3] @ (seen[0] - seen[1]))
    np.testing.assert_allclose(moved[0], 0.0, atol=1e-9)
    for each in moved[1:]:
        np.testing.assert_allclose(each, (-0.3e-3, 0.0, 0.4e-3), atol=1e-9)


def test_a_fault_of_an_unknown_station_is_refused_with_those_there_are():
    cell = example_cell(faults=[{"kind": "beam_break", "pose": 0, "station": "station_3"}])
    with pytest.raises(DeviceError, match=r"'station_3'; did you mean 'station_1'"):
        simulated_devices(cell, 0)
