"""The arm against a scripted controller: states, refusals, contact, and every fault of the line."""

import re

import numpy as np
import pytest

from elastocal.cell import UNWATCHED, Motion, RigContext, SensorStatus
from elastocal.drivers.kuka_rsi import DRIVER, KukaArm, RsiSettings
from elastocal.drivers.kuka_rsi.driver import connect_arm
from elastocal.drivers.kuka_rsi.messages import read_rob
from elastocal.errors import DeviceError
from support.kuka_bench import SETTINGS, Bench
from support.kuka_peer import PeerClock, PeerFeed
from support.simulated import example_cell

PRESS = np.array([0.0, 0.0, -300.0])


@pytest.fixture
def bench() -> Bench:
    return Bench.of()


def commands(bench):
    arm, place = bench.arm, bench.place
    return {
        "move_joints": lambda: arm.move_joints(place.q_approach, 1.0),
        "approach": lambda: arm.approach(-place.normal, 0.01, 0.01, 50.0),
        "hold": lambda: arm.hold(PRESS, 100.0),
        "release": lambda: arm.release(100.0),
        "retract": lambda: arm.retract(place.normal, 0.01, 0.01),
    }


class TestStates:
    def test_joints_and_tool_frame_are_the_controllers_in_si(self, bench):
        state = bench.arm.state()
        assert bench.arm.joint_names == bench.peer.robot.joint_names
        np.testing.assert_allclose(state.q, bench.peer.q, atol=2e-8)
        np.testing.assert_allclose(state.T_base_tcp, bench.peer.T, atol=2e-8)
        assert state.motion is Motion.DISARMED
        assert abs(state.time - bench.clock.now()) <= 0.012

    def test_nothing_moves_before_it_is_enabled(self, bench):
        for name, command in commands(bench).items():
            with pytest.raises(DeviceError, match=f"refuses {name}: it is disarmed"):
                command()
        bench.clock.sleep(0.5)
        assert all('<Stop>1</Stop><RKorr X="0.000000"' in text for text in bench.peer.answers)
        assert bench.peer.state == 1

    def test_a_joint_move_is_the_controllers_and_no_command_interrupts_it(self, bench):
        arm = bench.arm
        arm.enable()
        assert arm.state().motion is Motion.IDLE
        arm.move_joints(bench.place.q_approach, 0.1)
        assert arm.state().motion is Motion.MOVING
        bench.clock.sleep(0.1)
        for name, command in commands(bench).items():
            with pytest.raises(DeviceError, match=f"refuses {name}: it is moving"):
                command()
        state = bench.wait(Motion.IDLE)
        np.testing.assert_allclose(state.q, bench.place.q_approach, atol=1e-7)
        assert any('Op="2" V="10.000"' in text for text in bench.peer.answers)

    def test_the_cell_says_how_fast_a_ptp_may_be(self, bench):
        bench.arm.enable()
        bench.arm.move_joints(bench.place.q_approach, 1.0)
        bench.clock.sleep(0.1)
        assert 'V="30.000"' in bench.peer.answers[-1]

    def test_stop_brakes_a_move_and_needs_enable_after_it(self, bench):
        arm = bench.arm
        arm.stop()
        assert arm.state().motion is Motion.DISARMED
        arm.enable()
        arm.move_joints(bench.place.q_approach, 0.2)
        bench.clock.sleep(0.3)
        for _ in range(3):
            arm.stop()
            assert arm.state().motion is Motion.STOPPED
        bench.clock.sleep(0.05)
        standing = bench.peer.q.copy()
        bench.clock.sleep(0.5)
        np.testing.assert_array_equal(bench.peer.q, standing)
        assert "<Stop>1</Stop>" in bench.peer.answers[-1]
        with pytest.raises(DeviceError, match="refuses move_joints: it is stopped"):
            arm.move_joints(bench.place.q_approach, 0.2)
        arm.enable()
        arm.move_joints(bench.place.q_approach, 1.0)
        np.testing.assert_allclose(bench.wait(Motion.IDLE).q, bench.place.q_approach, atol=1e-7)

    def test_stop_in_force_control_sends_no_correction_any_more(self, bench):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(0.2)
        bench.arm.stop()
        sent = len(bench.peer.answers)
        bench.clock.sleep(0.3)
        after = bench.peer.answers[sent:]
        assert all(
            '<Stop>1</Stop><RKorr X="0.000000" Y="0.000000" Z="0.0' in text for text in after
        )

    def test_disable_takes_the_release_back(self, bench):
        bench.arm.enable()
        bench.arm.disable()
        assert bench.arm.state().motion is Motion.DISARMED


