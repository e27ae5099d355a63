"""Planted geometries are found again, to the noise, with blunders named and intervals that hold."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import xarray

from elastocal.errors import GeometryError
from elastocal.geometry import (
    GeometryModel,
    GeometryProblem,
    Payload,
    Positions,
    geometry_model,
    read_positions,
)
from elastocal.geometry.arm import ArmErrors, JointLoads, frames, motion_terms, point_motions
from elastocal.geometry.determined import told_apart
from elastocal.geometry.ladder import climb
from elastocal.geometry.positions import joint_loads
from elastocal.geometry.solve import fit, register
from elastocal.progress import silent
from elastocal.records import read_json
from elastocal.robot import GRAVITY, Robot, catalogue, with_joint_origins
from elastocal.units import split_column
from support.by_day import some_by_day
from support.cli import elastocal
from support.measured_arms import (
    ARMS,
    MARKERS,
    kuka,
    measure,
    universal,
    weight_torque,
    with_bearings,
    write_positions,
)

NOISE = 3e-5
FLOOR = NOISE * np.sqrt(8.0 / np.pi)
"""Mean distance of three coordinates of that noise."""


def ladder(measured, draws=100):
    problem = GeometryProblem(measured.robot, measured.data)
    return problem, climb(problem, draws, np.random.default_rng(1), silent)


@pytest.mark.slow
@pytest.mark.parametrize("error", [0.0, 0.05])
def test_motions_of_a_point_are_those_of_finite_differences(error):
    """Also of an arm with errors, which turn the axes of those behind them."""
    robot, rng, step = kuka(), np.random.default_rng(2), 1e-6
    q, torque = rng.uniform(-1.0, 1.0, (3, 6)), rng.normal(0.0, 1.0, (3, 6))
    loads = JointLoads(torque, rng.normal(0.0, 1.0, (3, 6, 3)), rng.normal(0.0, 1.0, (3, 6)))

    def place(errors):
        T = frames(robot, q, loads, errors).T_base_tcp
        return T[:, :3, 3] + T[:, :3, :3] @ np.array([0.1, 0.2, 0.3])

    motion = error * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    shapes = {"place": (6, 6), "motion": (6, 7), "bend": (6, 3), "sag": (6,)}
    sizes = {"place": error, "motion": motion, "bend": error, "sag": 0.0}
    nominal = ArmErrors(**{n: sizes[n] * rng.normal(size=shape) for n, shape in shapes.items()})
    at, terms, points = frames(robot, q, loads, nominal), motion_terms(q, torque), place(nominal)
    motions = point_motions(robot, at, terms, loads, points, np.arange(3))
    parts = np.split(np.stack([*motions], axis=2), [6, 13, 16], axis=-1)
    parts[-1] = parts[-1][..., 0]
    for which, columns in zip(shapes, parts, strict=True):
        for index in np.ndindex(*columns.shape[2:]):
            up, down = ({n: v.copy() for n, v in vars(nominal).items()} for _ in range(2))
            up[which][index] += step
            down[which][index] -= step
            slope = (place(ArmErrors(**up)) - place(ArmErrors(**down))) / (2.0 * step)
            assert np.allclose(columns[:, :, *index], slope, atol=1e-8)


def test_the_linearised_problem_is_that_of_finite_differences():
    """At the minimum: elsewhere residuals turn with their station."""
    measured = measure(universal(), 12, error=0.0, noise=0.0)
    problem, step = GeometryProblem(measured.robot, measured.data), 1e-6
    at = register(problem)
    derivatives = problem.linearise(at)[1]
    some_orders = range(problem.dense, len(problem.unknowns), 37)
    for unknown in (*range(problem.dense), *some_orders):
        one = np.zeros(len(problem.unknowns))
        one[unknown] = 1.0
        ends = (problem.residual(problem.moved(at, sign * step * one)) for sign in (1.0, -1.0))
        slope = -np.subtract(*ends) / (2.0 * step)
        assert np.allclose(derivatives.times(one), slope, rtol=1e-5, atol=1e-5), unknown


@pytest.mark.parametrize("arm", ARMS)
def test_a_planted_geometry_is_found_to_the_noise(arm):
    measured = measure(ARMS[arm](), 80, blunders=8)
    problem, found = ladder(measured)
    chosen = next(each for each in found.rungs if each.rung == found.chosen)
    assert found.chosen == "geometry"
    assert chosen.distance.mean() < 1.1 * FLOOR
    assert set(problem.row[~found.whole.fit.used].tolist()) == measured.blunders


@pytest.mark.parametrize(
    ("arm", "markers", "count"),
    [
        # 4 R + 6 of a fully measured end-effector (Everett, Driels and Mooring 1987), of which 6
        # are the base's and 6 the tool's; one marker shows three of the tool's alone, and then the
        # last joint's offset, two shifts and a turn are the marker's place.
        ("spherical wrist", 3, 4 * 6 - 6),
        ("parallel axes", 3, 4 * 6 - 6),
        ("seven axes", 3, 4 * 7 - 6),
        ("spherical wrist", 1, 4 * 6 - 6),
    ],
)
def test_as_many_errors_are_told_apart_as_theory_says(arm, markers, count):
    measured = measure(ARMS[arm](), 60, markers=markers, noise=0.0)
    problem = GeometryProblem(measured.robot, measured.data)
    derivatives = problem.linearise(register(problem))[1]
    free, fixed = told_apart(derivatives, problem, "geometry")
    arm_errors = [i for i in free if problem.unknowns[i].rung != "registration"]
    assert len(arm_errors) == count
    assert all(each.why.startswith(("as ", "moves no")) for each in fixed)
    assert any(" + " in each.why for each in fixed)


def test_sag_under_weight_and_payload_is_told_from_geometry():
    measured = measure(kuka(), 120, payloads=(0.0, 80.0), compliance=2e-7)
    problem, found = ladder(measured, draws=200)
    assert found.chosen == "weight"
    low, high = np.percentile(found.whole.draws, [2.5, 97.5], axis=0)
    names = [each.name for each in problem.unknowns]
    for joint in ("joint_a2", "joint_a3"):
        index = names.index(f"{joint}.compliance")
        assert 0.9 * low[index] < 2e-7 < 1.1 * high[index]
        assert abs(found.whole.values[index] - 2e-7) < 2e-8


@pytest.mark.parametrize("name", ["KR 210 R2700-2", "UR20"])
def test_loads_are_those_of_an_arm_whose_bearings_are_joints(name):
    """The axes' own by Pinocchio; all moments by an arm with a joint about each axis."""
    robot, rng = catalogue.load(name), np.random.default_rng(3)
    q, payload = rng.uniform(-1.0, 1.0, (5, 6)), np.array([0.0, 1.0, 2.0, 30.0, 80.0])
    unloaded = replace(Positions.unloaded(q, Payload()), payload=payload)
    found = joint_loads(robot, unloaded)
    bent = Robot.from_urdf(with_bearings(robot), robot.tip)
    every = np.zeros((5, 18))
    own = [bent.joint_names.index(each) for each in robot.joint_names]
    every[:, own] = q
    expected = weight_torque(bent, every, payload)
    assert np.allclose(found.torque, expected[:, own], rtol=0.0, atol=1e-4)
    across = np.abs(np.array([joint.axis for joint in robot.chain.joints])) < 0.5
    others = np.delete(expected, own, axis=1).reshape(5, 6, 2)
    assert np.allclose(found.moment[:, across].reshape(5, 6, 2), others, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "payload", "bearings"),
    some_by_day([("KR 210 R2700-2", 40.0, 1.5e-7), ("UR20", 10.0, 1e-6)]),
)
def test_bearings_that_bend_under_weight_and_payload_are_found(name, payload, bearings):
    planted = {"payloads": (0.0, payload), "compliance": 2.0 * bearings, "bearings": bearings}
    measured = measure(catalogue.load(name), 150, **planted)
    problem, found = ladder(measured, draws=200)
    assert found.chosen == "bearings"
    by_rung = {each.rung: each.distance.mean() for each in found.rungs}
    assert by_rung["bearings"] < 1.1 * FLOOR < 1.2 * FLOOR < by_rung["weight"]
    low, high = np.percentile(found.whole.draws, [2.5, 97.5], axis=0)
    names = [each.name for each in problem.unknowns]
    # What a second joint across the first bends by is not told from it on every arm.
    joint = problem.robot.joint_names[2]
    for index, size in (
        (names.index(f"{joint}.bend_x"), 1.0),
        (names.index(f"{joint}.compliance"), 2.0),
    ):
        assert low[index] < size * bearings < high[index]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "payload", "planted", "most"),
    some_by_day([("KR 210 R2700-2", 120.0, 6e-7, 2.5), ("UR20", 10.0, 4e-6, 1.2)]),
)
def test_an_arm_without_masses_sags_as_bars_do(name, payload, planted, most):
    """The truth has the masses of the catalogue, which the fit does not get."""
    full = catalogue.load(name)
    soft = {"compliance": planted, "bearings": 0.25 * planted}
    measured = measure(full, 150, payloads=(0.0, payload), **soft)
    bare = Robot.from_urdf(re.sub("(?s)<inertial>.*?</inertial>", "", full.urdf), full.tip)
    problem, found = ladder(replace(measured, robot=bare))
    by_rung = {each.rung: each.distance.mean() for each in found.rungs}
    assert by_rung["harmonics"] < most * FLOOR < 0.2 * by_rung["geometry"]
    model = geometry_model(problem, found, "test")
    assert "inertial" not in model.calibrated_urdf()
    assert "bars" in " ".join(model.findings)
    yields = {each.name: each for each in model.parameters if each.unit == "rad/(N*m)"}
    known = {name for name, each in yields.items() if each.known}
    assert known <= {f"{name}.compliance" for name in bare.joint_names}
    # What bars leave of the weight's course goes there, too, beyond its interval.
    compliance = yields[f"{bare.joint_names[2]}.compliance"]
    assert compliance.value == pytest.approx(planted, rel=0.2)
    off = np.linalg.norm(model.predict(measured.data) - measured.data.markers, axis=2)
    assert off.mean() < most * FLOOR


