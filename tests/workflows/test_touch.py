"""``touch`` on the simulated cell: cold and warm runs, the state, and what corrects by it."""

import json
import shutil
from dataclasses import replace
from datetime import datetime, timedelta
from types import SimpleNamespace

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.errors import ProcedureError
from elastocal.procedure import Event, Journal, read_journal, read_touches
from elastocal.procedure.derive import read_taught_markers, touches as touches_module
from elastocal.sim import truth_of
from elastocal.workflows import check, derive, run, touch
from support.cli import elastocal
from support.kept import kept
from support.run_cells import PlannedCell, planned_cell

POSES = 8
JUMP = np.array([0.0, 5e-3, 0.0])


@pytest.fixture(scope="module")
def touched(tmp_path_factory):
    """A cell that was touched cold and warm, with the state."""
    folder = shutil.copytree(kept("touched", _make), tmp_path_factory.mktemp("touched") / "cell")
    made = PlannedCell(folder / "cell" / "cell.yaml", folder / "plan")
    return folder, made, json.loads((folder / "told.json").read_text(encoding="utf-8"))


def _make(folder):
    made = planned_cell(folder, POSES, "afp", (r"\n  technique: .*", "\n  technique: cover"))
    text = made.cell.read_text(encoding="utf-8").replace("preset: kind", "preset: typical")
    made.cell.write_text(text, encoding="utf-8")
    run(made.cell, plan=made.plan, out=folder / "cold", touch="cold", confirmed=True)
    done = elastocal(
        *("touch", made.cell, "--cold", folder / "cold", "--out", folder / "state.json"),
        *("--yes", "--json"),
    )
    assert done.code == 0, done.err
    (folder / "told.json").write_text(done.out, encoding="utf-8")


def truth(cell, q):
    """Return how far the tool of the warm arm is from that of the cold one, by the simulator."""
    drift, robot = truth_of(cell).thermal.drift, cell.robot
    at_home = robot.forward(cell.home)[:3, 3] - robot.foot(cell.home)
    share = drift / np.linalg.norm(at_home)
    return share * (robot.forward(q)[..., :3, 3] - robot.foot(q))


@pytest.mark.slow
def test_the_state_is_what_the_simulated_arm_has_grown(touched):
    folder, made, data = touched
    cell, found = load_cell(made.cell), read_touches(folder / "cold", folder / "state-run")
    state = touch(made.cell, cold=folder / "cold", out=folder / "s.json", warm=folder / "state-run")
    assert state.share == pytest.approx(data["share"], rel=1e-6)
    assert len(state.points) == POSES
    true = truth(cell, found.q)
    assert np.linalg.norm(true, axis=1).mean() > 40e-6
    off = state.shift(cell.robot, found.q) - true
    assert np.linalg.norm(off, axis=1).mean() < 0.6 * np.linalg.norm(true, axis=1).mean()
    assert np.abs(off).max() < 2.0 * state.half_width
    # Nothing random of the cold run comes back in the warm one.
    assert 5e-6 < state.noise < 60e-6


def test_cold_touches_teach_where_marker_and_controller_are_where_courses_begin(touched):
    folder, made, _ = touched
    cell, robot = load_cell(made.cell), load_cell(made.cell).robot
    found = read_taught_markers((folder / "cold", folder / "cold"))
    assert found.station == cell.file.trackers[0].name
    assert found.place.shape == found.offset.shape == (POSES, 3)
    once = read_taught_markers((folder / "cold",))
    np.testing.assert_allclose(found.offset, once.offset, atol=1e-15)
    # Warm readings against them show what the arm has grown, as `touch` has it.
    warm = read_taught_markers((folder / "state-run",))
    assert warm.place.shape == (0, 3)
    shift = read_touches(folder / "cold", folder / "state-run").shift
    assert np.linalg.norm(found.offset, axis=1).max() < 2e-3
    assert np.linalg.norm(shift, axis=1).max() < 1e-3
    assert robot.joint_names == found.robot.joint_names


def test_only_the_contact_force_is_pressed_with(touched):
    folder, made, _ = touched
    limit = load_cell(made.cell).file.procedure.contact_force
    held = {
        entry.target
        for entry in read_journal(folder / "cold" / "journal.jsonl")
        if entry.action is not None and entry.action.value == "hold" and entry.target
    }
    assert held == {"light_contact"}
    assert limit < 100.0


@pytest.mark.slow
def test_a_finished_warm_run_is_read_and_not_made_again(touched):
    folder, made, data = touched
    journal = folder / "state-run" / "journal.jsonl"
    before = journal.read_bytes()
    touch(made.cell, cold=folder / "cold", out=folder / "t.json", warm=folder / "state-run")
    assert journal.read_bytes() == before
    again = json.loads((folder / "t.json").read_text())
    assert again["share"] == pytest.approx(data["share"], rel=1e-6)
    assert check(folder / "t.json").kind == "state of an arm"


@pytest.mark.parametrize(
    ("cold", "warm", "message"),
    [
        ("state-run", "state-run", "is warm: the cold touches are wanted"),
        ("cold", "cold", "is cold: the warm touches are wanted"),
    ],
)
def test_runs_of_the_wrong_kind_are_refused(touched, cold, warm, message):
    folder, made, _ = touched
    with pytest.raises(ProcedureError, match=message):
        touch(made.cell, cold=folder / cold, out=folder / "u.json", warm=folder / warm)
    assert not (folder / "u.json").exists()


def test_touches_have_no_dataset(touched):
    folder, _, _ = touched
    with pytest.raises(ProcedureError, match="holds touches, which press no load case"):
        derive(folder / "cold")