class TestContact:
    def test_from_the_surface_and_back_with_the_forces_that_were_asked_for(self, bench):
        arm, R = bench.arm, bench.place
        state = bench.touch(50.0)
        assert state.in_contact
        assert 50.0 <= -bench.force_tcp[2] < 50.0 + 1e6 * 0.005 * 0.06
        turn = bench.peer.T[:3, :3].copy()
        for wanted in (PRESS, np.array([60.0, -40.0, -300.0])):
            arm.hold(wanted, 2000.0)
            bench.clock.sleep(3.0)
            assert arm.state().motion is Motion.HOLDING
            np.testing.assert_allclose(bench.force_tcp, wanted, atol=1.0)
        np.testing.assert_allclose(bench.peer.T[:3, :3], turn, atol=1e-6)
        arm.release(2000.0)
        assert arm.state().motion is Motion.RELEASING
        assert bench.wait(Motion.IDLE).in_contact
        assert np.linalg.norm(bench.force_tcp) < 10.0
        before = bench.peer.T[:3, 3].copy()
        arm.retract(R.normal, 0.03, 0.05)
        state = bench.wait(Motion.IDLE)
        assert not state.in_contact
        assert state.fault is None
        np.testing.assert_allclose(bench.peer.T[:3, 3] - before, 0.03 * R.normal, atol=3e-5)
        with pytest.raises(DeviceError, match=r"move_joints: correction.*adopt_position"):
            arm.move_joints(bench.place.q_approach, 1.0)
        arm.adopt_position()
        arm.move_joints(bench.place.q_approach, 1.0)
        state = bench.wait(Motion.IDLE)
        np.testing.assert_allclose(state.q, bench.place.q_approach, atol=1e-6)
        np.testing.assert_allclose(bench.peer.offset, 0.0, atol=3e-5)

    def test_in_contact_it_neither_approaches_again_nor_moves_joints(self, bench):
        bench.touch()
        for name in ("approach", "move_joints"):
            with pytest.raises(DeviceError, match=f"{name}.*retract"):
                commands(bench)[name]()
        with pytest.raises(DeviceError, match="leads into the surface"):
            bench.arm.retract(-bench.place.normal, 0.01, 0.01)

    def test_out_of_contact_there_is_nothing_to_hold_or_release(self, bench):
        bench.arm.enable()
        for name in ("hold", "release"):
            with pytest.raises(DeviceError, match=f"{name}.*only in contact"):
                commands(bench)[name]()

    def test_without_contact_it_goes_its_way_straight_though_answers_are_lost(self, bench):
        start = bench.ready().T_base_tcp
        bench.arm.approach(-bench.place.normal, 0.02, 0.02, 50.0)
        bench.clock.sleep(0.5)
        bench.clock.lose = 5
        state = bench.wait(Motion.IDLE)
        assert not state.in_contact
        assert bench.peer.dropped == 5
        moved = state.T_base_tcp[:3, 3] - start[:3, 3]
        np.testing.assert_allclose(moved, -0.02 * bench.place.normal, atol=3e-5)

    def test_a_lateral_force_that_slides_is_given_up_at_the_travel_limit(self):
        bench = Bench.of(cell=example_cell("afp", procedure={"travel_limit": "2 mm"}))
        bench.touch()
        bench.arm.hold(np.array([290.0, 0.0, -300.0]), 5000.0)
        state = bench.wait(Motion.IDLE)
        assert "force control gave up: the tool went 2.0 mm" in state.fault

    def test_beyond_the_force_limit_it_stands_and_can_be_taken_off(self, bench):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.peer.knock = np.array([0.0, 0.0, 5000.0])
        assert "force limit exceeded" in bench.wait(Motion.IDLE).fault
        for name in ("move_joints", "hold"):
            with pytest.raises(DeviceError, match=f"refuses {name}: (allowed|force limit)"):
                commands(bench)[name]()
        bench.arm.retract(bench.place.normal, 0.03, 0.05)
        bench.wait(Motion.IDLE)
        np.testing.assert_allclose(bench.force_tcp, bench.peer.T[:3, :3].T @ bench.peer.knock)

    @pytest.mark.parametrize("kind", ["silent", "saturated"])
    def test_without_a_force_to_trust_it_stands_and_can_be_taken_off(self, bench, kind):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(0.2)
        bench.feed.silent, bench.feed.status = kind == "silent", SensorStatus.SATURATED
        bench.clock.sleep(0.1)
        standing = bench.peer.q.copy()
        bench.clock.sleep(0.3)
        assert bench.arm.state().motion is Motion.HOLDING
        np.testing.assert_array_equal(bench.peer.q, standing)
        bench.arm.release(500.0)
        bench.wait(Motion.IDLE)
        bench.arm.retract(bench.place.normal, 0.02, 0.02)
        assert bench.wait(Motion.IDLE).fault is None
        assert np.linalg.norm(bench.force_tcp) == 0.0

    def test_force_control_that_stays_blind_is_left_for_position_control(self, bench):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(0.1)
        bench.feed.silent = True
        assert "force sensor silent for 1.0" in bench.wait(Motion.IDLE).fault

    @pytest.mark.parametrize("scale", [1.0 / 4.448, 0.6])
    def test_a_sensor_that_changes_its_unit_in_a_press_is_not_pressed_by(self, bench, scale):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(1.5)
        pressing = np.linalg.norm(bench.force_tcp)
        bench.feed.scale = scale
        bench.clock.sleep(0.5)
        state = bench.arm.state()
        assert state.motion is Motion.IDLE
        assert "at once: contact is lost, or the sensor's scale or zero" in state.fault
        assert np.linalg.norm(bench.force_tcp) <= pressing + 5.0

    def test_a_contact_that_is_lost_at_once_ends_a_release_and_is_no_fault(self, bench):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(1.5)
        bench.arm.release(500.0)
        bench.clock.sleep(0.1)
        assert np.linalg.norm(bench.force_tcp) > 150.0
        bench.peer.surface = None
        state = bench.wait(Motion.IDLE)
        assert state.fault is None

    def test_a_feed_that_fails_ends_no_thread_and_the_tool_comes_off(self, bench):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(0.2)
        bench.feed.fails = DeviceError("box: status fault")
        bench.clock.sleep(0.1)
        state = bench.arm.state()
        assert (state.motion, state.fault) == (Motion.IDLE, "box: status fault")
        standing = bench.peer.q.copy()
        bench.clock.sleep(0.3)
        np.testing.assert_array_equal(bench.peer.q, standing)
        bench.arm.release(500.0)
        bench.wait(Motion.IDLE)
        bench.arm.retract(bench.place.normal, 0.02, 0.02)
        assert bench.wait(Motion.IDLE).in_contact is None
        assert np.linalg.norm(bench.force_tcp) == 0.0

    def test_a_press_that_nobody_looks_at_any_more_is_left_for_position_control(self, bench):
        """Whoever supervises it hangs, on a disk that is gone or in a debugger."""
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(UNWATCHED - 0.5)
        assert bench.arm.state().motion is Motion.HOLDING
        bench.clock.sleep(UNWATCHED + 0.1)
        standing = bench.peer.q.copy()
        bench.peer.knock = np.array([0.0, 0.0, 200.0])
        bench.clock.sleep(0.5)
        np.testing.assert_array_equal(bench.peer.q, standing)
        state = bench.arm.state()
        assert (state.motion, state.fault) == (
            Motion.IDLE,
            "nobody has asked how the arm stands for 5 s",
        )
        bench.arm.retract(bench.place.normal, 0.02, 0.02)
        assert bench.wait(Motion.IDLE).motion is Motion.IDLE

    def test_a_retract_that_presses_stops(self, bench):
        """Towards another surface: nothing else of the driver looks at the force then."""
        bench.ready()
        _, normal = bench.peer.surface
        bench.peer.surface = (bench.peer.T[:3, 3] + 0.01 * normal, -normal)
        bench.arm.retract(normal, 0.03, 0.05)
        state = bench.wait(Motion.STOPPED, Motion.IDLE)
        assert "press on the tool while it retracts, limit" in state.fault
        pressing = np.linalg.norm(bench.force_tcp)
        assert pressing < 1.2 * bench.arm.bounds.force + 1e6 * 0.05 * 0.06
        bench.clock.sleep(0.5)
        assert np.linalg.norm(bench.force_tcp) == pytest.approx(pressing)

    def test_a_mistake_of_ours_in_a_press_is_a_fault_and_the_tool_comes_off(
        self, bench, monkeypatch
    ):
        bench.touch()
        bench.arm.hold(PRESS, 500.0)
        bench.clock.sleep(0.2)
        with monkeypatch.context() as broken:
            broken.setattr(type(bench.arm.law), "speed", lambda *_: 1 / 0)
            bench.clock.sleep(0.1)
        state = bench.arm.state()
        assert (state.motion, state.fault) == (
            Motion.IDLE,
            "ZeroDivisionError('division by zero')",
        )
        bench.arm.retract(bench.place.normal, 0.02, 0.02)
        bench.wait(Motion.IDLE)
        assert np.linalg.norm(bench.force_tcp) == 0.0

    def test_a_move_is_not_gone_on_with_where_no_collision_can_be_felt(self, bench):
        bench.arm.enable()
        bench.arm.move_joints(bench.place.q_approach, 0.05)
        bench.clock.sleep(0.3)
        bench.feed.silent = True
        state = bench.wait(Motion.STOPPED)
        assert "force sensor silent for 1.0" in state.fault
        bench.clock.sleep(0.1)
        assert bench.peer.state in (1, 5)

    def test_a_program_that_does_not_brake_is_answered_no_more(self, bench):
        """The controller then stops by its Timeout."""
        bench.arm.enable()
        bench.arm.move_joints(bench.place.q_approach, 0.02)
        bench.clock.sleep(0.3)
        bench.peer.fault = {"rides"}
        bench.arm.stop()
        bench.clock.sleep(0.9)
        assert not bench.peer.dropped
        bench.clock.sleep(0.5)
        assert bench.peer.state == 3
        assert bench.peer.dropped * bench.peer.cycle == pytest.approx(0.4, abs=0.03)
        assert "does not brake its PTP within 1 s" in bench.arm.state().fault
        bench.peer.fault = set()
        bench.peer.state = 1
        bench.clock.sleep(0.1)
        bench.arm.enable()
        assert bench.wait(Motion.IDLE).fault is None

    def test_a_blow_while_it_moves_freely_stops_it(self, bench):
        bench.arm.enable()
        bench.arm.move_joints(bench.place.q_approach, 0.1)
        bench.clock.sleep(0.3)
        bench.peer.knock = np.array([0.0, 150.0, 0.0])
        state = bench.wait(Motion.STOPPED)
        assert "collision: the force changed by 150 N" in state.fault
        bench.clock.sleep(0.1)
        assert bench.peer.state in (1, 5)