def test_a_payload_that_hardly_tells_the_sag_does_not_hold_up_the_fit():
    """Directions that are hardly told crept for hundreds of steps."""
    measured = measure(universal(), 300, noise=2.3e-4, markers=1, stations=1, payloads=(0.0, 1.0))
    assert ladder(measured)[1].chosen == "geometry"


def test_a_quarter_of_blunders_is_found():
    measured = measure(kuka(), 40, blunders=10, markers=1, stations=1)
    problem, found = ladder(measured)
    assert set(problem.row[~found.whole.fit.used].tolist()) == measured.blunders


def test_the_nominal_arm_is_kept_where_it_is_right():
    found = ladder(measure(kuka(), 60, error=0.0))[1]
    assert found.chosen == "registration"


def test_a_prediction_is_where_the_marker_will_be():
    """At poses and under a payload that the fit has not seen."""
    measured = measure(kuka(), 150, payloads=(0.0, 60.0, 30.0), compliance=2e-7)
    unseen = measured.data.payload == 30.0
    problem = GeometryProblem(measured.robot, measured.data.rows(~unseen))
    found = climb(problem, 40, np.random.default_rng(1), silent)
    model = geometry_model(problem, found, "test")
    held_out = measured.data.rows(unseen)
    distance = np.linalg.norm(model.predict(held_out) - held_out.markers, axis=2)
    assert distance.mean() < 1.15 * FLOOR


