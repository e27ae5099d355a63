"""Devices that raise or say nonsense end a run with a message, off the surface, told truly."""

import numpy as np
import pytest

from elastocal.errors import DeviceError
from elastocal.procedure import Event, Journal, PoseRecorder, RunEnd, read_journal
from elastocal.procedure.record import read_commits
from elastocal.procedure.run.steps import ArmLocation
from support import fake_faults as fault, fake_lies as lie
from support.fake_devices import R_BASE_TRACKER, Motion, fake_cell
from support.fake_faults import when
from support.fake_runs import HOME, RECORD, FakeRun, MemoryRecorder, plan, replace

LINE = ConnectionResetError(104, "Connection reset by peer")
LATE = TimeoutError("timed out")
NO_ANSWER = DeviceError("no answer")


@pytest.fixture
def run(tmp_path):
    run = FakeRun(tmp_path / "run")
    (run.path / "streams").mkdir(parents=True)
    run.recorder = lambda: PoseRecorder(("x", "y", "z"))
    return run


def presses(run):
    return bool(run.cell.world.force.any())


@pytest.mark.parametrize("error", [LINE, LATE, NO_ANSWER], ids=["reset", "late", "refused"])
@pytest.mark.parametrize("device", ["sensor", "tracker"])
@pytest.mark.parametrize("moment", [fault.pressing(), fault.ramping, fault.engaging])
def test_a_sensor_or_tracker_that_raises_does_not_keep_the_arm_at_the_surface(
    run, device, error, moment
):
    result = run.start(when(moment, lie.raising(device, "read", error)))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert f"device refused: {error}" in result.message
    assert not presses(run)
    assert run.cell.world.commands[-3:] == ["retract", "stop", "disable"]
    assert texts(run, Event.FAULT) == [result.message]


def texts(run, event):
    return [entry.text for entry in read_journal(run.journal) if entry.event is event]


@pytest.mark.parametrize("error", [LINE, NO_ANSWER], ids=["reset", "refused"])
def test_an_arm_that_answers_no_more_is_told_all_the_same(run, error):
    result = run.start(when(fault.pressing(), lie.raising("arm", "state", error)))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert result.message.endswith("; no retract: arm silent: it does not answer")
    assert run.cell.world.commands[-4:] == ["release", "retract", "stop", "disable"]
    assert not presses(run)


def test_an_arm_whose_line_is_wholly_dead_is_said_to_press(run):
    names = ("state", "stop", "release", "retract", "disable")
    dead = lie.both(*(lie.raising("arm", name, LINE) for name in names))
    result = run.start(when(fault.pressing(), dead))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert "device refused: [Errno 104]" in result.message
    assert texts(run, Event.FINISH)[-1].startswith("stopped, AT THE SURFACE")


class FullDisk(MemoryRecorder):
    def save(self, path):
        raise OSError(28, f"{path.name}: No space left on device")


def test_streams_that_cannot_be_written_do_not_hide_where_the_arm_stands(run):
    run.recorder = lambda: FullDisk({})
    result = run.start(when(fault.pressing(), fault.stop_arm))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert "arm stopped: arm says: safety gate opened" in result.message
    assert presses(run)


def test_a_second_fault_on_the_way_off_is_named(run):
    stops = lie.both(
        lambda cell: setattr(cell.sensor, "silent", True),
        lambda cell: fault.once(
            cell,
            lambda world: world.motion is Motion.RETRACTING,
            lambda: fault.stop_arm(cell),
        ),
    )
    result = run.start(when(fault.pressing(), stops))
    assert result.location is ArmLocation.AT_SURFACE
    assert "force sensor silent" in result.message
    assert "no retract: arm stopped: arm says: safety gate opened" in result.message


NONSENSE = [
    ("arm nowhere", "arm", ("q", "T_base_tcp"), fault.pressing(), "arm fault: arm: joint pos"),
    ("arm nowhere on a move", "arm", ("q",), fault.moving, "arm fault: arm: joint positions"),
    ("no force", "sensor", ("force",), fault.ramping, "force sensor fault: it says NaN"),
    ("no moment", "sensor", ("moment",), fault.ramping, "its moment is not finite"),
    ("no time", "sensor", ("time",), fault.pressing(), "force sensor fault: sensor: its times"),
    ("marker nowhere", "tracker", ("position",), fault.pressing(), "tracker fault: tracker is"),
    ("marker never", "tracker", ("time",), fault.near, "tracker fault: tracker: its times"),
]


@pytest.mark.parametrize(
    ("device", "names", "moment", "message"),
    [row[1:] for row in NONSENSE],
    ids=[row[0] for row in NONSENSE],
)
def test_what_is_no_number_is_a_fault_with_a_message(run, device, names, moment, message):
    result = run.start(when(moment, lie.scaled(device, np.nan, *names)))
    assert result.end is RunEnd.STOPPED
    assert message in result.message
    assert not presses(run)
    assert texts(run, Event.FAULT) == [result.message]