def pressing(bench, depth: float = 0.001) -> None:
    """Let the tool stand in the surface, with a program that was started there."""
    point, normal = bench.peer.surface
    bench.peer.q = bench.place.q.copy()
    bench.peer.restart()
    bench.peer.surface = (point + depth * normal, normal)
    bench.peer.stick = bench.peer.T[:3, 3]
    bench.clock.sleep(0.1)


class TestProgrammedPlace:
    def test_a_correction_from_before_the_program_was_started_is_never_taken_back(self, bench):
        pressing(bench)
        arm, most = bench.arm, float(np.linalg.norm(bench.force_tcp))
        assert arm.state().in_contact is None
        arm.enable()
        arm.retract(bench.place.normal, 0.1, 0.05)
        bench.wait(Motion.IDLE)
        off = bench.peer.T
        arm.adopt_position()
        np.testing.assert_allclose(bench.peer.T, off, atol=1e-9)
        np.testing.assert_allclose(bench.peer.offset, 0.0)
        arm.move_joints(bench.place.q_approach, 0.2)
        while arm.state().motion is Motion.MOVING:
            bench.clock.sleep(0.04)
            assert np.linalg.norm(bench.force_tcp) == 0.0
        assert arm.state().in_contact is False
        assert most == pytest.approx(1000.0)

    def test_a_program_that_cannot_adopt_is_left_to_the_pendant(self, bench):
        bench.peer.knows_adopt = False
        pressing(bench)
        bench.arm.enable()
        bench.arm.retract(bench.place.normal, 0.1, 0.05)
        bench.wait(Motion.IDLE)
        off = bench.peer.q.copy()
        with pytest.raises(DeviceError, match=r"100\.0 mm from the programmed .* by the pendant"):
            bench.arm.adopt_position()
        np.testing.assert_array_equal(bench.peer.q, off)

    def test_a_program_restarted_unseen_gives_itself_away_by_its_place(self, bench):
        """No jump of IPOC, no other state: only RSol is another one."""
        arm = bench.arm
        arm.enable()
        arm.move_joints(bench.place.q_approach, 1.0)
        bench.wait(Motion.IDLE)
        pressing(bench)
        arm.retract(bench.place.normal, 0.1, 0.05)
        bench.wait(Motion.IDLE)
        off = bench.peer.T
        arm.adopt_position()
        np.testing.assert_allclose(bench.peer.T, off, atol=1e-9)

    def test_what_is_felt_on_the_way_back_to_zero_stops_it(self, bench):
        arm = bench.arm
        arm.enable()
        arm.move_joints(bench.place.q_approach, 1.0)
        bench.wait(Motion.IDLE)
        arm.retract(bench.place.normal, 0.02, 0.05)
        state = bench.wait(Motion.IDLE)
        bench.peer.surface = (
            state.T_base_tcp[:3, 3] - 0.01 * bench.place.normal,
            bench.place.normal,
        )
        with pytest.raises(DeviceError, match=r"(contact|collision): .* N"):
            arm.adopt_position()
        # 100 N, and what a delay of 60 ms adds at the contact speed against 1 N/um.
        speed = bench.peer.cell.file.procedure.contact_speed
        assert np.linalg.norm(bench.force_tcp) < 100.0 + speed * 0.06 * 1e6

    def test_an_arm_that_moved_while_rsi_was_off_is_a_fault(self, bench):
        pressing(bench)
        bench.arm.enable()
        bench.arm.retract(bench.place.normal, 0.1, 0.05)
        bench.wait(Motion.IDLE)
        bench.peer.slips = 0.002
        with pytest.raises(DeviceError, match=r"the arm moved [0-9.]+ mm"):
            bench.arm.adopt_position()

    def test_a_controller_that_stays_silent_is_a_fault(self, bench):
        pressing(bench)
        bench.arm.enable()
        bench.arm.retract(bench.place.normal, 0.1, 0.05)
        bench.wait(Motion.IDLE)
        bench.peer.off = 60.0
        with pytest.raises(DeviceError, match="nothing from the controller for 5"):
            bench.arm.adopt_position()