def test_whoever_verifies_touches_is_not_sent_to_derive_them(touched):
    folder, _, _ = touched
    done = elastocal("verify", folder / "cold")
    assert done.code == 1
    assert "touches have none, they press no load case: `elastocal touch` reads them" in done.err


def test_a_run_that_is_resumed_stays_what_it_is(touched):
    folder, made, _ = touched
    with pytest.raises(ProcedureError, match=r"its touch is cold, not None.*give --touch cold"):
        run(made.cell, plan=made.plan, out=folder / "cold", resume=True, confirmed=True)


def test_a_word_for_how_warm_it_is_must_be_one_of_two(touched):
    folder, made, _ = touched
    with pytest.raises(ProcedureError, match="--touch 'hot' is not one of cold, warm"):
        run(made.cell, plan=made.plan, out=folder / "hot", touch="hot", confirmed=True)


def copied(run, folder, commits):
    """Copy a run whose journal ends after some poses."""
    shutil.copytree(run, folder)
    journal, kept = folder / "journal.jsonl", []
    for line in journal.read_text(encoding="utf-8").splitlines(keepends=True):
        kept.append(line)
        commits -= json.loads(line)["event"] == "commit"
        if not commits:
            break
    journal.write_text("".join(kept), encoding="utf-8")
    return folder


def test_nothing_moves_where_the_cold_run_is_of_no_use(touched, tmp_path):
    folder, made, _ = touched
    for cold, message in (
        (folder / "state-run", "is warm: the cold touches are wanted"),
        (
            copied(folder / "cold", tmp_path / "two", 2),
            "no tracker can be registered: station_1 it",
        ),
    ):
        with pytest.raises(ProcedureError, match=message):
            touch(made.cell, cold=cold, out=tmp_path / "v.json", confirmed=True)
        assert not (tmp_path / "v-run").exists()


@pytest.mark.slow
def test_half_a_warm_run_is_gone_on_with_and_not_taken_for_all_of_it(
    touched, tmp_path, monkeypatch
):
    folder, made, _ = touched
    half, files = copied(folder / "state-run", tmp_path / "half", 4), {"cold": folder / "cold"}
    files |= {"warm": half, "out": tmp_path / "w.json"}
    with pytest.raises(ProcedureError, match="half: the warm touches are not done: `--resume`"):
        touch(made.cell, **files)
    assert not (tmp_path / "w.json").exists()
    assert len(touch(made.cell, **files, resume=True, confirmed=True).points) == POSES
    found = read_touches(folder / "cold", half)
    assert sorted(found.sessions[:, 1].tolist()) == [0] * 4 + [1] * 4
    assert not found.sessions[:, 0].any()
    read_run = touches_module.read_run

    def pause(after: timedelta) -> float:
        """Return the pause where the run was gone on with so long after it began."""

        def read(path):
            run = read_run(path)
            text = (datetime.fromisoformat(run.record.started) + after).isoformat()
            entries = (
                each.model_copy(update={"text": text}) if each.event is Event.RESUME else each
                for each in run.entries
            )
            return replace(run, entries=tuple(entries))

        monkeypatch.setattr(touches_module, "read_run", read)
        return read_touches(folder / "cold", half).pause

    # The simulated cell's clock runs ahead of the wall's.
    assert pause(timedelta(seconds=1)) == 0.0
    assert 86400.0 - 3600.0 < pause(timedelta(days=1)) < 86400.0


@pytest.mark.slow
def test_a_warm_run_that_a_fault_has_ended_is_not_taken_for_all_of_it(touched, tmp_path):
    folder, made, _ = touched
    half = copied(folder / "state-run", tmp_path / "half", 4)
    with Journal(half / "journal.jsonl") as journal:
        journal.write(1e4, Event.FINISH, text="stopped, retracted to the approach pose: a fault")
    with pytest.raises(ProcedureError, match="half: the warm touches are not done: `--resume`"):
        touch(made.cell, cold=folder / "cold", warm=half, out=tmp_path / "w.json")
    assert not (tmp_path / "w.json").exists()


@pytest.mark.slow
@pytest.mark.parametrize("moved", ["cold", "state-run"])
def test_a_tracker_that_moved_during_the_touches_is_refused(touched, monkeypatch, moved):
    folder, _, _ = touched

    def read(path):
        run = read_run(path)
        return replace(run, poses=tuple(map(pushed, run.poses))) if path.name == moved else run

    def pushed(pose):
        if pose.pose < POSES // 2:
            return pose
        return replace(pose, **{name: away(getattr(pose, name)) for name in ("reference", "light")})

    def away(reading):
        marker = reading.marker
        return replace(reading, marker=replace(marker, value=marker.value + JUMP))

    read_run = touches_module.read_run
    monkeypatch.setattr(touches_module, "read_run", read)
    with pytest.raises(ProcedureError, match=rf"{moved}: station station_1 moved by"):
        read_touches(folder / "cold", folder / "state-run")


@pytest.mark.parametrize(
    ("began", "resumed", "pause"),
    [
        ("2026-11-29T08:00:00+00:00", "2026-11-29T10:00:00+00:00", 7200.0 - 60.0),
        ("2026-11-29T08:00:00+00:00", "", 0.0),
        ("", "2026-11-29T10:00:00+00:00", 0.0),
    ],
)
def test_the_longest_pause_of_a_run_is_that_between_its_sessions(began, resumed, pause):
    entries = [
        SimpleNamespace(event=event, text=text, time=time)
        for event, text, time in (
            (Event.START, "", 5.0), (Event.COMMIT, "", 65.0), (Event.RESUME, resumed, 65.0),
        )
    ]  # fmt: skip
    run = SimpleNamespace(record=SimpleNamespace(started=began), entries=entries)
    assert touches_module._longest_pause(run) == pytest.approx(pause)
