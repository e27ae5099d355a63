"""``elastocal run`` on the simulated cell: refusals, the dry run, a whole run, kill and resume."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from elastocal import procedure
from elastocal.cell import fingerprint, load_cell
from elastocal.compensation.programs.plan_program import speeds_of
from elastocal.errors import DatasetError, FileAccessError
from elastocal.planning import read_plan, write_plan
from elastocal.procedure import (
    Journal,
    RunFolder,
    cell_path_in_run,
    fill_folder,
    read_journal,
    refuse_foreign_files,
)
from elastocal.procedure.record import read_commits
from support import drivers
from support.by_day import some_by_day
from support.cli import elastocal
from support.run_cells import PlannedCell, planned_cell

VALUES = ("controller_displacement", "marker_displacement", "force", "joint_position")


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    return planned_cell(tmp_path_factory.mktemp("planned"))


@pytest.fixture(scope="module")
def whole(planned, tmp_path_factory):
    """An undisturbed run."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    return out, run(planned, out, "--json")


def run(planned, out, *more):
    return elastocal("run", planned.cell, "--plan", planned.plan, "--out", out, *more)


def started(planned, out):
    """Return a process of its own that is somewhere in the second of four poses."""
    command = [sys.executable, "-c", "from elastocal.cli.main import run; run()", "run"]
    journal, more = RunFolder(out).journal, ["--plan", planned.plan, "--out", out]
    process = subprocess.Popen([*command, planned.cell, *more], stderr=subprocess.PIPE, text=True)
    while process.poll() is None and (not journal.is_file() or journal.stat().st_size < 4_000):
        time.sleep(0.002)
    return process


def test_a_run_commits_every_pose_and_writes_the_dataset(whole):
    out, result = whole
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    assert (figures["state"], figures["committed"], figures["given_up"]) == ("done", 4, [])
    assert figures["readings"] == {"ok": 8}
    folder = RunFolder(out)
    assert folder.summary.is_file()
    assert len(list(folder.streams.iterdir())) == 4
    data = xr.load_dataset(folder.dataset)
    assert dict(data.sizes) | {"pose": 4, "load_case": 2} == dict(data.sizes)
    assert np.isfinite(data["marker_displacement"]).all()


def test_the_live_view_names_each_pose(whole):
    lines = whole[1].err.splitlines()
    assert sum(line.startswith("pose ") for line in lines) == 4
    assert lines[0].startswith("pose 0 (1 of 4)")


def test_the_copies_in_the_folder_are_the_cell_and_the_plan(planned, whole):
    folder = RunFolder(whole[0])
    copy = folder.cell / read_journal(folder.journal)[0].run.cell_file
    assert copy.read_bytes() == planned.cell.read_bytes()
    assert load_cell(copy).file == load_cell(planned.cell).file
    assert (folder.plan / "plan.json").read_bytes() == (planned.plan / "plan.json").read_bytes()


@pytest.mark.slow
def test_killed_for_real_it_goes_on_to_the_same_dataset(planned, whole, tmp_path):
    out = tmp_path / "killed"
    journal = RunFolder(out).journal
    process = started(planned, out)
    process.kill()
    process.stderr.close()
    assert process.wait() == -signal.SIGKILL
    before = read_commits(journal)
    assert len(before) < 4
    result = run(planned, out, "--resume", "--yes")
    assert result.code == 0, result.err
    assert "last entry: " in result.err
    assert read_commits(journal)[: len(before)] == before
    ours, theirs = (xr.load_dataset(RunFolder(path).dataset) for path in (out, whole[0]))
    for name in VALUES:
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=1e-9)


@pytest.mark.parametrize("number", some_by_day([signal.SIGINT, signal.SIGTERM]))
def test_a_signal_leaves_the_surface_and_can_be_resumed(planned, tmp_path, number):
    out = tmp_path / "run"
    journal = RunFolder(out).journal
    process = started(planned, out)
    process.send_signal(number)
    said = process.communicate()[1]
    assert process.returncode == 130, said
    assert "interrupted: " in said
    assert "the same command with --resume goes on" in said
    assert read_journal(journal)[-1].text.startswith("interrupted, ")
    assert run(planned, out, "--resume", "--yes").code == 0


