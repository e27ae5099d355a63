"""Every fault ends in its state with its message; see decision 20."""

import numpy as np
import pytest

from elastocal.cell import LineCounts
from elastocal.errors import FileAccessError
from elastocal.procedure import Event, RunEnd, read_journal
from elastocal.procedure.record import ReadingStatus, read_commits
from elastocal.procedure.run.steps import ArmLocation
from support import fake_faults as fault
from support.fake_devices import FakeCell
from support.fake_faults import when
from support.fake_runs import FakeRun, MemoryRecorder, plan, replace

OVERSHOOT = 1600.0 * 0.04
"""One cycle's ramp, in N."""


@pytest.fixture
def run(tmp_path):
    return FakeRun(tmp_path / "run")


def committed(run):
    return [log.pose for log in read_commits(run.journal)]


def statuses(run):
    """Status of every loaded reading, by pose and load case."""
    return {
        (log.pose, window.load_case): window.status.value
        for log in read_commits(run.journal)
        for window in log.windows
        if window.load_case
    }


def texts(run, event):
    return [entry.text for entry in read_journal(run.journal) if entry.event is event]


ENDING = [
    ("sensor silent", fault.pressing(), fault.silence_sensor, ArmLocation.APPROACH_POSE,
     "pose 0, attempt 1, settle normal: force sensor silent: sensor: newest data are"),
    ("sensor frozen", fault.pressing(), fault.freeze_sensor, ArmLocation.APPROACH_POSE,
     "force sensor frozen: sensor repeats itself for 0.3"),
    ("sensor fault", fault.pressing(2), fault.break_sensor, ArmLocation.APPROACH_POSE,
     "north: force sensor fault: sensor says: fault"),
    ("tracker silent", fault.pressing(), fault.silence_tracker, ArmLocation.APPROACH_POSE,
     "tracker silent: tracker: newest data are 0.3"),
    ("arm silent", fault.pressing(), fault.silence_arm, ArmLocation.APPROACH_POSE,
     "arm silent: arm: newest data are 0.3"),
    ("runaway", fault.ramping, fault.run_away, ArmLocation.APPROACH_POSE,
     "force limit exceeded: "),
    ("robot stop in contact", fault.pressing(), fault.stop_arm, ArmLocation.AT_SURFACE,
     "arm stopped: arm says: safety gate opened"),
    ("robot stop on the way", fault.moving, fault.stop_arm, ArmLocation.BETWEEN_POSES,
     "pose 0, attempt 1, move: arm stopped: arm says: safety gate opened"),
    ("soft collision", fault.moving, fault.hit_something, ArmLocation.NOT_KNOWN,
     "pose 0, attempt 1, move: hit something on the way: the force changed by"),
    ("line dead", fault.engaging, fault.deafen_arm, ArmLocation.AT_SURFACE,
     "device refused: arm: the line is dead"),
    ("clock stands", fault.pressing(), fault.stop_clock, ArmLocation.AT_SURFACE,
     "clock out of order: it stands at"),
    ("sensor silent on the way down", fault.approaching, fault.silence_sensor,
     ArmLocation.APPROACH_POSE, "near: force sensor silent"),
    ("sensor silent while engaging", fault.engaging, fault.silence_sensor,
     ArmLocation.APPROACH_POSE, "force sensor silent"),
    ("saturated in contact", fault.pressing(), fault.saturate_sensor, ArmLocation.APPROACH_POSE,
     "force sensor saturated in contact: sensor says: saturated"),
    ("saturated", fault.near, fault.saturate_sensor, ArmLocation.APPROACH_POSE,
     "force sensor saturated: sensor says"),
    ("contact missed", fault.approaching, fault.lower_floor, ArmLocation.APPROACH_POSE,
     "engage: contact missed: none within 14 mm beyond the expected one"),
    ("contact early", fault.approaching, fault.raise_floor, ArmLocation.APPROACH_POSE,
     "near: touched the surface before near contact: 19.8 mm before"),
    ("sensor silent on the way", fault.moving, fault.silence_sensor, ArmLocation.NOT_KNOWN,
     "move: force sensor silent"),
    ("sensor silent in retract", fault.retracting, fault.silence_sensor, ArmLocation.APPROACH_POSE,
     "retract: force sensor silent"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("moment", "change", "stand", "message"),
    [row[1:] for row in ENDING],
    ids=[row[0] for row in ENDING],
)
def test_a_fault_that_ends_the_run_leaves_the_cell_safe(run, moment, change, stand, message):
    run.changes = {"approach_speed": 0.02 if change is fault.raise_floor else 0.05}
    result = run.start(when(moment, change))
    assert (result.end, result.location) == (RunEnd.STOPPED, stand)
    assert message in result.message
    assert committed(run) == []
    world = run.cell.world
    if stand is ArmLocation.APPROACH_POSE:
        assert world.commands[-3:] == ["retract", "stop", "disable"]
        assert not world.in_contact
        assert not world.force.any()
    if not run.cell.arm.deaf:
        assert world.commands[-2:] == ["stop", "disable"]
    assert world.largest_force <= run.settings.force_limit + OVERSHOOT
    assert texts(run, Event.FINISH)[-1].startswith(f"stopped, {stand.value}")
    assert texts(run, Event.FAULT) == [result.message]
    assert result.message.startswith(run.faults[0])


RETRIED = [
    ("beam lost for a while", fault.near, fault.break_beam(2.3), "unloaded: beam lost: station_1"),
    ("beam lost in contact", fault.pressing(), fault.break_beam(2.3), "settle normal: beam lost"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("moment", "change", "message"), [row[1:] for row in RETRIED], ids=[row[0] for row in RETRIED]
)
def test_a_fault_of_one_attempt_is_tried_again(run, moment, change, message):
    run.changes = {"approach_speed": 0.02}
    result = run.start(when(moment, change))
    assert (result.end, result.location, result.failed_attempts) == (
        RunEnd.DONE,
        ArmLocation.HOME,
        1,
    )
    assert message in texts(run, Event.FAULT)[0]
    assert [(log.pose, log.attempt) for log in read_commits(run.journal)] == [(0, 2), (1, 1)]
    assert set(statuses(run).values()) == {"ok"}


def lost_beam(visits):
    """Break the beam in the first visits, each time for longer than it may be broken."""
    return when(fault.near, fault.break_beam(2.3), times=visits)


def test_a_pose_that_fails_every_time_is_given_up_and_the_next_one_is_visited(run):
    result = run.start(lost_beam(2))
    assert (result.end, result.given_up, result.failed_attempts) == (RunEnd.DONE, (0,), 2)
    assert result.message == ("given up: pose 0; `--resume` tries again once the cause is mended")
    assert committed(run) == [1]
    assert "beam lost" in texts(run, Event.GIVEN_UP)[0]


def test_a_pose_that_was_given_up_is_tried_again_on_resume(run):
    run.start(lost_beam(2))
    assert run.resume().end is RunEnd.DONE
    assert committed(run) == [1, 0]
    assert read_commits(run.journal)[1].attempt == 3


def test_two_poses_in_a_row_that_cannot_be_had_end_the_run(run):
    result = run.start(lost_beam(9))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "pose 1, attempt 2, unloaded: beam lost" in result.message
    assert result.given_up == (0, 1)


def test_a_beam_that_never_comes_back_ends_the_run(run):
    result = run.start(when(fault.pressing(), fault.break_beam()))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "beam lost: station_1 sees no marker for 2.0" in result.message
    assert committed(run) == []


@pytest.mark.parametrize("moment", [fault.near, fault.pressing(), fault.engaging, fault.ramping])
def test_a_beam_that_breaks_for_a_moment_costs_only_time(run, tmp_path, moment):
    whole = FakeRun(tmp_path / "whole")
    whole.start()
    result = run.start(when(moment, fault.break_beam(0.5)))
    assert (result.end, result.failed_attempts) == (RunEnd.DONE, 0)
    assert set(statuses(run).values()) == {"ok"}
    assert run.cell.world.clock.now() >= whole.cell.world.clock.now()
    for key, values in whole.readings().items():
        np.testing.assert_allclose(run.readings()[key], values, atol=1.0)


def test_a_beam_that_breaks_in_every_window_aborts_the_load_case_only(run):
    result = run.start(when(fault.pressing(), lambda cell: _flicker(cell)))
    assert result.end is RunEnd.DONE
    assert statuses(run)[0, "normal"] == "aborted"
    assert statuses(run)[0, "north"] == "ok"
    notes = [window.note for window in read_commits(run.journal)[0].windows]
    assert notes[1] == "station_1 lost the marker in 3 windows"


def _flicker(cell):
    """Break the beam for a moment, a little after every time that it is found, in this load."""
    world, holds, found = cell.world, cell.world.holds, [0.0]

    def flicker(world):
        here = world.holds == holds and world.visits == 1
        seen = cell.tracker.finds and world.beam is fault.BeamState.LOCKED
        found[0] = found[0] + 0.01 if here and seen else 0.0
        if found[0] > 0.1:
            fault.break_beam(0.05)(cell)
            found[0] = 0.0

    world.faults.append(flicker)


def test_a_force_that_never_settles_is_recorded_and_the_pose_goes_on(run):
    result = run.start(when(fault.pressing(), fault.wobble))
    assert (result.end, result.failed_attempts) == (RunEnd.DONE, 0)
    assert statuses(run) == {
        (0, "normal"): "unstable",
        (0, "north"): "ok",
        (1, "normal"): "ok",
        (1, "north"): "ok",
    }
    window = read_commits(run.journal)[0].windows[1]
    assert window.note.startswith("not stable within 4 s: force ")
    assert window.start == window.end


@pytest.mark.parametrize("moment", [fault.pressing(), fault.ramping])
def test_a_slip_is_recorded_and_the_pose_goes_on(run, moment):
    result = run.start(when(moment, fault.slip))
    assert (result.end, result.failed_attempts) == (RunEnd.DONE, 0)
    assert statuses(run)[0, "normal"] == "slipped"
    assert [s for key, s in statuses(run).items() if key != (0, "normal")] == ["ok"] * 3
    assert "limit" in read_commits(run.journal)[0].windows[1].note


def test_a_marker_that_shakes_gives_no_reference(run):
    result = run.start(when(fault.approaching, fault.shake))
    assert result.end is RunEnd.STOPPED
    assert "unloaded: unloaded reference too noisy: marker has a sigma of" in result.message


def test_a_way_that_is_never_done_ends_the_run(run):
    def jam(cell):
        cell.world.faults.append(lambda world: setattr(world, "speed", 0.0))

    result = run.start(when(fault.moving, jam))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.BETWEEN_POSES)
    assert "time limit exceeded: a move is not done after" in result.message


def test_a_surface_that_gives_way_ends_the_run(run):
    def sink(cell):
        world = cell.world
        world.floor -= 0.02

    result = run.start(when(fault.pressing(), sink))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "travel limit exceeded: 20." in result.message
    assert "mm beyond the expected contact, limit 15 mm" in result.message


def test_an_arm_that_lets_go_by_itself_is_noticed(run):
    def let_go(cell):
        cell.world.motion = fault.Motion.IDLE

    result = run.start(when(fault.pressing(), let_go))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "contact lost: arm is idle and holds no force" in result.message


def test_an_interruption_retracts_and_can_be_resumed(run):
    pressed = []
    run.interrupted = lambda: bool(pressed)
    result = run.start(when(fault.pressing(2), pressed.append))
    assert (result.end, result.location) == (RunEnd.INTERRUPTED, ArmLocation.APPROACH_POSE)
    assert result.message == "pose 0, attempt 1, load north: interrupted"
    assert run.cell.world.commands[-4:] == ["release", "retract", "stop", "disable"]
    assert texts(run, Event.FINISH)[-1].startswith("interrupted, retracted")
    run.interrupted = lambda: False
    assert run.resume().end is RunEnd.DONE
    assert sorted(committed(run)) == [0, 1]


@pytest.mark.parametrize(
    ("at", "change", "end", "message"),
    [
        (fault.pressing(2), fault.break_sensor, RunEnd.STOPPED, "north: force sensor fault: "),
        (fault.moving, fault.stop_arm, RunEnd.STOPPED, "arm stopped: arm says: safety gate"),
        (
            fault.near,
            fault.saturate_sensor,
            RunEnd.STOPPED,
            "force sensor saturated: ",
        ),
    ],
)
def test_a_fault_in_the_cycle_of_an_interruption_is_not_hidden(run, at, change, end, message):
    pressed = []

    def both(cell):
        change(cell)
        pressed.append(cell)

    run.interrupted = lambda: bool(pressed)
    result = run.start(when(at, both))
    assert result.end is end
    assert message in result.message


class FullDisk(MemoryRecorder):
    def save(self, path):
        raise FileAccessError(f"cannot write {path.name}: No space left on device")


def test_streams_that_cannot_be_written_end_the_run_off_the_surface(run):
    run.recorder = lambda: FullDisk({})
    result = run.start()
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert result.message == (
        "pose 0, attempt 1, commit: record lost: cannot write pose_0000_1.mcap:"
        " No space left on device"
    )
    assert committed(run) == []
    run.recorder = None
    assert run.resume().end is RunEnd.DONE


@pytest.mark.parametrize("full_at", range(1, 21))
def test_a_journal_that_cannot_be_written_ends_the_run_safely(run, full_at):
    count = 0

    def sync(file):
        nonlocal count
        count += 1
        if count > full_at:
            raise OSError(28, "No space left on device")

    result = run.start(sync=sync)
    assert result.end is RunEnd.STOPPED
    assert result.message.endswith("journal.jsonl: No space left on device")
    world = run.cell.world
    assert not world.force.any()
    assert not world.in_contact
    assert world.commands[-2:] == ["stop", "disable"]
    assert read_journal(run.journal)[-1].n == full_at - 1
    assert run.resume().end is RunEnd.DONE
    assert sorted(committed(run)) == [0, 1]


def test_an_arm_with_other_joints_is_refused_before_anything_moves(run):
    def rename(cell):
        cell.arm.joint_names = ("a", "b", "c")

    with pytest.raises(Exception, match="the arm has the joints a, b, c; the plan needs x, y, z"):
        run.start(rename)
    assert run.cell.world.commands == []


def test_a_mistake_in_the_program_leaves_the_surface_before_it_shows(run):
    def tell(progress):
        if progress.force > 200.0:
            raise ZeroDivisionError

    run.tell = tell
    with pytest.raises(ZeroDivisionError):
        run.start()
    assert "retract" in run.cell.world.commands
    assert run.cell.world.commands[-2:] == ["stop", "disable"]
    assert texts(run, Event.FINISH) == [
        "stopped, retracted to the approach pose: mistake in the program: ZeroDivisionError"
    ]
    assert not run.cell.world.force.any()


def test_every_status_but_missing_can_come_from_a_run():
    assert {status.value for status in ReadingStatus} == {
        "ok", "slipped", "unstable", "aborted", "missing"
    }  # fmt: skip


@pytest.fixture
def conditioned(tmp_path):
    """A run that presses before its reference, and reads it in light contact."""
    presses = {
        "conditioning": (0.0, 0.0, -300.0),
        "light_contact": (0.0, 0.0, -20.0),
        "normal": (0.0, 0.0, -300.0),
    }
    made = plan()
    return FakeRun(
        tmp_path / "run", replace(made, contact=replace(made.contact, load_cases=presses))
    )


@pytest.mark.parametrize("number", [1, 2])
def test_a_press_that_the_reference_needs_and_that_never_settles_makes_the_pose_be_tried_again(
    conditioned, number
):
    result = conditioned.start(when(fault.pressing(number), fault.wobble))
    assert (result.end, result.failed_attempts) == (RunEnd.DONE, 1)
    assert set(statuses(conditioned).values()) == {"ok"}
    lost = ["conditioning", "light_contact"][number - 1]
    assert f"reference not had: {lost}: not stable within 4 s" in texts(conditioned, Event.FAULT)[0]


def test_a_conditioning_press_that_slips_has_pressed_all_the_same(conditioned):
    result = conditioned.start(when(fault.pressing(1), fault.slip))
    assert (result.end, result.failed_attempts) == (RunEnd.DONE, 0)
    assert statuses(conditioned)[0, "conditioning"] == "slipped"
    assert statuses(conditioned)[0, "normal"] == "ok"


def test_the_presses_of_a_pose_that_is_tried_again_are_in_order_in_time(conditioned):
    conditioned.start(when(fault.pressing(3), fault.saturate_sensor))
    for log in read_commits(conditioned.journal):
        names = [window.load_case for window in log.windows]
        assert names == [None, "conditioning", "light_contact", "normal", None]
        assert sorted(window.start for window in log.windows) == [w.start for w in log.windows]


def test_the_end_of_a_session_holds_what_was_counted_on_the_lines(run, monkeypatch):
    counts = (LineCounts(device="box", received=3, late=1),)
    made = FakeCell.devices.fget
    with_lines = property(lambda cell: replace(made(cell), lines=lambda: counts))
    monkeypatch.setattr(FakeCell, "devices", with_lines)
    run.start()
    assert read_journal(run.journal)[-1].lines == counts