@pytest.mark.parametrize(
    ("device", "change", "message"),
    [
        ("sensor", lambda b: replace(b, force=b.force[:, :2]), "sensor: forces of shape (4, 2)"),
        ("sensor", lambda b: replace(b, moment=b.moment[:1]), "sensor: moments of shape (1, 3)"),
        ("tracker", lambda b: replace(b, position=b.position[0]), "positions of shape (3,)"),
        ("tracker", lambda b: replace(b, station="other"), "other measures, not station_1"),
    ],
)
def test_what_has_another_form_is_a_fault_with_a_message(run, device, change, message):
    result = run.start(when(fault.pressing(), lie.saying(device, "read", change)))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert message in result.message


def test_an_arm_of_another_form_is_a_fault_with_a_message(run):
    short = lie.saying("arm", "state", lambda state: replace(state, q=state.q[:2]))
    result = run.start(when(fault.moving, short))
    assert "arm fault: arm: joint positions of shape (2,), not (3,)" in result.message


def test_a_contact_that_the_sensor_does_not_feel_ends_the_run(run):
    result = run.start(when(fault.approaching, lie.numb_sensor))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "engage: arm and force sensor disagree: arm feels 20 N of contact" in result.message
    assert "hold" not in run.cell.world.commands


def test_a_load_that_the_sensor_does_not_feel_ends_the_run(run):
    result = run.start(when(fault.pressing(), lie.numb_sensor))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "300 N are asked for, the sensor feels 0 N in that direction" in result.message


def test_a_pose_where_no_load_settles_is_given_up(run):
    def restless(cell):
        cell.world.wobble = 40.0

    def calm(cell):
        cell.world.wobble = 0.0

    run.changes = {"retries": 0}

    def prepare(cell):
        when(fault.pressing(), restless)(cell)
        when(lambda world: world.visits == 2, calm)(cell)

    result = run.start(prepare)
    assert (result.end, result.given_up, result.failed_attempts) == (RunEnd.DONE, (0,), 1)
    assert "no load case settles: not stable within 4 s" in texts(run, Event.GIVEN_UP)[0]


def test_an_arm_that_feels_nothing_is_stopped_soon_after_contact(run):
    run.changes = {"contact_speed": 0.005}
    result = run.start(when(fault.near, lie.numb_arm))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "engage: force limit exceeded: " in result.message
    assert "limit 236 N" in result.message
    assert run.cell.world.largest_force < 236.0 + 200.0


def test_an_arm_that_feels_nothing_is_stopped_before_near_contact(run):
    run.plan = plan(1)
    run.changes = {"approach_speed": 0.005, "retries": 0, "timeout": 20.0}

    def prepare(cell):
        lie.numb_arm(cell)
        when(fault.approaching, fault.raise_floor)(cell)

    result = run.start(prepare)
    assert "near: touched the surface before near contact" in texts(run, Event.FAULT)[0]
    assert result.end is RunEnd.STOPPED
    assert run.cell.world.largest_force < 36.0 + 0.005 * 0.04 * 1e6 + 60.0


def test_a_sensor_that_does_not_feel_the_tool_ends_the_run(run):
    light = lie.saying("sensor", "read", lambda b: replace(b, force=b.force * 0.1))
    result = run.start(light)
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.NOT_KNOWN)
    assert "force sensor does not feel the tool: 59 N in free air, it weighs 600 N" in (
        result.message
    )


def test_a_force_that_grows_from_leg_to_leg_is_not_tared_away(run):
    def drag(cell):
        world = cell.world

        def pull(world):
            if world.visits >= 3 and world.q[2] > 0.06:
                world.force = np.array([-900.0 * (world.visits - 2), 0.0, 0.0])

        world.faults.append(pull)

    result = run.start(drag)
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.NOT_KNOWN)
    assert "force limit exceeded: 1800 N, limit 1650 N" in result.message


def test_no_move_is_begun_in_contact(run):
    stuck = lie.saying("arm", "state", lambda state: replace(state, in_contact=True))
    result = run.start(stuck)
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert result.message.startswith("no move is begun in contact: arm says that it is")
    assert "move" not in run.cell.world.commands


def test_a_miss_does_not_depend_on_noise_of_the_arms_place(run):
    rng = np.random.default_rng(1)

    def shake(state):
        T = state.T_base_tcp.copy()
        T[:3, 3] += 2e-5 * rng.standard_normal(3)
        return replace(state, T_base_tcp=T)

    def prepare(cell):
        lie.saying("arm", "state", shake)(cell)
        when(fault.approaching, fault.lower_floor)(cell)

    result = run.start(prepare)
    assert (result.end, result.failed_attempts) == (RunEnd.STOPPED, 1)
    assert "contact missed: none within 14 mm" in texts(run, Event.FAULT)[0]