@pytest.mark.slow
def test_a_complete_run_may_be_resumed_without_moving(planned, whole):
    out, _ = whole
    commits = read_commits(RunFolder(out).journal)
    assert run(planned, out, "--resume", "--yes").code == 0
    assert read_commits(RunFolder(out).journal) == commits


def test_a_dry_run_lists_the_steps_and_writes_nothing(planned, tmp_path):
    result = run(planned, tmp_path / "dry", "--dry-run", "--json")
    figures = json.loads(result.out)
    assert figures["poses"] == 4
    assert figures["seconds"] == pytest.approx(
        sum(step["seconds"] for step in figures["steps"]), abs=0.1
    )
    assert not (tmp_path / "dry").exists()
    rehearsed = run(planned, tmp_path / "dry", "--dry-run")
    assert "Nothing was moved." in rehearsed.err
    assert "written to" not in rehearsed.err
    plan, robot = read_plan(planned.plan), load_cell(planned.cell).robot
    lines = [dict(word.split("=") for word in line.split()) for line in rehearsed.out.splitlines()]
    assert [int(line["pose"]) for line in lines] == [0, 1, 2, 3]
    for line, pose, begin in zip(lines, plan.poses, starts(plan), strict=True):
        assert float(line["start[s]"]) == pytest.approx(begin, abs=0.06)
        assert line["station"] == pose.seen_by
        for name, value, turns in zip(robot.joint_names, pose.joints, robot.revolute, strict=True):
            unit, scale = ("deg", np.degrees(1.0)) if turns else ("mm", 1e3)
            assert float(line[f"{name}[{unit}]"]) == pytest.approx(scale * value, abs=1e-4)


def starts(plan):
    """Return when the way to each pose begins, by the plan's own times."""
    each = [m.duration + p.contact_time for m, p in zip(plan.moves, plan.poses, strict=False)]
    return np.cumsum([0.0, *each])[:-1]


@pytest.mark.slow
def test_a_dry_run_of_plan_writes_nothing_and_prints_the_poses_of_the_plan(planned, tmp_path):
    out = tmp_path / "nothing"
    result = elastocal("plan", planned.cell, "--out", out, "--compare", "none", "--dry-run")
    assert (result.code, out.exists()) == (0, False)
    assert "Nothing was written." in result.err
    assert result.out == run(planned, tmp_path / "dry", "--dry-run").out


def test_plan_rehearsal_run_and_krl_program_name_one_duration(planned, whole, tmp_path):
    plan, cell = read_plan(planned.plan), load_cell(planned.cell)
    rehearsed = json.loads(run(planned, tmp_path / "dry", "--dry-run", "--json").out)["seconds"]
    assert rehearsed == pytest.approx(plan.total_time, rel=1e-9)
    assert json.loads(whole[1].out)["seconds"] == pytest.approx(plan.total_time, rel=0.1)
    program = speeds_of(plan)
    slower = 100.0 * cell.file.motion.override / program.ptp_percent
    wanted = plan.total_time + (slower - 1.0) * plan.travel_time
    assert program.total_time(plan) == pytest.approx(wanted, rel=0.01)


def test_a_folder_that_holds_a_run_is_refused(planned, whole):
    reason = run(planned, whole[0]).reason
    assert "holds this run already (4 of 4 poses committed): nothing is left to do" in reason
    assert "--resume" not in reason
    assert "for a new run name another folder" in reason


def test_resume_is_advised_with_what_it_would_do(planned, whole, tmp_path):
    lines = RunFolder(whole[0]).journal.read_text().splitlines(keepends=True)
    commits = [number for number, line in enumerate(lines) if '"event":"commit"' in line]
    for last, words in ((commits[1], "--resume measures pose 2, 3"), (commits[3], "to HOME")):
        out = tmp_path / str(last)
        shutil.copytree(whole[0], out)
        RunFolder(out).journal.write_text("".join(lines[: last + 1]))
        assert words in run(planned, out).reason


