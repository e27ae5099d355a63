"""Planned positions can be measured, tell the arm's errors well, and lead to its geometry."""

import csv
import json
import re
from functools import cache

import numpy as np
import pytest

from elastocal.cell import Cell, load_cell, write_example
from elastocal.geometry import GeometryModel, PositionPlan, plan_positions
from elastocal.geometry.position_plan import _findings
from elastocal.planning import Postures, cell_surface, collision_scene, read_plan
from elastocal.planning.checks import SightCheck
from elastocal.records import read_json
from elastocal.robot import Robot, with_joint_origins
from support.cli import elastocal
from support.measured_arms import random_errors


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Cell:
    return load_cell(write_example(tmp_path_factory.mktemp("cell"), "machining")[0])


@cache
def planned(cell: Cell, search: str) -> PositionPlan:
    return plan_positions(cell, 24, search, seed=1)


@pytest.mark.slow
def test_a_station_sees_each_pose_and_nothing_collides(cell):
    plan = planned(cell, "i_optimal")
    q = np.array([pose.joints for pose in plan.poses])
    T, surface = cell.robot.forward(q), cell_surface(cell)
    sight = SightCheck.of(cell, surface)
    assert (sight.margin(Postures(T, T[:, :3, 2], q, q, np.arange(len(q)))) > 0.0).all()
    assert collision_scene(cell, surface).keeps(q, cell.file.limits.clearance).all()
    assert (cell.robot.limits.margin(q) >= cell.joint_margin).all()
    assert [pose.id for pose in plan.poses] == list(range(24))
    assert plan.moves[0].start is None
    assert plan.moves[-1].end is None


@pytest.mark.slow
def test_chosen_poses_predict_better_than_drawn_ones(cell):
    best, drawn = (planned(cell, name).expected[-1] for name in ("i_optimal", "random"))
    assert best.poses == drawn.poses == 24
    assert best.amplification < 0.8 * drawn.amplification


def test_more_poses_predict_better(cell):
    expected = planned(cell, "i_optimal").expected
    assert [each.poses for each in expected] == [6, 12, 24]
    assert expected[0].amplification > expected[1].amplification > expected[2].amplification


def test_the_filled_table_leads_to_the_geometry(tmp_path, cell):
    out = tmp_path / "plan"
    elastocal("plan", cell.path, "--for", "geometry", "--poses", 24, "--out", out)
    assert (out / "positions.src").is_file()
    checked = json.loads(elastocal("check", out / "positions.json", "--json").out)
    assert checked["poses"] == 24
    robot, rng = cell.robot, np.random.default_rng(3)
    errors = {name: random_errors(rng, 5e-4) for name in robot.joint_names}
    truth = Robot.from_urdf(with_joint_origins(robot.urdf, errors), robot.tip)
    table = out / "positions.csv"
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    heads = [head for head in rows[0] if head.startswith(("joint", "rail"))]
    scale = np.where(robot.revolute, np.pi / 180.0, 1e-3)
    q = scale * np.array([[float(row[head]) for head in heads] for row in rows])
    T = truth.forward(q)
    marker = T[:, :3, 3] + T[:, :3, :3] @ cell.file.marker.position_tcp
    seen = 1e3 * (marker + rng.normal(0.0, 3e-5, marker.shape))
    for row, point in zip(rows, seen, strict=True):
        row |= dict(zip((f"marker_{a}[mm]" for a in "xyz"), map(repr, point.tolist()), strict=True))
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (tmp_path / "arm.urdf").write_text(robot.urdf, encoding="utf-8")
    model = tmp_path / "geometry.json"
    arm = ("--robot", tmp_path / "arm.urdf", "--tcp", robot.tip, "--draws", 40)
    elastocal("geometry", table, *arm, "--out", model)
    found = read_json(model, GeometryModel)
    assert found.held_out.chosen.mean < 0.3 * found.held_out.registration.mean


def test_what_presses_alone_know_is_refused(tmp_path, cell):
    options = ("--for", "geometry", "--out", tmp_path / "plan")
    assert "are for presses" in elastocal("plan", cell.path, *options, "--dry-run").reason
    assert (
        "unknown search technique" in elastocal("plan", cell.path, *options, "--search", "x").reason
    )
    bare = "--search is for --for geometry"
    assert bare in elastocal("plan", cell.path, "--out", tmp_path / "p", "--search", "cover").reason


def test_too_few_poses_are_said_to_be_few():
    (found,) = _findings(6, 42)
    assert "6 poses give 18 coordinates for 42 errors of the arm: plan" in found
    assert _findings(found.values["least"], 42) == ()


@pytest.mark.slow
def test_one_campaign_has_presses_and_positions_in_one_program(tmp_path, cell):
    out = tmp_path / "plan"
    both = ("plan", cell.path, "--for", "both", "--poses", 4, "--positions", 8, "--compare", "none")
    figures = json.loads(elastocal(*both, "--out", out, "--json").out)
    assert (figures["poses"], figures["positions"]) == (4, 8)
    assert figures["time"]["positions"] > 0.0
    assert {"plan.json", "positions.json", "positions.csv", "calib.src"} <= set(figures["files"])
    assert not (out / "positions.src").exists()
    presses = read_plan(out)
    positions = read_json(out / "positions.json", PositionPlan)
    assert positions.cell.fingerprint == presses.cell.fingerprint
    program = (out / "calib.src").read_text(encoding="ascii", errors="replace")
    stops = re.findall(r"PTP (XAPP|XPOS)(\d+)", program)
    assert stops == [("XAPP", str(n)) for n in range(4)] + [("XPOS", str(n)) for n in range(8)]
    targets = re.findall(r"DECL E6AXIS (\w+)", (out / "calib.dat").read_text(encoding="ascii"))
    assert len(targets) == len(set(targets))
    assert program.rstrip().splitlines()[-2].strip().startswith("PTP XHOME")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--positions", 8), "--positions is for --for both"),
        (("--for", "both", "--dry-run"), "--dry-run shows presses alone"),
        (("--for", "both", "--search", "cover"), "--search is for --for geometry"),
    ],
)
def test_options_of_one_campaign_that_contradict_are_refused(tmp_path, cell, options, message):
    assert message in elastocal("plan", cell.path, "--out", tmp_path / "plan", *options).reason
    assert not (tmp_path / "plan").exists()


@pytest.mark.slow
def test_it_says_how_many_poses_functions_of_each_joint_need(cell):
    """With 24 poses every joint's function is mostly a guess, with 48 it is less of one."""
    few = planned(cell, "random").functions
    more = plan_positions(cell, 48, "random", seed=1).functions
    assert [(each.joint, each.orders) for each in few[:3]] == [
        ("joint_a1", 10), ("joint_a1", 20), ("joint_a1", 40)
    ]  # fmt: skip
    for before, after in zip(few, more, strict=True):
        assert 1.0 > before.unknown > after.unknown > 0.0
        assert before.poses % 100 == 0
    assert all(each.unknown > 0.33 for each in few)
