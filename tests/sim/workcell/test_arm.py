"""What the simulated arm really does under the commands of a procedure."""

import numpy as np
import pytest

from elastocal.cell.devices import Motion
from elastocal.errors import DeviceError
from support.simulated import (
    CYCLE,
    QUIET,
    Session,
    example_cell,
    marker_by_controller,
    places,
)

LIKES = ("afp", "machining")
PRESS = (0.0, 0.0, -800.0)


def true_force_tcp(session):
    state = session.sim.plant.robot_state()
    return session.sim.plant.statics.robot.forward(state.q)[:3, :3].T @ state.force


def at_surface(simulation=QUIET, like="afp", seed=0, **sections):
    session = Session.of(example_cell(like, simulation=simulation, **sections), seed)
    place = places(like)[0]
    session.near(place)
    assert session.touch(place).in_contact
    return session, place


def off_by(rest, state, cell):
    """Where the marker truly is, seen from where the controller believes it."""
    T = rest.T_base_tcp
    marker = T[:3, :3] @ cell.file.marker.position_tcp + T[:3, 3]
    return marker - marker_by_controller(state, cell)


@pytest.mark.parametrize("like", LIKES)
class TestLoadedReading:
    @pytest.mark.slow
    def test_marker_minus_controller_is_the_deflection_of_the_true_robot(self, like):
        session = Session.of(example_cell(like, simulation=QUIET))
        place, cell = places(like)[1], session.sim.plant.cell
        robot = session.sim.plant.statics.robot
        near = session.near(place)
        _, unloaded = session.average()
        session.touch(place)
        free = robot.rest(near.q, np.zeros(3), robot.springs)
        for wanted in cell.file.load_cases.force_tcp:
            state = session.hold(wanted)
            force, memory = (
                session.sim.plant.robot_state().force,
                session.sim.plant.segment.path.start.springs,
            )
            _, loaded = session.average()
            controller = marker_by_controller(state, cell) - marker_by_controller(near, cell)
            rest = robot.rest(state.q, force, memory)
            true = off_by(rest, state, cell) - off_by(free, near, cell)
            assert np.linalg.norm(true) > 3e-4
            # Between near contact and contact the sag changes; the controller follows that.
            np.testing.assert_allclose(loaded - unloaded - controller, true, atol=8e-6)

    def test_sensor_shows_the_wanted_force_whatever_its_cross_talk(self, like):
        talk = {"sensor": {**QUIET["sensor"], "cross_talk": 0.001}}
        session = Session.of(example_cell(like, simulation=QUIET | talk))
        place, T = places(like)[1], session.sim.plant.cell.T_sensor_tcp
        session.near(place)
        tare, _ = session.average()
        session.touch(place)
        for wanted in session.sim.plant.cell.file.load_cases.force_tcp:
            session.hold(wanted)
            raw, _ = session.average()
            np.testing.assert_allclose(T[:3, :3].T @ (raw - tare)[:3], wanted, atol=0.5)
            off = np.abs(true_force_tcp(session) - wanted).max()
            assert 0.1 < off < 40.0

    def test_disk_tooling_and_robot_carry_the_same_force(self, like):
        session, _ = at_surface(like=like)
        plant, wanted = session.sim.plant, session.sim.plant.cell.file.load_cases.force_tcp[1]
        session.hold(wanted)
        state, contact = plant.robot_state(), plant.contact
        tool = plant.statics.tool_position(state)
        np.testing.assert_allclose(tool, contact.tool_position(state.force), atol=2e-8)
        rest = plant.statics.robot.rest(state.q, state.force, state.springs, state.theta)
        assert rest.imbalance < 1e-5


def test_pressing_is_a_force_on_the_robot_out_of_the_surface():
    session, place = at_surface()
    session.hold(PRESS)
    force = session.sim.plant.robot_state().force
    assert force @ place.normal == pytest.approx(800.0, rel=0.01)


