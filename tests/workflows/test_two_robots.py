"""Two robots through the public face: planted arms are found, and the deviation taken back."""

import json
import re

import numpy as np
import pytest

import elastocal as ec
from elastocal.blocks import Bullets, Facts, Heading
from elastocal.errors import (
    CompensationError,
    ConventionError,
    FileAccessError,
    PlanningError,
    SchemaError,
)
from elastocal.identification import read_model
from elastocal.records import read_json
from elastocal.sim.two_arms import true_arm
from elastocal.two_robots import PairResult, load_pair_cell
from elastocal.two_robots.meetings import meeting_pool
from support import two_arms
from support.cli import elastocal


@pytest.fixture(scope="module")
def done():
    return two_arms.finished()


@pytest.fixture(scope="module")
def result(done):
    return read_json(done / "models" / "pair.json", PairResult)


@pytest.fixture(scope="module")
def unseen(done):
    """Deflections of both true arms at meetings that no calibration saw."""
    cell = load_pair_cell(done / "cell.yaml")
    pool = meeting_pool(cell, np.random.default_rng(5))
    force = pool.T[:50, :3, :3] @ np.array([200.0, 0.0, -900.0])
    forces = force, -force @ cell.T_first_second[:3, :3]
    truth = cell.file.simulation
    found = []
    for arm, (robot, softness) in enumerate(zip(cell.robots, truth.softness, strict=True)):
        true = true_arm(
            robot.urdf, robot.tip, robot.base, softness, truth.stiffening, truth.bending,
            robot.gravity,
        )  # fmt: skip
        q = pool.q[arm][:50]
        found.append((q, forces[arm], true.equilibrium(q, forces[arm]).deflection))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("arm", [0, 1])
def test_both_arms_are_found_without_a_tracker(done, unseen, arm):
    q, force, true = unseen[arm]
    model = read_model(done / "models" / f"{('left', 'right')[arm]}.json")
    found = model.predict(q, force)
    error = np.linalg.norm(found.deflection - true, axis=1).mean()
    assert error < 0.025 * np.linalg.norm(true, axis=1).mean()
    inside = (true >= found.low) & (true <= found.high)
    assert inside.mean() > 0.75


def test_the_error_at_left_out_poses_is_that_of_the_noise(result):
    assert result.held_out < 0.02 * result.deflection
    assert result.poses == 25
    assert result.readings == 150
    assert not result.tracked


def test_the_stated_contact_is_corrected_by_the_presses(result):
    """Planted at 50 and 35 N/um, stated at 45 and 40 give or take 30 %."""
    figures = {each.name: each for each in result.contact}
    assert figures["normal"].low < 1.0 / 50e6 < figures["normal"].high
    assert figures["lateral"].low < 1.0 / 35e6 < figures["lateral"].high


def test_the_page_shows_both_arms_and_names_what_is_not_seen(done, result):
    page = (done / "models" / "pair.html").read_text(encoding="utf-8")
    assert "<title>Zwei Roboter: " in page
    assert all(f"{each.name}.json" in page for each in result.arms)
    assert f"{result.held_out / result.deflection:.1%}".rstrip("%").replace(".", ",") in page
    assert "Verbindungslinie beider Basen" in page
    for title in ("Beide Arme", "Was die Pressungen nicht", "davor und danach"):
        assert re.search(f"<h2 [^>]*>[^<]*{title}", page)


def test_what_is_not_seen_is_named(result):
    (tilt,) = [each for each in result.findings if each.kind == "two-robots.tilt"]
    assert "how much each base tilts about the line that joins both bases is not seen" in tilt
    assert "name its model in the cell file" in tilt.advice


def test_what_is_not_told_apart_has_a_line_each_by_arm(result):
    (shown,) = [blocks for name, _, blocks in result.sections() if name == "unseen"]
    blocks = list(shown)
    heads = [each.text for each in blocks if isinstance(each, Heading)]
    assert heads == ["Of both arms together", "Of left alone", "Of right alone"]
    both, *alone = (each.items for each in blocks if isinstance(each, Bullets))
    assert all("left:" in line or "right:" in line for line in both)
    assert not any("left:" in line or "right:" in line for lines in alone for line in lines)
    for lines in alone:
        assert lines[0].startswith("no press loads these springs: joint_a6.axial")
    groups = [each for each in (*result.unobservable, *result.hidden) if len(each) > 1]
    assert len(both) + sum(len(lines) - 1 for lines in alone) == len(groups)