class TestRefusals:
    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    def test_what_is_not_finite_is_refused(self, bench, bad):
        arm, place = bench.arm, bench.place
        arm.enable()
        q = place.q_approach.copy()
        q[-1] = bad
        for command in (
            lambda: arm.move_joints(q, 1.0),
            lambda: arm.move_joints(place.q_approach, bad),
            lambda: arm.approach(np.array([0.0, 0.0, bad]), 0.1, 0.1, 50.0),
            lambda: arm.approach(-place.normal, bad, 0.1, 50.0),
            lambda: arm.retract(place.normal, 0.1, bad),
            lambda: arm.hold(np.array([0.0, 0.0, bad]), 100.0),
            lambda: arm.release(bad),
        ):
            with pytest.raises(DeviceError) as caught:
                command()
            assert "\n" not in str(caught.value)
        assert arm.state().motion is Motion.IDLE

    @pytest.mark.parametrize(
        ("command", "reason"),
        [
            (lambda a, n: a.approach(-n, 0.16, 0.02, 50.0), r"160\.0 mm: must be at most 150 mm"),
            (lambda a, n: a.approach(-n, 0.1, 0.06, 50.0), "60 mm/s: must be at most 50 mm/s"),
            (lambda a, n: a.approach(-2 * n, 0.1, 0.02, 50.0), "length of the approach direction"),
            (lambda a, n: a.retract(n, 0.16, 0.02), "must be at most 150 mm"),
            (lambda a, n: a.approach(-n, 0.1, 0.02, -1.0), "contact force is -1"),
        ],
    )
    def test_straight_moves_keep_to_the_bounds(self, bench, command, reason):
        bench.ready()
        with pytest.raises(DeviceError, match=reason):
            command(bench.arm, bench.place.normal)

    def test_a_guarded_move_that_would_press_too_hard_is_refused_with_the_speed(self):
        bench = Bench.of(delay="120 ms", contact_stiffness="4 MN/m")
        bench.ready()
        with pytest.raises(DeviceError, match=r"delay 144 ms, stiffness 4 N/um\).*at most 3 mm/s"):
            bench.arm.approach(-bench.place.normal, 0.1, 0.02, 50.0)

    def test_a_stretched_wrist_is_no_place_for_straight_moves(self, bench):
        bench.ready()
        bench.peer.q[-2] = 0.05
        bench.peer.T_programmed = bench.peer.T
        bench.clock.sleep(0.02)
        with pytest.raises(DeviceError, match=r"A5 is 2\.9 deg from straight"):
            bench.arm.approach(-bench.place.normal, 0.01, 0.02, 50.0)

    def test_force_beyond_the_limit_and_pulling_are_refused(self, bench):
        bench.touch()
        with pytest.raises(DeviceError, match="the force limit"):
            bench.arm.hold(np.array([0.0, 0.0, -3000.0]), 100.0)
        with pytest.raises(DeviceError, match="can only press"):
            bench.arm.hold(np.array([0.0, 0.0, 10.0]), 100.0)