def test_a_folder_that_holds_another_run_is_refused(planned, whole):
    for more in ((), ("--resume", "--yes")):
        reason = run(planned, whole[0], "--seed", 5, *more).reason
        assert "holds another run: its seed is 0, not 5; to go on with it give --seed 0" in reason


def test_a_folder_that_holds_something_else_is_refused(planned, tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    assert "holds 'thesis.tex', which is no part of a run" in run(planned, tmp_path).reason


def test_resume_without_a_run_is_refused(planned, tmp_path):
    reason = run(planned, tmp_path / "none", "--resume").reason
    assert "holds no run to go on with: leave --resume out" in reason


def test_resume_asks_and_no_terminal_is_no_answer(planned, whole, monkeypatch):
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False, raising=False)
    entries = read_journal(RunFolder(whole[0]).journal)
    result = run(planned, whole[0], "--resume")
    assert result.code == 1
    assert "a person must confirm that the cell is clear: give --yes" in result.err
    assert read_journal(RunFolder(whole[0]).journal) == entries


REAL = "devices: {arm: cell3, sensor: cell3, metrology: cell3}"


def test_on_a_real_machine_a_person_is_asked_before_anything_is_written(
    planned, tmp_path, monkeypatch
):
    drivers.install(tmp_path / "site", monkeypatch, "cell3", drivers.REAL)
    cell = planned.with_text("real.yaml", REAL)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False, raising=False)
    result = run(cell, tmp_path / "run")
    assert "a person must confirm that the cell is clear: give --yes" in result.reason
    assert read_journal(RunFolder(tmp_path / "run").journal) == ()


@pytest.mark.slow
def test_on_a_real_machine_a_run_is_done_when_a_person_has_agreed(planned, tmp_path, monkeypatch):
    drivers.install(tmp_path / "site", monkeypatch, "cell3", drivers.REAL)
    cell = planned.with_text("real.yaml", REAL)
    assert run(cell, tmp_path / "run", "--yes").code == 0


def seen_once_by_another_station(planned):
    """Return the cell with a second tracker, which sees one pose only."""
    cell = planned.cell.with_name("two_stations.yaml")
    first = '  - name: station_1\n    position: ["2.4 m", "-4.0 m", "2.2 m"]'
    more = first.replace("station_1", "station_2").replace("2.4 m", "2.6 m")
    text = planned.cell.read_text(encoding="utf-8")
    more += '\n    range: ["1.0 m", "15 m"]\n'
    cell.write_text(text.replace(first, more + first), encoding="utf-8")
    plan = read_plan(planned.plan)
    known = replace(plan.cell, fingerprint=fingerprint(load_cell(cell)))
    last = replace(plan.poses[-1], seen_by="station_2")
    folder = planned.plan.with_name("few")
    folder.mkdir()
    write_plan(folder, replace(plan, cell=known, poses=(*plan.poses[:-1], last)))
    return PlannedCell(cell, folder)


@pytest.mark.slow
def test_a_reading_that_derive_calls_missing_is_counted_and_warned_of(planned, tmp_path):
    few = seen_once_by_another_station(planned)
    assert "warning: station station_2 sees 1 of the 3" in run(few, tmp_path, "--dry-run").err
    result = run(few, tmp_path / "run", "--json")
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    assert figures["readings"] == {"ok": 6, "missing": 2}
    assert any("station_2 is not registered" in line for line in figures["warnings"])
    assert "warning: station station_2 sees 1 of the 3" in result.err


def test_a_run_whose_readings_cannot_be_derived_still_says_how_it_ended(
    planned, tmp_path, monkeypatch
):
    def fails(_):
        raise DatasetError("no usable reading among 8")

    monkeypatch.setattr(procedure, "derive_run", fails)
    result = run(planned, tmp_path / "run", "--json")
    assert result.code == 1
    figures = json.loads(result.out)
    assert (figures["state"], figures["given_up"], figures["dataset"]) == ("done", [], None)
    assert figures["problem"] == "no usable reading among 8"
    assert result.err.endswith("elastocal: no usable reading among 8\n")


def test_a_folder_whose_journal_another_process_holds_is_not_filled(planned, tmp_path):
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    with Journal(folder.journal):
        assert "is in use: another process runs here" in run(planned, folder.path).reason
    assert not folder.plan.exists()
    assert not folder.cell.exists()


