"""A URDF and a table carry what they can express, refitted: never worse than the arm as drawn."""

import json

import numpy as np
import pytest

from elastocal.geometry import (
    GeometryModel,
    GeometryProblem,
    geometry_model,
    link_table,
)
from elastocal.geometry.ladder import climb
from elastocal.geometry.problem import RUNGS
from elastocal.geometry.solve import register
from elastocal.progress import silent
from elastocal.records import read_json
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.cli import elastocal
from support.measured_arms import (
    ARMS,
    Measured,
    kuka,
    measure,
    rounded,
    seven_axes,
    universal,
    write_positions,
)


def nominal_and_written(measured: Measured, rows: int) -> tuple[float, float, GeometryModel]:
    """Return the errors of the arm as drawn and of its URDF at rows that no fit saw, in m.

    Frames and markers of either are those that suit the unseen rows.
    """
    seen = np.arange(len(measured.data)) < rows
    problem = GeometryProblem(measured.robot, measured.data.rows(seen))
    found = climb(problem, 40, np.random.default_rng(1), silent)
    model = geometry_model(problem, found, "test")
    written = Robot.from_urdf(model.calibrated_urdf(), measured.robot.tip)
    unseen = measured.data.rows(~seen)
    problems = (GeometryProblem(each, unseen) for each in (measured.robot, written))
    nominal, ours = (
        float(np.linalg.norm(each.residual(register(each)), axis=1).mean()) for each in problems
    )
    return nominal, ours, model


def planted(seed: int) -> Measured:
    """Return an arm of any kind whose gears are as bad as its places, in any amount of poses."""
    rng = np.random.default_rng(seed)
    arm = (kuka, universal, seven_axes, lambda: rounded("1.5708"))[seed % 4]()
    return measure(
        arm, int(rng.choice([40, 60, 120])) + 200, seed=seed, markers=int(rng.choice([1, 3])),
        stations=1, error=float(rng.choice([1e-4, 3e-4, 1e-3])), noise=5e-5,
        gears=float(rng.choice([0.0, 3e-4, 1e-3])), span=float(rng.choice([0.0, 0.5])),
        compliance=float(rng.choice([0.0, 2e-7])), payloads=(0.0, 5.0),
    )  # fmt: skip


def hold_the_law(seed: int) -> float:
    """Return the written error as a part of the nominal one, after holding the law."""
    measured = planted(seed)
    nominal, written, model = nominal_and_written(measured, len(measured.data) - 200)
    stated = {each.rung: each.held_out.mean for each in model.ladder}
    chain = model.chain
    assert chain.held_out.mean <= stated["registration"]
    assert chain.held_out.mean <= 1.1 * stated["geometry"]
    # What left-out poses say holds at unseen ones as far as some dozens of poses can say.
    assert written < 1.05 * nominal
    return written / nominal


@pytest.mark.parametrize("seed", some_by_day(range(12)))
def test_a_written_arm_is_never_worse_than_the_nominal_one(seed):
    hold_the_law(seed)


@pytest.mark.slow
def test_two_hundred_written_arms_are_never_worse_than_the_nominal_ones():
    parts = np.array([hold_the_law(seed) for seed in range(200)])
    print(f"written / nominal: median {np.median(parts):.2f}, worst {parts.max():.2f}")


@pytest.mark.parametrize("arm", some_by_day(ARMS))
def test_an_arm_whose_gears_are_bad_is_written_without_what_they_stood_in_for(arm):
    """In a narrow range shifts, zeros and harmonics stand in for one another."""
    measured = measure(
        ARMS[arm](), 500, markers=1, stations=1, error=3e-4, noise=5e-5, gears=1e-3, span=0.6
    )
    nominal, written, model = nominal_and_written(measured, 300)
    # Gears of three times what the prior of twice a turn expects are functions of the joint, too.
    assert next(each.rung for each in model.ladder if each.chosen) in RUNGS[-2:]
    assert model.chain.rung in ("offsets", "geometry")
    assert written < nominal
    assert written == pytest.approx(model.chain.held_out.mean, rel=0.15)


def test_the_table_is_of_the_arm_in_the_urdf():
    measured = measure(kuka(), 300, markers=1, stations=1, error=3e-4, gears=1e-3, span=0.6)
    problem = GeometryProblem(measured.robot, measured.data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    a2 = next(r for r in link_table(problem, found) if (r.joint, r.number) == ("joint_a2", "a"))
    assert found.chosen == "harmonics"
    written = Robot.from_urdf(
        geometry_model(problem, found, "test").calibrated_urdf(), measured.robot.tip
    )
    lines = [
        (T[:3, 3], T[:3, :3] @ joint.axis)
        for joint, T in zip(written.chain.joints, _at_zero(written), strict=True)
    ]
    (p, u), (q, v) = lines[1], lines[2]
    apart = q - p - u * ((q - p) @ u)
    assert np.linalg.norm(np.cross(u, v)) < 0.01
    assert a2.calibrated == pytest.approx(np.linalg.norm(apart), abs=1e-4)
    assert abs(a2.calibrated - a2.nominal) > 2e-5


def _at_zero(robot: Robot) -> list[np.ndarray]:
    T, found = np.eye(4), []
    for joint in robot.chain.joints:
        T = T @ joint.placement
        found.append(T)
    return found


def test_the_command_states_the_error_of_the_urdf_and_refuses_one_that_says_nothing(tmp_path):
    measured = measure(kuka(), 120, error=3e-4, noise=5e-5, gears=5e-4, stations=1)
    path = write_positions(tmp_path / "positions.csv", measured)
    arm = ("--robot", "KR 210 R2700-2", "--tcp", "flange", "--draws", 40)
    out = ("--out", tmp_path / "model.json", "--urdf", tmp_path / "out.urdf", "--json")
    figures = json.loads(elastocal("geometry", path, *arm, *out).out)
    by_rung = {each["rung"]: each["held_out"] for each in figures["ladder"]}
    assert figures["urdf"] == by_rung["geometry"]
    assert figures["held_out"]["chosen"] == by_rung["harmonics"]
    mean = f"{1e3 * figures['urdf']['mean']:.3f}"
    assert f"{mean} mm mean error at poses left out" in (tmp_path / "out.urdf").read_text()
    assert read_json(tmp_path / "model.json", GeometryModel).chain.rung == "geometry"
    pure = measure(kuka(), 30, error=0.0, gears=1e-4, stations=1)
    write_positions(path, pure)
    refused = elastocal("geometry", path, *arm, *out)
    assert "--urdf and --table express places and zeros" in refused.reason
