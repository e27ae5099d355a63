"""What a journal says of a run that is to go on."""

import pytest

from elastocal.errors import ProcedureError
from elastocal.procedure import Entry, Event, PoseLog, check_same_run, last_known
from elastocal.procedure.record import Action
from support.fake_runs import RECORD, FakeRun


def entries(*rows):
    """Entries from (event, fields)."""
    return tuple(
        Entry(n=n, time=float(n), event=event, **fields) for n, (event, fields) in enumerate(rows)
    )


START = (Event.START, {"run": RECORD})
COMMITTED = (
    Event.COMMIT,
    {"pose": 0, "attempt": 1, "log": PoseLog(pose=0, attempt=1, streams="s", windows=())},
)
HOLD = {"pose": 1, "attempt": 2, "step": "load", "action": Action.HOLD, "target": "north"}


def test_it_tells_where_the_run_was_and_what_is_done():
    known = last_known(entries(START, COMMITTED, (Event.BEGIN, HOLD)))
    assert known.committed == (0,)
    assert known.attempts == {0: 1, 1: 2}
    assert known.uncommitted == 1
    assert last_known(entries(START, COMMITTED)).uncommitted is None
    assert known.lines == (
        "last entry: pose 1, attempt 2, load: begin hold",
        "at 2.0 s of the run's clock",
        "poses committed: 0",
        "the tool may have been at the surface",
    )


@pytest.mark.parametrize(
    ("event", "action", "touches"),
    [
        (Event.BEGIN, Action.MOVE, False),
        (Event.END, Action.MOVE, False),
        (Event.BEGIN, Action.APPROACH, True),
        (Event.END, Action.HOLD, True),
        (Event.BEGIN, Action.RETRACT, True),
        (Event.END, Action.RETRACT, False),
    ],
)
def test_it_knows_when_the_tool_may_touch(event, action, touches):
    stopped = (Event.BEGIN, {"action": Action.STOP})
    known = last_known(
        entries(START, (event, {"pose": 1, "attempt": 1, "action": action}), stopped)
    )
    assert known.may_touch is touches


def test_a_pose_that_was_had_after_all_is_not_given_up():
    lost = (Event.GIVEN_UP, {"pose": 0, "attempt": 2})
    other = (Event.GIVEN_UP, {"pose": 4, "attempt": 2})
    assert last_known(entries(START, lost, other, COMMITTED)).given_up == (4,)


@pytest.mark.parametrize("key", ["plan", "cell", "seed"])
def test_another_run_is_refused_by_name(key):
    other = RECORD.model_copy(update={key: 9 if key == "seed" else "f" * 64})
    with pytest.raises(ProcedureError, match=f"RUN holds another run: its {key} is"):
        check_same_run(RECORD, other, "RUN")


def test_another_start_or_version_is_the_same_run():
    check_same_run(RECORD, RECORD.model_copy(update={"started": "x", "elastocal": "1"}), "RUN")


def test_the_last_entry_of_a_run_says_how_it_ended(tmp_path):
    run = FakeRun(tmp_path / "run")
    run.start()
    from elastocal.procedure import read_journal

    assert last_known(read_journal(run.journal)).lines[0] == (
        "last entry: between poses: finish (done, at HOME)"
    )