class TestFaultsOfTheLine:
    def test_a_controller_with_another_tool_is_not_enabled(self, bench):
        bench.peer._known = (bench.peer.q.tobytes(), bench.peer.T @ shifted(0.006))
        bench.clock.sleep(0.02)
        with pytest.raises(DeviceError, match=r"RIst is 6\.0 mm .* check \$TOOL, \$BASE, signs"):
            bench.arm.enable()

    def test_axes_of_the_other_sense_are_not_enabled(self):
        bench = Bench.of(signs=[-1, 1, 1, 1, 1, 1])
        bench.peer.q = bench.place.q_approach.copy()
        bench.clock.sleep(0.02)
        with pytest.raises(DeviceError, match="signs of the axes"):
            bench.arm.enable()

    def test_silence_is_a_stop(self, bench):
        bench.arm.enable()
        bench.clock.quiet = True
        bench.clock.sleep(0.5)
        state = bench.arm.state()
        assert state.motion is Motion.STOPPED
        assert "nothing from the controller for" in state.fault
        with pytest.raises(DeviceError, match="cannot be enabled: no message"):
            bench.arm.enable()

    def test_a_jump_of_ipoc_is_a_stop(self, bench):
        bench.arm.enable()
        bench.peer.ipoc += 10_000_000
        bench.clock.sleep(0.05)
        assert "IPOC has jumped" in bench.arm.state().fault

    def test_a_program_that_ends_is_a_stop_and_cannot_be_enabled(self, bench):
        bench.arm.enable()
        bench.peer.state, bench.peer.fault = 9, {"deaf"}
        bench.clock.sleep(0.05)
        assert "not in its loop any more" in bench.arm.state().fault
        with pytest.raises(DeviceError, match="select and start it"):
            bench.arm.enable()

    def test_a_program_that_does_not_obey_is_named(self, bench):
        bench.arm.enable()
        bench.clock.sleep(0.1)
        bench.peer.fault = {"deaf"}
        bench.arm.move_joints(bench.place.q_approach, 0.5)
        assert "does not begin PTP: it is guided for 3 s" in bench.wait(Motion.STOPPED).fault

    def test_a_move_that_the_controller_gave_up_is_a_fault(self, bench):
        bench.arm.enable()
        bench.peer.fault = {"brakes"}
        bench.arm.move_joints(bench.place.q_approach, 0.5)
        assert "gave the PTP up" in bench.wait(Motion.STOPPED).fault

    def test_a_controller_that_clamps_is_found_out(self, bench):
        bench.ready()
        bench.peer.poscorr = 0.005
        bench.arm.approach(-bench.place.normal, 0.05, 0.05, np.inf)
        assert "correction saturated" in bench.wait(Motion.IDLE).fault

    @pytest.mark.parametrize("element", ["RIst", "RSol", "AIPos", "EIPos", "Krl"])
    def test_what_the_controller_does_not_send_is_named(self, bench, element):
        def without():
            return original().replace(f"<{element} ".encode(), b"<Site ")

        original, bench.peer.rob = bench.peer.rob, without
        bench.clock.sleep(0.05)
        with pytest.raises(DeviceError, match=f"does not send {element}"):
            bench.arm.state()

    def test_tenths_of_a_millimetre_are_too_coarse(self, bench):
        def coarse():
            return re.sub(rb'(\.\d)\d+"', rb'\1"', original())

        original, bench.peer.rob = bench.peer.rob, coarse
        bench.clock.sleep(0.05)
        with pytest.raises(DeviceError, match=r"RIst with 1 decimals.*set Precision"):
            bench.arm.state()