def test_orientation_and_rail_stay_while_a_force_is_held():
    session, _ = at_surface()
    before = session.arm.state()
    after = session.hold((200.0, 0.0, -1000.0))
    np.testing.assert_allclose(after.T_base_tcp[:3, :3], before.T_base_tcp[:3, :3], atol=1e-8)
    assert after.q[0] == before.q[0]
    assert np.linalg.norm(after.T_base_tcp[:3, 3] - before.T_base_tcp[:3, 3]) > 5e-4


def test_the_approach_stops_at_the_contact_force_and_a_little_more():
    session, _ = at_surface()
    felt = -true_force_tcp(session)[2]
    assert 60.0 < felt < 100.0


def test_a_surface_that_stands_elsewhere_is_found_there():
    offset = {"contact": {**QUIET["contact"], "surface_offset": ["0 mm", "0 mm", "-2 mm"]}}
    here, place = at_surface()
    there, _ = at_surface(QUIET | offset)
    moved = there.arm.state().T_base_tcp[:3, 3] - here.arm.state().T_base_tcp[:3, 3]
    assert moved @ place.normal == pytest.approx(-2e-3 * place.normal[2], abs=5e-5)


def test_force_rises_no_faster_than_the_rate_and_settles():
    session, _ = at_surface()
    session.arm.hold(np.array(PRESS), 400.0)
    forces = []
    for _ in range(120):
        session.clock.sleep(CYCLE)
        forces.append(true_force_tcp(session)[2])
    assert np.abs(np.diff(forces)).max() <= 400.0 * CYCLE * 1.001
    assert forces[-1] == pytest.approx(-800.0, abs=3.0)
    assert np.all(np.diff(forces) <= 1e-9)


@pytest.mark.slow
def test_the_free_robot_is_off_by_the_sag_that_its_controller_leaves():
    place = places()[0]
    errors = {}
    for share in (0.0, 1.0):
        session = Session.of(
            example_cell(
                simulation=QUIET
                | {"controller": {**QUIET["controller"], "gravity_compensation": share}}
            )
        )
        state = session.near(place)
        _, marker = session.average()
        errors[share] = np.linalg.norm(marker - marker_by_controller(state, session.sim.plant.cell))
    assert errors[0.0] > 5e-4
    assert errors[1.0] < 1e-6


@pytest.mark.slow
def test_stops_scatter_by_the_repeatability():
    entry = {"controller": {**QUIET["controller"], "repeatability": "20 um"}}
    session = Session.of(example_cell(simulation=QUIET | entry))
    quiet = Session.of(example_cell(simulation=QUIET))
    place, off = places()[0], []
    for one in (session, quiet):
        one.near(place)
        off.append(one.average()[1])
    assert 1e-6 < np.linalg.norm(off[0] - off[1]) < 2e-4


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_stop_on_the_ramp_keeps_the_force_and_release_takes_it_away(share):
    session, place = at_surface()
    session.arm.hold(np.array(PRESS), 400.0)
    session.clock.sleep(2.0 * share)
    session.arm.stop()
    held = true_force_tcp(session)
    assert -790.0 < held[2] < -100.0
    session.clock.sleep(3.0)
    np.testing.assert_array_equal(true_force_tcp(session), held)
    session.arm.enable()
    assert session.leave(place).motion is Motion.IDLE
    assert session.sim.plant.contact is None


def test_a_stop_while_leaving_may_leave_some_force_and_needs_a_retract():
    session, place = at_surface()
    session.hold(PRESS)
    session.arm.retract(place.normal, 0.05, 0.002)
    session.clock.sleep(CYCLE)
    session.arm.stop()
    assert true_force_tcp(session)[2] < -10.0
    session.arm.enable()
    with pytest.raises(DeviceError, match="at the surface"):
        session.arm.move_joints(place.q_approach, 0.5)
    session.arm.retract(place.normal, 0.05, 0.05)
    session.wait(Motion.IDLE)
    session.arm.move_joints(place.q_approach, 0.5)