def test_a_plan_that_was_changed_by_hand_is_refused(planned, tmp_path):
    changed = planned.plan.with_name("changed")
    changed.mkdir()
    text = (planned.plan / "plan.json").read_text(encoding="utf-8")
    (changed / "plan.json").write_text(text.replace("-1100.0", "-4000.0", 1), encoding="utf-8")
    reason = run(PlannedCell(planned.cell, changed), tmp_path / "run").reason
    assert "was changed by hand: make it anew with `elastocal plan`" in reason


def test_a_plan_that_contradicts_its_cell_is_refused_whoever_wrote_it(planned, tmp_path):
    changed = planned.plan.with_name("contradicting")
    changed.mkdir()
    plan = read_plan(planned.plan)
    contact = replace(plan.contact, near_contact=-0.01)
    write_plan(changed, replace(plan, contact=contact))
    reason = run(PlannedCell(planned.cell, changed), tmp_path / "run").reason
    assert "contact.near_contact is -0.01 m, engagement.near_contact of the cell 0.003 m" in reason


def test_a_copy_that_was_changed_is_refused_on_resume(planned, whole, tmp_path):
    shutil.copytree(whole[0], tmp_path / "run")
    (cell,) = (tmp_path / "run" / "cell").glob("*.yaml")
    cell.write_text(cell.read_text().replace('mass: "60 kg"', 'mass: "20 kg"'), encoding="utf-8")
    reason = run(planned, tmp_path / "run", "--resume", "--yes").reason
    assert "is not what the run wrote: its SHA-256 is" in reason


def test_journal_and_streams_are_known_to_check(whole):
    folder = RunFolder(whole[0])
    said = json.loads(elastocal("check", folder.journal, "--json").out)
    assert (said["kind"], said["committed"]) == ("journal of a run", [0, 1, 2, 3])
    said = json.loads(elastocal("check", folder.stream(0, 1), "--json").out)
    assert said["kind"] == "recording of raw streams"
    assert said["schema"] == "elastocal.streams/1"
    assert said["wrenches"] > 100


def test_a_plan_of_another_cell_is_refused(planned, tmp_path):
    text = planned.cell.read_text(encoding="utf-8")
    other = planned.cell.with_name("other.yaml")
    other.write_text(text.replace('fz: "1100 N"', 'fz: "1101 N"'), encoding="utf-8")
    result = elastocal("run", other, "--plan", planned.plan, "--out", tmp_path / "run")
    assert "the plan belongs to another cell: it was made for 'afp'" in result.reason
    assert not (tmp_path / "run").exists()


def test_a_device_that_is_not_configured_is_refused_by_name(planned, tmp_path):
    cell = planned.with_text("kuka.yaml", "devices: {arm: simulatd}")
    reason = run(cell, tmp_path / "run").reason
    assert "devices.arm: unknown driver 'simulatd'; did you mean 'simulated'?" in reason
    assert "(allowed: simulated, " in reason
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ('procedure: {force_limit: "1 kN"}', "procedure.force_limit must be above 1146"),
        ('procedure: {force_limit: "9 kN"}', "at most 6250 N (range of the sensor), got 9000 N"),
        ('procedure: {stale: "60 ms"}', "must be above two cycles (0.08 s)"),
        ('procedure: {dwell: "100 ms"}', "must be at least four cycles (0.16 s)"),
        ('procedure: {ramp: "400 N"}', "is not a force rate"),
        ('procedure: {cycle: "1 s"}', "procedure.cycle: Input should be less than or equal to 0.1"),
        ('procedure: {cycle: "0.1 s", stale: "150 ms"}', "must be above two cycles (0.2 s)"),
        ('procedure: {stale: "2 s"}', "procedure.stale: Input should be less than or equal to 1"),
        ('procedure: {contact_speed: "50 mm/s"}', "procedure.contact_speed: Input should be less"),
        ('procedure: {approach_speed: "1 mm/s"}', "contact_speed: must be at most approach_speed"),
        ('procedure: {approach_speed: "3 m/s"}', "procedure.approach_speed: Input should be less"),
        ('procedure: {travel_limit: "5 m"}', "procedure.travel_limit: Input should be less"),
        (
            "procedure: {retries: 1000}",
            "procedure.retries: Input should be less than or equal to 5",
        ),
        ('procedure: {timeout: "1 s"}', "must be at least dwell and average together (1.5 s)"),
        ('procedure: {ramp: "100 kN/s"}', "procedure.ramp: Input should be less than or equal to"),
        (
            'procedure: {force_tolerance: "400 N"}',
            "procedure.force_tolerance: Input should be less",
        ),
        ('procedure: {contact_force: "3 N"}', "contact_force: must be above force_spread (8 N)"),
        ('procedure: {contact_force: "1.2 kN"}', "contact_force must be below 1100 N (load case"),
        ("procedure: {retry: 2}", "unknown key 'procedure.retry'; did you mean 'retries'?"),
    ],
)
def test_a_procedure_that_cannot_be_is_refused(planned, tmp_path, section, message):
    cell = planned.with_text("procedure.yaml", section)
    assert message in run(cell, tmp_path / "run").reason