def test_the_calibrated_urdf_is_the_arm_as_built():
    measured = measure(universal(), 100, noise=0.0, compliance=0.0)
    problem, found = ladder(measured)
    model = geometry_model(problem, found, "test")
    robot = Robot.from_urdf(model.calibrated_urdf(), "tcp")
    q = measured.data.q[:20]
    ours, truth = _path(robot, q, model.markers[0]), _path(measured.truth, q, MARKERS[0])
    before = _path(measured.robot, q, MARKERS[0])
    # The base is where the stations of the fit say: shapes of paths are compared.
    assert _shape_error(ours, truth) < 1e-3 * _shape_error(before, truth)


def _path(robot: Robot, q: np.ndarray, marker: np.ndarray) -> np.ndarray:
    T = robot.forward(q)
    return T[:, :3, 3] + T[:, :3, :3] @ marker


def _shape_error(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest difference of the distances between all pairs of points."""
    apart = [np.linalg.norm(each[:, None] - each[None], axis=2) for each in (a, b)]
    return float(np.abs(apart[0] - apart[1]).max())


def test_with_joint_origins_moves_a_joint_in_its_own_frame():
    robot, T = kuka(), np.eye(4)
    T[:3, 3] = (0.0, 0.0, 0.1)
    moved = Robot.from_urdf(with_joint_origins(robot.urdf, {"joint_a4": T}), robot.tip)
    placement = robot.chain.joints[3].placement @ T
    assert np.allclose(moved.chain.joints[3].placement, placement, atol=1e-12)


@pytest.mark.slow
def test_the_command_writes_model_and_urdf_and_prints_the_contract(tmp_path):
    measured = measure(kuka(), 60, blunders=5)
    path = write_positions(tmp_path / "positions.csv", measured)
    arguments = ("--robot", "KR 210 R2700-2", "--tcp", measured.robot.tip, "--draws", 40)
    result = elastocal(
        *("geometry", path, *arguments, "--out", tmp_path / "model.json"),
        *("--urdf", tmp_path / "out.urdf", "--json"),
    )
    figures = json.loads(result.out)
    contract = {"held_out", "ladder", "parameters", "fixed", "blunders"}
    assert set(figures) == contract | {"axes", "iso_9283", "urdf", "with_blunders"}
    assert figures["held_out"]["chosen"]["mean"] < 1.2 * FLOOR
    assert figures["held_out"]["registration"]["mean"] > 5e-4
    assert set(figures["blunders"]) == measured.blunders
    assert {"name", "value", "unit", "low", "high", "known"} == set(figures["parameters"][0])
    model = read_json(tmp_path / "model.json", GeometryModel)
    assert model.positions == 180
    assert Robot.from_urdf((tmp_path / "out.urdf").read_text(), measured.robot.tip)
    shown = elastocal("geometry", path, *arguments, "--out", tmp_path / "model.json")
    assert "taken" in shown.err
    assert "left out as blunders" in shown.err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("[deg]", "[rad]"), "is it in degrees?"),
        (lambda text: text.replace("[mm]", "[m]"), "is it in mm?"),
        (lambda text: text.replace("marker1_x", "marker_q"), "no column 'marker_x"),
        (lambda text: text.replace("joint_a3[", "joint_b3["), "joint_a3"),
        (lambda text: "\n".join(text.splitlines()[:3]), "2 rows are too few"),
        (lambda text: "\n".join(text.splitlines()[:6]), "measure more poses"),
        (lambda text: text.replace("s0", "s0,", 1), "cells, the header"),
        (lambda text: text.replace("[mm]", ""), "it is written like 'marker1_x[mm]'"),
        (lambda text: text.replace("[deg]", "(deg)"), "it is written like 'joint_a1[deg]'"),
        (lambda text: text.replace("s0,0.0", "s0,-5", 1), "it must not be negative"),
        (lambda text: text.replace("s0,0.0", "s0,1e300", 1), "the largest mass is"),
        (
            lambda text: "\n".join([*text.splitlines()[:2]] + text.splitlines()[1:2] * 20),
            "one posture",
        ),
    ],
)
def test_bad_positions_are_refused_in_a_line(tmp_path, change, message):
    path = write_positions(tmp_path / "positions.csv", measure(kuka(), 30, markers=1))
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
    result = elastocal(
        *("geometry", path, "--robot", "KR 210 R2700-2", "--tcp", "flange"),
        *("--out", tmp_path / "model.json"),
    )
    assert message in result.reason
    assert not (tmp_path / "model.json").exists()


def test_columns_of_others_are_passed_over(tmp_path):
    path = write_positions(tmp_path / "positions.csv", measure(kuka(), 10))
    plain = read_positions(path, kuka())
    header, *rows = path.read_text(encoding="utf-8").splitlines()
    header = f",{header},,time,temperature[degC],remark"
    rows = [f"{n},{row},7,2024-01-01T10:00:00,,a b" for n, row in enumerate(rows)]
    path.write_text("\n".join([header, *rows]), encoding="utf-8-sig")
    assert np.array_equal(read_positions(path, kuka()).markers, plain.markers)


def test_positions_in_netcdf_are_those_of_the_table(tmp_path):
    measured = measure(kuka(), 20)
    measured.data.markers[3, 1] = np.nan
    path = write_positions(tmp_path / "positions.csv", measured)
    header, *rows = (line.split(",") for line in path.read_text(encoding="utf-8").splitlines())
    columns = {}
    for heading, cells in zip(header, zip(*rows, strict=True), strict=True):
        name, unit = split_column(heading)
        values = np.array(cells) if unit is None else np.array(cells, dtype=float)
        columns[name] = ("row", values, {} if unit is None else {"units": unit})
    xarray.Dataset(columns).to_netcdf(tmp_path / "positions.nc", engine="h5netcdf")
    table, twin = (read_positions(tmp_path / f"positions.{end}", kuka()) for end in ("csv", "nc"))
    for name, values in vars(table).items():
        if name != "lines":
            assert np.array_equal(values, getattr(twin, name), equal_nan=values.dtype == float), (
                name
            )


@pytest.mark.slow
def test_a_fit_of_nonsense_is_refused():
    measured = measure(kuka(), 60)
    rng = np.random.default_rng(5)
    measured.data.markers[:] = rng.uniform(-2.0, 2.0, measured.data.markers.shape)
    problem = GeometryProblem(measured.robot, measured.data)
    start = register(problem)
    free = told_apart(problem.linearise(start)[1], problem, "geometry")
    with pytest.raises(GeometryError, match="does not settle"):
        fit(problem, free, start)


def test_gravity_pulls_down():
    assert GRAVITY[2] < 0.0