def test_the_deviation_at_the_presses_is_that_before_and_after_a_correction(result):
    found = result.cooperation
    assert found.rows == result.readings
    assert found.before == pytest.approx(result.deflection, rel=0.1)
    assert found.after < 0.01 * found.before
    assert found.limited == 0
    (shown,) = [blocks for name, _, blocks in result.sections() if name == "deviation"]
    assert [each for each in shown if isinstance(each, Facts)] == [Facts(found.facts())]


@pytest.mark.slow
def test_a_meeting_is_left_out_by_name(done, tmp_path):
    run, out = done / "run", tmp_path / "models"
    given = "--springs", "bearing", "--draws", "40", "--exclude", "3", "--exclude", "5:normal"
    shown = elastocal(
        "calibrate-pair", done / "cell.yaml", run / "left.nc", run / "right.nc", "--out", out,
        *given,
    )  # fmt: skip
    found = read_json(out / "pair.json", PairResult)
    assert (found.poses, found.readings, found.set_aside) == (24, 143, 0)
    assert "presses left out by hand: 3:" in " ".join(shown.err.split())


def test_a_known_arm_makes_the_other_better(done, unseen, tmp_path):
    """A model of the truth's own deflections, exact but for its springs, known for one arm."""
    run = done / "run"
    tracked = tmp_path / "tracked"
    ec.simulate_pair(done / "cell.yaml", plan=done / "plan.json", out=tracked, tracked=True)
    urdf = load_pair_cell(done / "cell.yaml").robots[0].urdf
    (tmp_path / "left.urdf").write_text(urdf, encoding="utf-8")
    ec.calibrate(tracked / "left.nc", springs="gears", draws=60, out=tmp_path / "left.json")
    text = two_arms.CELL.replace("tool_mass", "model: left.json\n    tool_mass", 1)
    (tmp_path / "cell.yaml").write_text(text, encoding="utf-8")
    found = ec.calibrate_pair(
        tmp_path / "cell.yaml", first=run / "left.nc", second=run / "right.nc",
        out=tmp_path / "models", draws=60,
    )  # fmt: skip
    assert [each.before for each in found.arms] == [True, False]
    assert "two-robots.tilt-known" in {each.kind for each in found.findings}
    q, force, true = unseen[1]
    errors = [
        np.linalg.norm(read_model(place / "right.json").predict(q, force).deflection - true, axis=1)
        for place in (tmp_path / "models", done / "models")
    ]
    assert errors[0].mean() < 0.0125 * np.linalg.norm(true, axis=1).mean()


