"""A plan is made where production runs, says so, and says what error to expect there."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from elastocal import workflows
from elastocal.cell import Cell, load_cell
from elastocal.compensation.process import process_courses
from elastocal.errors import PlanningError
from elastocal.identification import posture_reach
from elastocal.identification.production import ENOUGH
from elastocal.planning import (
    AddedTo,
    PlanResult,
    best_additions,
    make_plan,
    postures_of,
    read_plan,
    write_plan,
)
from elastocal.planning.checks import registration_shortages
from elastocal.planning.pool import NearProduction
from elastocal.planning.production import plan_coverage, production_findings
from elastocal.workflows import init
from support.by_day import some_by_day


@pytest.fixture(scope="module", params=some_by_day(["afp", "machining"]))
def kind(request) -> str:
    """Return each example."""
    return request.param


@pytest.fixture(scope="module")
def folder(kind, tmp_path_factory):
    """Return an example as `elastocal init` writes it, with a small pool."""
    folder = tmp_path_factory.mktemp(kind)
    path = init(folder, kind=kind).cell
    text = path.read_text().replace("pool: 3000", "pool: 150")
    path.write_text(re.sub(r"\n  poses: \d+", "\n  poses: 6", text))
    return folder


@pytest.fixture(scope="module")
def cell(folder) -> Cell:
    """Return the example cell."""
    return load_cell(folder / "cell.yaml")


@pytest.fixture(scope="module")
def made(cell):
    """Return its plan with the pool."""
    return make_plan(cell, jobs=1)


@pytest.fixture(scope="module")
def plan(made) -> PlanResult:
    """Return its plan."""
    return made.plan


@pytest.mark.slow
def test_the_best_next_pose_leaves_least_variance_on_production(cell, made):
    measured, postures = measured_of(made.plan), postures_of(made.pool)
    found = best_additions(cell, postures, measured, 3)
    assert 1.0 > found.share[0] > found.share[1] > found.share[2] > 0.0
    chosen = {pose.candidate for pose in made.plan.poses}
    assert not chosen & set(found.order.tolist())
    others = np.setdiff1d(np.arange(len(postures)), found.order[:1])
    assert best_additions(cell, postures, measured, 1, others).share[0] >= found.share[0]


@pytest.mark.slow
def test_a_pose_that_needs_a_neighbour_gets_one_that_does_not_repeat_it(cell, made):
    measured, postures = measured_of(made.plan), postures_of(made.pool)
    found = best_additions(cell, postures, measured, 2, beside=measured[:1])
    reach = posture_reach(cell.robot)
    apart = np.max(np.abs(postures.q[found.order[0]] - measured[0]) / reach)
    assert 0.25 <= apart < 2.0


def test_no_more_poses_are_added_than_there_are(cell, made):
    with pytest.raises(PlanningError, match="999 more poses are wanted, and the pool has 14"):
        best_additions(cell, postures_of(made.pool), measured_of(made.plan), 999)


def test_a_plan_that_adds_to_measured_poses_has_none_of_them(cell, made):
    measured = measured_of(made.plan)
    more = make_plan(changed(cell, poses=3), jobs=1, variant=AddedTo(measured, measured[:1]))
    assert len(more.plan.poses) == 3
    assert more.plan.production is None
    assert 0.0 < more.share < 1.0
    ours = {pose.joints for pose in made.plan.poses}
    assert not ours & {pose.joints for pose in more.plan.poses}


def measured_of(plan: PlanResult) -> np.ndarray:
    """Return the postures of a plan."""
    return np.array([pose.joints for pose in plan.poses])


def changed(cell: Cell, **search) -> Cell:
    """Return the cell with another search."""
    model = cell.file.search.model_copy(update=search)
    return replace(cell, file=cell.file.model_copy(update={"search": model}))


@pytest.mark.slow
def test_the_process_of_an_example_is_the_one_that_is_simulated(cell, kind):
    courses = process_courses(kind, cell, 0, None)
    assert [name for name, _ in cell.process.courses] == [course.name for course in courses]
    q, force = (np.vstack([getattr(c, name) for c in courses]) for name in ("q", "force"))
    np.testing.assert_allclose(cell.process.joint_position, q, atol=1e-8)
    np.testing.assert_allclose(cell.process.force, force, atol=1e-3)


def test_six_poses_chosen_for_production_cover_it(plan):
    assert plan.search.name == "i_optimal"
    assert plan.production.coverage.covered >= ENOUGH
    assert not any("not covered" in finding for finding in plan.findings)
    assert "100% of" in dict(plan.facts())["production"]


@pytest.mark.slow
def test_a_plan_away_from_production_says_so_by_name(cell, kind, folder):
    """The rail is held where production never runs; the block is pressed on one side face."""
    text = (folder / "cell.yaml").read_text()
    away = {
        "afp": ("external: {rail: search}", 'external: {rail: ["-1.25 m"]}'),
        "machining": ('max: ["1 m", "1 m", "1 m"]', 'max: ["1 m", "-0.19 m", "1 m"]'),
    }[kind]
    assert away[0] in text
    path = folder / "away.yaml"
    path.write_text(text.replace(*away).replace("pool: 150", "pool: 60"))
    found = load_cell(path)
    if kind == "afp":
        # As production was planned before: without looking where it runs.
        blind = make_plan(replace(found, process=None), jobs=1).plan
        coverage = plan_coverage(cell, np.array([pose.joints for pose in blind.poses]))
    else:
        planned = make_plan(found, jobs=1).plan
        coverage = planned.production.coverage
        assert any(finding.startswith("production is not covered") for finding in planned.findings)
    assert not coverage.is_enough
    assert ("rail" if kind == "afp" else "joint_a") in coverage.sentence()


def test_the_error_to_expect_falls_with_every_pose(plan):
    errors = [each.error for each in plan.production.expected]
    assert errors == sorted(errors, reverse=True)
    assert plan.production.expected[-1].poses == 30
    assert errors == [each.noise for each in plan.production.expected]  # the floor is not known


@pytest.mark.slow
def test_a_wanted_accuracy_decides_the_number_of_poses(cell, plan):
    wanted = plan.production.expected_of(8).error
    found = make_plan(changed(cell, accuracy=1.1 * wanted, poses=None), jobs=1).plan.production
    assert 6 <= found.poses <= 10
    assert found.expected_of(found.poses).error <= 1.1 * wanted
    assert found.accuracy == 1.1 * wanted


def test_an_accuracy_out_of_reach_is_told_with_what_is_expected(cell):
    found = make_plan(changed(cell, accuracy=1e-6, poses=5), jobs=1).plan
    assert found.production.poses == 5
    assert any("search.accuracy) is not expected from 5 poses" in text for text in found.findings)


@pytest.mark.slow
def test_the_floor_of_the_model_is_no_better_for_more_poses(cell, plan):
    found = make_plan(changed(cell, floor=50e-6), jobs=1).plan.production
    assert all(each.error > 50e-6 for each in found.expected)
    assert found.expected[-1].error == pytest.approx(np.hypot(50e-6, found.expected[-1].noise))


def test_the_plan_file_keeps_what_was_promised(tmp_path, plan):
    write_plan(tmp_path, plan)
    assert read_plan(tmp_path).production == plan.production


def test_a_plan_of_before_the_first_uncovered_row_was_told_is_still_read(tmp_path, plan):
    write_plan(tmp_path, plan)
    path = tmp_path / "plan.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    assert data["production"]["coverage"].pop("first") == ""
    path.write_text(json.dumps(data), encoding="utf-8")
    assert read_plan(tmp_path).production == plan.production


def test_postures_near_production_are_nearer_than_their_reach(cell, plan):
    near = NearProduction.of(cell)
    assert near.distance(cell.process.joint_position[:5]) == pytest.approx(0.0, abs=1e-9)
    assert (near.distance(np.array([pose.joints for pose in plan.poses])) <= 1.0).all()


def test_missing_load_cases_are_named_with_amplitudes(cell, kind):
    loads = cell.file.load_cases.model_copy(update={"cases": ("normal",)})
    bare = replace(cell, file=cell.file.model_copy(update={"load_cases": loads}))
    texts = list(production_findings(bare, None))
    assert any("load case east is missing" in text and 'fy: "' in text for text in texts)
    assert not list(production_findings(cell, None))


def test_load_cases_that_are_too_small_come_with_larger_ones(cell):
    loads = cell.file.load_cases.model_copy(update={"fx": 100.0, "fy": 100.0, "fz": 300.0})
    weak = replace(cell, file=cell.file.model_copy(update={"load_cases": loads}))
    texts = " ".join(production_findings(weak, None))
    assert "ask for load_cases.fx and fy of" in texts
    assert "ask for load_cases.fz of" in texts


@pytest.mark.slow
def test_a_plan_of_fewer_poses_than_the_cell_says_is_still_a_plan_of_that_cell(folder, tmp_path):
    cell = folder / "cell.yaml"
    workflows.plan(cell, out=tmp_path / "plan", poses=5, compare="none", jobs=1)
    found = read_plan(tmp_path / "plan")
    assert len(found.poses) == 5
    assert found.time_of(10) == pytest.approx(2.0 * found.total_time)
    assert workflows.dry_run(cell, plan=tmp_path / "plan", out=tmp_path / "run").poses == 5


@pytest.mark.slow
def test_no_pose_is_left_to_a_station_that_cannot_be_registered(cell):
    """The block's second tilt to weigh the tool by is seen by a station that sees little else."""
    found = make_plan(changed(cell, poses=9), jobs=1).plan
    assert registration_shortages([pose.seen_by for pose in found.poses]) == {}
    assert found.production.coverage.is_enough