def in_the_first_window(run, change):
    """Start a run in which something changes in the middle of the first window."""

    def prepare(cell):
        def later(cell):
            end = cell.world.clock.now() + 0.32
            fault.once(cell, lambda world: world.clock.now() >= end, lambda: change(cell))

        when(fault.pressing(), later)(cell)

    return run.start(prepare)


def windows(run, pose=0):
    return {w.load_case: w for w in read_commits(run.journal)[pose].windows if w.load_case}


def test_a_marker_that_jumps_along_the_normal_has_slipped(run):
    jump = R_BASE_TRACKER.T @ [0.0, 0.0, 5e-3]
    off = lie.saying("tracker", "read", lambda b: replace(b, position=b.position + jump))
    assert in_the_first_window(run, off).end is RunEnd.DONE
    found = windows(run)["normal"]
    assert found.status.value == "slipped"
    assert "marker jumped 5.0" in found.note


def test_a_marker_that_shakes_under_load_gives_no_reading(run):
    def shake(cell):
        cell.tracker.sigma = 1e-3
        calm = lambda: setattr(cell.tracker, "sigma", 20e-6)  # noqa: E731
        fault.once(cell, lambda world: world.holds == 2, calm)

    run.start(when(fault.pressing(), shake))
    found = windows(run)
    assert found["normal"].status.value in ("unstable", "slipped")
    assert found["north"].status.value == "ok"


def test_every_pose_ends_with_an_unloaded_window(run):
    assert run.start().end is RunEnd.DONE
    for log in read_commits(run.journal):
        assert [w.load_case for w in log.windows] == [None, "normal", "north", None]
        assert log.windows[-1].end - log.windows[-1].start == pytest.approx(0.2)


def test_a_view_that_is_gone_does_not_end_a_run(run):
    def tell(_):
        raise BrokenPipeError(32, "Broken pipe")

    run.tell = tell
    assert run.start().end is RunEnd.DONE


def test_time_that_passes_between_two_cycles_is_seen(run):
    def tell(progress):
        if progress.force > 200.0:
            run.cell.world.clock.ticks += 500_000

    run.tell = tell
    result = run.start()
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.APPROACH_POSE)
    assert "clock out of order: 0.50 s passed between two cycles" in result.message


def test_an_interruption_is_no_failed_attempt(run):
    pressed = []
    run.interrupted = lambda: bool(pressed)
    result = run.start(when(fault.pressing(2), pressed.append))
    assert (result.end, result.failed_attempts) == (RunEnd.INTERRUPTED, 0)


def test_an_arm_that_was_left_in_contact_away_from_every_pose_is_not_moved(run):
    run.start(when(fault.moving, fault.stop_arm))
    cell = fake_cell(HOME, 100.0)
    cell.world.q, cell.world.in_contact = np.array([0.05, 0.0, 0.275]), True
    result = run.resume(cell=cell)
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert "before no pose: `elastocal release CELL --arm` frees it" in result.message
    assert cell.world.contacts_kept == 0
    assert not {"move", "retract"} & set(cell.world.commands)


def pressing_cell(force):
    """Return a cell whose tool stands 1 mm in the surface of pose 0, with what presses on it."""
    cell = fake_cell(HOME, 100.0)
    world = cell.world
    world.q = np.array([0.1, 0.0, -0.001])

    def press(world):
        world.hit = force(world.q[2])
        if not world.hit.any():
            world.faults.remove(press)

    world.faults.append(press)
    return cell


def spring(height):
    """A surface that lets go."""
    return np.array([0.0, 0.0, min(height, 0.0) * 1.1e6])


def test_a_run_begins_nothing_while_something_presses_and_names_the_way_out(run):
    with Journal(run.journal) as log:
        log.write(0.0, Event.START, run=RECORD)
        result = run._go(log, 0.0, lambda _: None, pressing_cell(spring))
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert "1112 N press on the tool beyond its weight, at most 255 N" in result.message
    assert "`elastocal release CELL --arm` frees it" in result.message
    assert set(run.cell.world.commands) <= {"stop", "disable"}


def test_a_run_that_goes_on_frees_its_tool_first_by_a_force_that_falls(run):
    run.start(when(fault.pressing(), fault.stop_arm))
    result = run.resume(cell=pressing_cell(spring))
    assert result.end is RunEnd.DONE
    commands = run.cell.world.commands
    assert commands[:4] == ["enable", "retract", "adopt_position", "move"]


def test_a_force_that_grows_while_the_tool_is_freed_stops_it(run):
    run.start(when(fault.pressing(), fault.stop_arm))
    stuck = pressing_cell(lambda height: np.array([0.0, 0.0, -1100.0 - 2e5 * (height + 0.001)]))
    result = run.resume(cell=stuck)
    assert (result.end, result.location) == (RunEnd.STOPPED, ArmLocation.AT_SURFACE)
    assert "the force while the tool leaves the surface: it grew from" in result.message
    assert "move" not in run.cell.world.commands
    assert run.cell.world.hit[2] > -1100.0 - 170.0 - 3 * 0.04 * 0.25 * 2e5