def test_an_approach_that_is_stopped_in_the_air_can_go_on():
    session, place = Session.of(example_cell(simulation=QUIET)), places()[0]
    session.near(place)
    session.arm.approach(-place.normal, 0.012, 0.005, 60.0)
    session.clock.sleep(0.1)
    session.arm.stop()
    session.arm.enable()
    assert not session.arm.state().in_contact
    assert session.touch(place).in_contact


def test_an_approach_too_short_to_feel_the_force_is_no_contact_but_can_go_on():
    session, place = Session.of(example_cell(simulation=QUIET)), places()[0]
    reach = session.sim.plant.surface
    session.near(place)
    state = session.sim.plant.robot_state()
    gap = reach.hit(session.sim.plant.statics.tool_position(state), -place.normal, 0.1).distance
    session.arm.approach(-place.normal, gap + 2e-5, 0.002, 200.0)
    state = session.wait(Motion.IDLE)
    assert not state.in_contact
    assert -60.0 < true_force_tcp(session)[2] < -1.0
    assert session.touch(place).in_contact


def test_a_straight_move_against_the_surface_gives_up_at_the_collision_force():
    session, place = Session.of(example_cell(simulation=QUIET)), places()[0]
    session.near(place)
    session.arm.approach(-place.normal, 0.1, 0.02, np.inf)
    state = session.wait(Motion.STOPPED)
    assert "collision" in state.fault
    session.arm.enable()
    assert session.arm.state().fault is None


def test_more_lateral_force_than_friction_holds_makes_the_contact_slide():
    friction = {"contact": {**QUIET["contact"], "friction": 0.3}}
    session, _ = at_surface(QUIET | friction)
    start = session.hold((0.0, 0.0, -1000.0)).T_base_tcp[:3, 3]
    session.arm.hold(np.array((400.0, 0.0, -1000.0)), 1000.0)
    session.clock.sleep(3.0)
    assert true_force_tcp(session)[0] == pytest.approx(300.0, abs=3.0)
    moved = session.arm.state().T_base_tcp[:3, 3] - start
    assert np.linalg.norm(moved) > 5e-3
    session.clock.sleep(20.0)
    state = session.arm.state()
    assert state.motion is Motion.STOPPED
    assert "slid" in state.fault


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (lambda arm: arm.move_joints(np.zeros(3), 0.5), "7 finite numbers"),
        (lambda arm: arm.move_joints(np.full(7, 9.0), 0.5), "joint target rail is 9.0: must be"),
        (lambda arm: arm.move_joints(np.zeros(7), 1.5), "joint target joint_a2"),
        (lambda arm: arm.approach(np.array([0, 0, 2.0]), 0.1, 0.1, 5.0), "length of the approach"),
        (lambda arm: arm.approach(np.array([0, 0, 1.0]), -0.1, 0.1, 5.0), "approach distance"),
        (lambda arm: arm.approach(np.array([0, 0, 1.0]), 0.1, 0.1, 0.0), "contact force is 0.0"),
        (lambda arm: arm.hold(np.array([0, 0, 10.0]), 5.0), "can only press"),
        (lambda arm: arm.hold(np.array([0, 0, -9e3]), 5.0), "force is 9000.0: must be at most"),
        (lambda arm: arm.approach(np.array([0, 0, 1.0]), 9.0, 0.1, 5.0), "cannot follow"),
    ],
)
def test_an_impossible_command_is_refused_with_value_and_what_is_allowed(command, message):
    session = Session.of(example_cell())
    with pytest.raises(DeviceError, match=message) as caught:
        command(session.arm)
    assert "\n" not in str(caught.value)
    assert session.arm.state().motion is Motion.IDLE


def test_a_retract_into_the_surface_is_refused():
    session, place = at_surface()
    with pytest.raises(DeviceError, match="leads into the surface"):
        session.arm.retract(-place.normal, 0.05, 0.05)