def test_a_process_is_corrected_by_both_arms(done, tmp_path):
    paths = done / "left_path.csv", done / "right_path.csv"
    found = ec.compensate_pair(
        done / "cell.yaml", models=done / "models", first=paths[0], second=paths[1],
        out=tmp_path / "corrected",
    )  # fmt: skip
    assert found.before > 0.3e-3
    assert found.after < 0.01 * found.before
    assert found.weights == (0.5, 0.5)
    assert found.largest[0] == pytest.approx(found.largest[1])
    lines = (tmp_path / "corrected" / "left.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 16
    assert lines[0].endswith("shift_z[m],deviation_x[m],deviation_y[m],deviation_z[m]")
    one = ec.compensate_pair(
        done / "cell.yaml", models=done / "models", first=paths[0], second=paths[1],
        out=tmp_path / "one", shares=(0.0, 1.0),
    )  # fmt: skip
    assert one.largest[0] == pytest.approx(max(0.0, found.before_max - 3e-3), abs=2e-5)


def test_paths_that_do_not_belong_together_are_refused(done, tmp_path):
    first = done / "left_path.csv"
    text = (done / "right_path.csv").read_text(encoding="utf-8").splitlines()
    short = tmp_path / "short.csv"
    short.write_text("\n".join(text[:-1]) + "\n", encoding="utf-8")
    given = {"models": done / "models", "out": tmp_path / "out"}
    with pytest.raises(CompensationError, match=r"15 rows and .*short\.csv 14"):
        ec.compensate_pair(done / "cell.yaml", first=first, second=short, **given)
    with pytest.raises(CompensationError, match="3 shares: two are needed"):
        ec.compensate_pair(
            done / "cell.yaml", first=first, second=short, shares=(1.0, 1.0, 1.0), **given
        )
    with pytest.raises(ConventionError, match=r"equal sign|not opposite"):
        ec.compensate_pair(done / "cell.yaml", first=first, second=first, **given)


def test_a_plan_or_models_of_another_base_transform_are_refused(done, tmp_path):
    moved = two_arms.CELL.replace('"3600 mm"', '"3601 mm"')
    (tmp_path / "cell.yaml").write_text(moved, encoding="utf-8")
    with pytest.raises(SchemaError, match="another base_transform: plan again"):
        ec.simulate_pair(tmp_path / "cell.yaml", plan=done / "plan.json", out=tmp_path / "run")
    paths = done / "left_path.csv", done / "right_path.csv"
    with pytest.raises(SchemaError, match="another base_transform: calibrate again"):
        ec.compensate_pair(
            tmp_path / "cell.yaml", models=done / "models", first=paths[0], second=paths[1],
            out=tmp_path / "out",
        )  # fmt: skip


def test_arms_that_cannot_reach_each_other_make_no_plan(tmp_path):
    far = two_arms.CELL.replace('"3600 mm", "0 mm"', '"9000 mm", "0 mm"', 1)
    (tmp_path / "cell.yaml").write_text(far, encoding="utf-8")
    with pytest.raises(PlanningError, match="can press on each other at 0 of 300 places"):
        ec.plan_pair(tmp_path / "cell.yaml", out=tmp_path / "plan.json")
    assert not (tmp_path / "plan.json").exists()


@pytest.mark.slow
def test_a_folder_with_files_is_not_filled_again_unless_forced(done, tmp_path):
    out = tmp_path / "run"
    given = (done / "cell.yaml",)
    ec.simulate_pair(*given, plan=done / "plan.json", out=out)
    with pytest.raises(FileAccessError, match="holds files already"):
        ec.simulate_pair(*given, plan=done / "plan.json", out=out)
    ec.simulate_pair(*given, plan=done / "plan.json", out=out, force=True)


@pytest.mark.slow
def test_the_terminal_says_what_is_not_seen(done, tmp_path):
    run = done / "run"
    words = ("calibrate-pair", done / "cell.yaml", run / "left.nc", run / "right.nc")
    shown = elastocal(*words, "--draws", 40, "-o", tmp_path / "models")
    assert shown.code == 0, shown.err
    assert "the line that joins both bases is not seen" in " ".join(shown.err.split())
    found = elastocal(*words, "--draws", 40, "-o", tmp_path / "again", "--json")
    data = json.loads(found.out)
    assert data["arms"][0]["name"] == "left"
    assert "the line that joins both bases is not seen" in str(data["findings"])


def test_a_refusal_is_one_line(done, tmp_path):
    run = done / "run"
    words = ("calibrate-pair", done / "cell.yaml", run / "left.nc", run / "left.nc")
    shown = elastocal(*words, "-o", tmp_path / "models")
    assert shown.code == 1
    assert "mm apart" in shown.reason


@pytest.mark.parametrize("file", ["cell.yaml", "plan.json", "models/pair.json", "models/left.json"])
def test_check_knows_every_file(done, file):
    shown = elastocal("check", done / file)
    assert shown.code == 0, shown.err


def test_a_plan_named_as_its_page_and_a_page_of_another_are_refused_before_the_work(done, tmp_path):
    with pytest.raises(FileAccessError, match=r"--out .*plan\.html: its name must end in \.json"):
        ec.plan_pair(done / "cell.yaml", out=tmp_path / "plan.html")
    (tmp_path / "plan.html").write_text("mine", encoding="utf-8")
    with pytest.raises(FileAccessError, match=r"plan\.html: it is there already"):
        ec.plan_pair(done / "cell.yaml", out=tmp_path / "plan.json")
    assert not (tmp_path / "plan.json").exists()