def test_other_settings_on_resume_are_refused(planned, whole):
    cell = planned.with_text("average.yaml", 'procedure: {average: "2 s"}')
    reason = run(cell, whole[0], "--resume", "--yes").reason
    assert "procedure.average is 2.0, the run was started with 1.0" in reason


FAULT = "faults: [{kind: ft_dropout, pose: 1, step: hold}]"


def test_a_fault_ends_the_run_with_one_line_that_says_where_the_arm_is(planned, tmp_path):
    cell = planned.with_text("fault.yaml", FAULT)
    result = run(cell, tmp_path / "run")
    assert result.code == 1
    last = result.err.strip().splitlines()[-1]
    assert last.startswith("elastocal: pose 1, attempt 1, load normal: force sensor silent")
    assert last.endswith("The arm is retracted to the approach pose")
    assert "Traceback" not in result.err


@pytest.mark.slow
def test_a_run_goes_on_when_its_fault_is_gone_and_the_cell_is_the_same(planned, tmp_path):
    cell = planned.with_text("fault.yaml", FAULT)
    assert run(cell, tmp_path / "run").code == 1
    assert run(planned, tmp_path / "run", "--resume", "--yes").code == 0


def test_a_soft_collision_on_the_way_to_the_next_pose_ends_the_run(planned, tmp_path):
    # The arm leaves for the next pose 4.9 s after it begins to retract, and is there 2 s later.
    fault = 'kind: soft_collision, pose: 0, step: retract, after: "5.8 s", amplitude: "250 N"'
    cell = planned.with_text("collision.yaml", f"faults: [{{{fault}}}]")
    result = run(cell, tmp_path / "run")
    last = result.err.strip().splitlines()[-1]
    assert last.startswith("elastocal: pose 1, attempt 1, move: hit something on the way: ")
    assert "limit 168 N. The arm is on its way between poses; whether the tool touches" in last


def test_files_above_the_cell_file_keep_their_places(planned, tmp_path):
    (tmp_path / "cells").mkdir()
    (tmp_path / "meshes").mkdir()
    cell = tmp_path / "cells" / "cell.yaml"
    text = planned.cell.read_text(encoding="utf-8")
    cell.write_text(text.replace("dome.stl", "../meshes/dome.stl"), encoding="utf-8")
    (tmp_path / "meshes" / "dome.stl").write_bytes(planned.cell.with_name("dome.stl").read_bytes())
    loaded, folder = load_cell(cell), RunFolder(tmp_path / "run")
    fill_folder(folder, loaded, planned.plan)
    assert cell_path_in_run(loaded) == str(Path("cells") / "cell.yaml")
    assert load_cell(folder.cell / cell_path_in_run(loaded)).file == loaded.file


def test_what_a_run_leaves_before_its_first_entry_is_no_hindrance(tmp_path):
    folder = RunFolder(tmp_path)
    folder.streams.mkdir()
    folder.journal.touch()
    refuse_foreign_files(folder)
    (tmp_path / "other").touch()
    with pytest.raises(FileAccessError, match="holds 'other'"):
        refuse_foreign_files(folder)