def shifted(x: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = x
    return T


class TestModes:
    def test_who_only_measures_needs_no_program_and_moves_nothing(self):
        bench = Bench.of(mode="measure")
        bench.peer.rob = lambda rob=bench.peer.rob: rob().replace(b"<Krl ", b"<Site ")
        bench.clock.sleep(0.05)
        assert bench.arm.state().q.shape == (7,)
        assert bench.peer.answers == []
        with pytest.raises(DeviceError, match=r"mode measure moves nothing: devices\.arm\.mode"):
            bench.arm.enable()

    def test_contact_needs_a_force(self):
        cell = example_cell("afp")
        with pytest.raises(DeviceError, match="mode contact needs a force sensor"):
            KukaArm(cell, RsiSettings.model_validate(SETTINGS), PeerClock(None), None)

    def test_compensation_carries_out_no_procedure(self):
        cell = example_cell("afp")
        settings = RsiSettings(mode="compensation")
        with pytest.raises(DeviceError, match="mode must be measure or contact"):
            connect_arm(cell, settings, RigContext(PeerClock(None), 0, 0.0, None))

    def test_without_a_controller_connecting_says_where_it_listened(self):
        cell = example_cell("afp")
        settings = RsiSettings.model_validate({"port": 0, "wait": "10 ms"})
        with pytest.raises(DeviceError, match=r"nothing from 127\.0\.0\.1 at 127\.0\.0\.1:\d+"):
            connect_arm(cell, settings, RigContext(PeerClock(None), 0, 0.0, None))

    def test_the_driver_makes_arms_that_can_hurt(self):
        assert DRIVER.kinds == {"arm"}
        assert DRIVER.real
        assert DRIVER.settings("arm") is RsiSettings


def test_the_peer_of_these_tests_speaks_as_the_reader_reads():
    bench = Bench.of()
    message = read_rob(bench.peer.rob())
    assert message.state in (1, 2)
    assert PeerFeed(bench.peer).newest() is not None
