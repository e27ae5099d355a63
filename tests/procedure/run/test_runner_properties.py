"""Laws of the runner that hold whatever goes wrong, and for however long it runs."""

import resource
import sys
import tempfile
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from elastocal.cell import Motion
from elastocal.procedure import Event, RunEnd, read_journal
from elastocal.procedure.record import Action, read_commits
from support import fake_faults as fault
from support.fake_faults import when
from support.fake_runs import FakeRun, MemoryRecorder, plan

CYCLE_RAMP = 1600.0 * 0.04
"""What the force may change by in one cycle, in N."""
MOMENTS = {
    "moving": fault.moving,
    "approaching": fault.approaching,
    "near": fault.near,
    "engaging": fault.engaging,
    "ramping": fault.ramping,
    "first load": fault.pressing(1),
    "second load": fault.pressing(2),
    "retracting": fault.retracting,
}
CHANGES = {
    "beam broken for a moment": fault.break_beam(0.4),
    "beam broken for long": fault.break_beam(2.5),
    "beam broken for good": fault.break_beam(),
    "sensor silent": fault.silence_sensor,
    "sensor frozen": fault.freeze_sensor,
    "sensor saturated": fault.saturate_sensor,
    "sensor fault": fault.break_sensor,
    "tracker silent": fault.silence_tracker,
    "tracker noisy": fault.shake,
    "arm silent": fault.silence_arm,
    "arm stopped": fault.stop_arm,
    "arm deaf": fault.deafen_arm,
    "clock stands": fault.stop_clock,
    "slip": fault.slip,
    "unstable": fault.wobble,
    "contact missed": fault.lower_floor,
    "contact early": fault.raise_floor,
    "force grows": fault.run_away,
}
BLIND = {"sensor silent", "sensor frozen", "clock stands", "arm deaf"}
"""With one of these a force that grows by itself is seen later, or cannot be stopped."""

scripts = st.lists(
    st.tuples(
        st.sampled_from(sorted(MOMENTS)), st.sampled_from(sorted(CHANGES)), st.integers(1, 3)
    ),
    min_size=1,
    max_size=4,
).filter(
    lambda script: (
        not (
            {"force grows"} <= {name for _, name, _ in script} and BLIND & {n for _, n, _ in script}
        )
    )
)


def prepared(script):
    prepares = [when(MOMENTS[moment], CHANGES[name], times) for moment, name, times in script]

    def prepare(cell):
        for one in prepares:
            one(cell)

    return prepare


@settings(max_examples=25, deadline=None, derandomize=True)
@given(script=scripts, later=scripts)
def test_whatever_goes_wrong_the_cell_is_safe_and_the_run_can_go_on(script, later):
    with tempfile.TemporaryDirectory() as folder:
        run = FakeRun(Path(folder) / "run", changes={"approach_speed": 0.02, "timeout": 2.0})
        result = run.start(prepared(script))
        check_safe(run, result)
        before = read_commits(run.journal)
        result = run.resume(prepared(later))
        check_safe(run, result)
        assert read_commits(run.journal)[: len(before)] == before
        assert run.resume().end is RunEnd.DONE
        done = [log.pose for log in read_commits(run.journal)]
        assert sorted(done) == [0, 1]
        check_order(run)


def check_safe(run, result):
    world = run.cell.world
    assert result.end in (RunEnd.DONE, RunEnd.STOPPED)
    assert run.cell.arm.deaf or world.motion is Motion.DISARMED
    assert world.largest_force <= run.settings.force_limit + CYCLE_RAMP
    assert world.contacts_kept == 0
    if not (run.cell.arm.deaf or world.clock.stands or world.fault):
        assert not world.in_contact
        assert not world.force.any()


def check_order(run):
    """In the journal, too, every contact is followed by a retract before another."""
    touching = False
    for entry in read_journal(run.journal):
        if entry.event is Event.RESUME:
            touching = False  # The fake cell is a fresh one; a real one retracts first.
        if entry.event is not Event.BEGIN:
            continue
        if entry.step == "engage" and entry.action is Action.APPROACH:
            assert not touching
            touching = True
        if entry.action is Action.MOVE:
            assert not touching
        if entry.action is Action.RETRACT:
            touching = False


class ForgettingRecorder(MemoryRecorder):
    """As the real one: what was saved is dropped."""

    def save(self, path):
        assert path.suffix == ".mcap"
        self.blocks.clear()


def memory_growth(folder, poses, memory, **changes):
    """How much a run's memory grows from its first tenth to its end, and its length in s."""
    run = FakeRun(folder / "run", plan=plan(poses), changes=changes)
    run.recorder = lambda: ForgettingRecorder({})
    taken = {}

    def tell(progress):
        if progress.pose is not None and progress.pose not in taken:
            run.cell.world.commands.clear()
            taken[progress.pose] = memory()

    run.tell = tell
    assert run.start().end is RunEnd.DONE
    return taken[poses - 1] - taken[poses // 10], run.cell.world.clock.now()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_poses(tmp_path):
    tracemalloc.start()
    try:
        growth, _ = memory_growth(tmp_path, 30, lambda: tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # One pose keeps some hundred blocks, about 200 kB, until it is saved.
    assert growth < 100_000


@pytest.mark.slow
def test_a_run_of_ten_simulated_hours_stays_flat(tmp_path):
    def peak():
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return used if sys.platform == "darwin" else used * 1024

    long = {"cycle": 0.1, "dwell": 2.0, "average": 20.0, "unloaded_average": 20.0}
    growth, duration = memory_growth(tmp_path, 500, peak, **long)
    assert duration > 36_000.0
    assert growth < 5_000_000
