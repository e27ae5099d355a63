"""Functions of each joint: found where an arm has them, and only there."""

import json
from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.geometry import (
    AngleCheck,
    GeometryModel,
    GeometryProblem,
    errors_at,
    geometry_model,
    read_geometry,
)
from elastocal.geometry.arm import ArmErrors, JointLoads, motion_terms, series, waves
from elastocal.geometry.joint_functions import (
    REACH,
    JointFunction,
    beyond_low_orders,
    measured_ranges,
)
from elastocal.geometry.ladder import climb, joint_regions
from elastocal.geometry.solve import register
from elastocal.progress import silent
from elastocal.records import write_json
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.measured_arms import (
    Measured,
    kuka,
    measure,
    planted_functions,
    seven_axes,
    universal,
)

FUNCTIONS, NOISE = 2.5e-4, 5e-5
FLOOR = NOISE * np.sqrt(8.0 / np.pi)
"""Mean distance of the noise."""
PLANTED = {"error": 3e-4, "noise": NOISE, "markers": 1, "stations": 1, "gears": 1e-4}


NONE = np.zeros(2)
FUNCTION = JointFunction("j", NONE, NONE, NONE, NONE, 8, 0.0, known=True)


def fitted(measured: Measured, rows: np.ndarray | None = None) -> GeometryModel:
    data = measured.data if rows is None else measured.data.rows(rows)
    problem = GeometryProblem(measured.robot, data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    return geometry_model(problem, found, "test")


def rung(model: GeometryModel) -> str:
    return next(each.rung for each in model.ladder if each.chosen)


@pytest.fixture(scope="module")
def measured() -> Measured:
    return measure(universal(), 700, functions=FUNCTIONS, seed=3, **PLANTED)


@pytest.fixture(scope="module")
def model(measured) -> GeometryModel:
    return fitted(measured, np.arange(700) < 500)


def test_the_series_is_evaluated_as_it_is_written():
    rng = np.random.default_rng(0)
    q, terms = rng.uniform(-6.0, 6.0, (9, 3)), rng.normal(size=(3, 38, 2))
    orders = np.arange(3, 41)
    sines, cosines = np.sin(q[..., None] * orders), np.cos(q[..., None] * orders)
    expected = (sines * terms[:, :, 0] + cosines * terms[:, :, 1]).sum(axis=2)
    assert np.allclose(series(q, terms, 3), expected, rtol=0.0, atol=1e-11)
    by_waves = np.einsum("pjk,jk->pj", waves(q, 3, 40), terms.reshape(3, -1))
    assert np.allclose(by_waves, expected, rtol=0.0, atol=1e-11)


def test_two_orders_are_one_case_of_many():
    rng = np.random.default_rng(0)
    q, torque, motion = rng.normal(size=(5, 2)), rng.normal(size=(5, 2)), rng.normal(size=(2, 7))
    errors = replace(ArmErrors.none(2), motion=motion)
    loads = replace(JointLoads.none(q), torque=torque)
    expected = q + np.einsum("pjm,jm->pj", motion_terms(q, torque), motion)
    assert np.allclose(errors.moved(q, loads), expected, rtol=0.0, atol=1e-13)
    longer = errors.up_to(40)
    assert longer.motion.shape == (2, 83)
    assert np.array_equal(longer.moved(q, loads), errors.moved(q, loads))
    assert np.array_equal(longer.shortest().motion, motion)


def test_the_normal_equations_are_those_of_all_columns():
    """Several markers a row, weights, sizes; no column of the series is written out."""
    data = measure(kuka(), 7, markers=3).data
    problem = GeometryProblem(kuka(), data)
    residual, derivatives = problem.linearise(register(problem))
    unknowns = len(problem.unknowns)
    J = np.stack([derivatives.times(one) for one in np.eye(unknowns)], axis=2)
    weight = np.random.default_rng(0).uniform(0.0, 1.0, len(problem))
    size = np.array([each.size for each in problem.unknowns])
    free = np.concatenate([[3, 20, 17], np.arange(problem.dense, unknowns)])
    points = np.arange(2, 19)
    A, w = (J * size)[points][:, :, free], weight[points]
    G, h = derivatives.normal(residual, weight, size, free, points)
    scale = np.abs(G).max()
    assert np.allclose(G, np.einsum("nai,n,naj->ij", A, w, A), rtol=0.0, atol=1e-12 * scale)
    expected = np.einsum("nai,n,na->i", A, w, residual[points])
    assert np.allclose(h, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_planted_functions_are_found_to_the_noise(model, measured):
    unseen = measured.data.rows(np.arange(700) >= 500)
    assert rung(model) == "joint-functions"
    by_rung = {each.rung: each for each in model.ladder}
    best = by_rung["joint-functions"]
    for figures in (best.held_out, best.regions):
        assert figures.mean < 1.6 * FLOOR
        assert figures.mean < 0.6 * by_rung["harmonics"].held_out.mean
    off = np.linalg.norm(model.predict(unseen) - unseen.markers, axis=2)
    assert off.mean() == pytest.approx(best.held_out.mean, rel=0.15)


def test_bands_hold_the_planted_functions(model, measured):
    held = []
    for number, each in enumerate(model.functions):
        if each.known:
            q = np.zeros((len(each.angle), 6))
            q[:, number] = each.angle
            truth = planted_functions(q, FUNCTIONS, 3)[:, [number]]
            truth = beyond_low_orders(each.angle, truth)[:, 0]
            held.append((each.low <= truth) & (truth <= each.high))
            assert each.largest == pytest.approx(np.abs(truth).max(), rel=0.5)
            assert 8 <= each.order <= 30
    assert len(held) >= 4
    assert 0.9 < np.concatenate(held).mean() < 0.999


def test_another_day_needs_frame_and_marker_alone(model, measured):
    seen, unseen = (measured.data.rows(rows) for rows in (np.arange(500), np.arange(500, 700)))
    later = replace(
        unseen, campaign=np.full(200, "later"), station=np.full(200, "t"),
        markers=unseen.markers + np.array([0.3, 0.0, -0.1]),
    )  # fmt: skip
    assert errors_at(model, seen, later).mean() < 1.7 * FLOOR


def test_the_file_keeps_them_and_older_files_are_read(model, tmp_path):
    path = tmp_path / "model.json"
    write_json(path, model)
    again = read_geometry(path)
    assert np.array_equal(again.motion, model.motion)
    assert again.functions[0].order == model.functions[0].order
    data = json.loads(path.read_text(encoding="utf-8"))
    data["motion"] = [row[:6] + row[-1:] for row in data["motion"]]
    del data["functions"]
    data["schema"] = "elastocal.geometry/3"
    path.write_text(json.dumps(data), encoding="utf-8")
    assert read_geometry(path).motion.shape == (6, 7)
    for bad, shape in (([row[:6] for row in data["motion"]], r"\(6, 6\)"), ([1.0, 2.0], r"\(2,\)")):
        path.write_text(json.dumps(data | {"motion": bad}), encoding="utf-8")
        with pytest.raises(SchemaError, match=rf"motion has shape {shape}, not \(6, 7\)"):
            read_geometry(path)


def test_ranges_are_what_lies_near_measured_angles():
    rng = np.random.default_rng(0)
    asked = np.linspace(-10.0, 10.0, 4001)
    for count in (1, 2, 5, 30, 400):
        angle = rng.uniform(-7.0, 7.0, count)
        apart = np.abs((asked[:, None] - angle + np.pi) % (2.0 * np.pi) - np.pi).min(axis=1)
        clear = np.abs(apart - REACH) > 1e-9
        known = replace(FUNCTION, measured=measured_ranges(angle))
        assert np.array_equal(known.holds(asked)[clear], (apart < REACH)[clear])
    assert measured_ranges(np.linspace(-3.1, 3.1, 90)) == ((-np.pi, np.pi),)
    assert measured_ranges(np.array([3.1, -3.1]))[0][1] > np.pi


@pytest.mark.slow
def test_where_no_angle_was_measured_errors_are_larger_and_that_is_said(measured):
    """Joint 2 is measured on one side of a half turn, and used on the other, too."""
    known, asked = measured.data.rows(np.arange(500)), measured.data.rows(np.arange(500, 700))
    model = fitted(measured, np.flatnonzero(measured.data.q[:500, 1] < 0.5))
    assert rung(model) == "joint-functions"
    check = AngleCheck(model.functions, measured.robot.joint_names)
    check.add(known.rows(known.q[:, 1] < 0.5).q)
    assert check.findings() == ()
    check.add(asked.q)
    beyond = ~model.functions[1].holds(asked.q[:, 1])
    (found,) = check.findings()
    last = known.q[known.q[:, 1] < 0.5, 1].max()
    assert found.values["rows"] == beyond.sum() == (asked.q[:, 1] > last + REACH).sum()
    assert "j2 at " in found
    assert "j1 at " not in found
    assert f"; j2 -119 to {np.degrees(last + REACH):.0f}; " in check.ranges
    off = np.linalg.norm(model.predict(asked) - asked.markers, axis=2)[:, 0]
    assert off[beyond].mean() > 1.25 * off[~beyond].mean()


def test_a_whole_turn_of_a_joint_changes_nothing(model, measured):
    """A scale would: measured over one turn it is what sines leave of a straight line."""
    data = measured.data.rows(np.arange(5))
    turned = replace(data, q=data.q + 2.0 * np.pi * np.array([1, 0, -1, 0, 2, -2]))
    assert np.allclose(model.predict(turned), model.predict(data), rtol=0.0, atol=1e-12)
    assert not [each.name for each in model.parameters if each.name.endswith("scale")]


def test_a_urdf_does_without_them(model):
    assert model.chain.rung in ("offsets", "geometry")
    assert model.chain.held_out.mean < model.held_out.registration.mean


@pytest.mark.slow
@pytest.mark.parametrize("arm", some_by_day([kuka, seven_axes]))
def test_no_functions_are_found_where_there_are_none(arm):
    chosen = [rung(fitted(measure(arm(), 150, seed=seed, **PLANTED))) for seed in range(2)]
    assert "joint-functions" not in chosen


def test_what_only_neighbours_show_is_no_function_of_a_joint():
    """A bump of joint space, as heat or another cell leaves it: left-out regions do not see it."""
    measured = measure(kuka(), 400, seed=1, **PLANTED)
    q = measured.data.q
    bump = 5e-4 * np.sin(3.0 * q[:, 0]) * np.sin(4.0 * q[:, 1]) * np.cos(3.0 * q[:, 2])
    data = replace(measured.data, markers=measured.data.markers + bump[:, None, None])
    assert rung(fitted(replace(measured, data=data))) != "joint-functions"


def test_an_arm_of_linear_axes_has_none():
    links = "".join(f'<link name="l{n}"/>' for n in range(4))
    axes = "".join(
        f'<joint name="j{n}" type="prismatic"><parent link="l{n}"/><child link="l{n + 1}"/>'
        f'<origin xyz="0.1 0 0.2"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" effort="0" velocity="0"/></joint>'
        for n, axis in enumerate(("1 0 0", "0 1 0", "0 0 1"))
    )
    gantry = Robot.from_urdf(f'<robot name="gantry">{links}{axes}</robot>', "l3")
    model = fitted(measure(gantry, 40, noise=NOISE, error=3e-4))
    assert rung(model) != "joint-functions"
    assert model.motion.shape == (3, 7)


def test_regions_are_whole_poses_and_far_apart():
    data = measure(universal(), 64, markers=3).data
    problem = GeometryProblem(universal(), replace(data, pose=np.arange(64) // 2))
    region = joint_regions(problem)
    assert set(region.tolist()) == set(range(8))
    for pose in range(32):
        assert len(set(region[problem.data.pose[problem.row] == pose].tolist())) == 1
