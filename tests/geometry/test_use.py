"""A path corrected with the geometry of its arm: the tool comes to where it is programmed."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.cell import Cell, load_cell
from elastocal.compensation.offline import PathCorrection, correct_rows
from elastocal.dataset import PathTable, find_columns
from elastocal.errors import GeometryError, PathError
from elastocal.geometry import GeometryModel, GeometryProblem, Payload, Positions, geometry_model
from elastocal.geometry.joint_functions import JointFunction
from elastocal.geometry.ladder import climb
from elastocal.geometry.solve import register
from elastocal.identification import read_model, write_model
from elastocal.progress import silent
from elastocal.records import write_json
from elastocal.robot import Robot, catalogue, with_tool
from elastocal.robot.inverse import inverse_for
from elastocal.sim.workcell import ProcessCell, SimulatedCell
from support.cli import elastocal
from support.compensated import calibrated
from support.demos import finished_demo
from support.measured_arms import MARKERS, Measured, measure, weight_torque, write_positions
from support.summaries import made_up_summary


def kuka() -> Robot:
    return catalogue.load("KR 210 R2700-2")


def fitted(measured: Measured, markers: np.ndarray | None = None) -> GeometryModel:
    problem = GeometryProblem(measured.robot, measured.data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    return geometry_model(problem, found, "test", markers)


def station_error(measured: Measured, model: GeometryModel, real, programmed) -> np.ndarray:
    """Return how far points are from where the tracker was told they are, shape (row,), in m."""
    T, own = measured.T_station_base[0], model.stations["s0"]
    seen = T[:3, 3] + real @ T[:3, :3].T
    return np.linalg.norm((seen - own[:3, 3]) @ own[:3, :3] - programmed, axis=1)


@pytest.mark.slow
def test_the_corrected_tool_stands_where_it_is_programmed():
    """Of an arm that was measured without noise, with nothing pressing on it."""
    measured = measure(kuka(), 100, noise=0.0)
    model, robot = fitted(measured, MARKERS), measured.robot
    q = np.array([0.0, -1.0, 1.0, 0.3, 0.6, 0.0]) + 0.3 * measured.data.q[:10]
    T, nothing = robot.forward(q), np.zeros((10, 3))
    found = correct_rows(
        inverse_for(robot), calibrated(robot), q, T, (nothing, None), str,
        unloaded=model.tool_of(robot),
    )  # fmt: skip
    programmed = T[:, :3, 3]
    before = station_error(measured, model, measured.truth.forward(q)[:, :3, 3], programmed)
    real = measured.truth.forward(found.q)[:, :3, 3]
    assert station_error(measured, model, real, programmed).max() < 1e-4 * before.mean()
    assert np.allclose(found.T_base_tcp[:, :3, :3], T[:, :3, :3], atol=1e-8)
    assert found.residual.max() < 2e-9
    assert np.linalg.norm(found.uncorrected, axis=1).mean() > 1e-4


@pytest.mark.slow
def test_a_tool_behind_the_measured_tcp_is_the_same_arm():
    measured = measure(kuka(), 60, noise=0.0)
    model, X = fitted(measured, MARKERS), np.eye(4)
    X[:3, :3] = Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_matrix()
    X[:3, 3] = (0.05, -0.02, 0.4)
    robot, q = measured.robot, measured.data.q[:5]
    longer = Robot.from_urdf(with_tool(robot.urdf, robot.tip, "long", X), "long")
    real = (measured.truth.forward(q) @ X)[:, :3, 3]
    assert station_error(measured, model, real, model.tool_of(longer)(q)).max() < 1e-6


def test_known_places_of_the_markers_show_an_error_of_the_tcp():
    shift = np.array([1e-3, -5e-4, 2e-4])
    measured = measure(kuka(), 80, error=0.0)
    T_tcp_built = fitted(measured, MARKERS - shift).T_tcp_built
    assert np.allclose(T_tcp_built[:3, 3], shift, atol=5e-5)
    assert fitted(measured).T_tcp_built is None
    with pytest.raises(GeometryError, match="places of 1 marker are given, positions are of 3"):
        fitted(measured, MARKERS[:1])


def test_a_payload_sags_the_tool():
    measured = measure(kuka(), 120, payloads=(0.0, 80.0), compliance=2e-7)
    model, q = fitted(measured), np.array([[0.0, -0.5, 0.8, 0.0, 0.6, 0.0]])
    bare, heavy = (model.tool_of(measured.robot, Payload(mass))(q)[0] for mass in (0.0, 80.0))
    bare_truth, heavy_truth = (
        measured.truth.forward(q + 2e-7 * weight_torque(kuka(), q, np.array([mass])))[0, :3, 3]
        for mass in (0.0, 80.0)
    )
    assert np.allclose(heavy - bare, heavy_truth - bare_truth, atol=5e-5)
    assert (heavy - bare)[2] < -1e-3


@pytest.mark.parametrize(
    ("other", "message"),
    [("KR 210 R3100-2", "it is not the same way"), ("KR 210 R2700-2", None)],
)
def test_the_geometry_of_another_arm_is_refused(other, message):
    model = fitted(measure(kuka(), 60))
    if message is None:
        assert model.tool_of(catalogue.load(other))
        return
    with pytest.raises(GeometryError, match=message):
        model.tool_of(catalogue.load(other))


def test_predict_and_compensate_take_the_geometry(tmp_path):
    measured = measure(kuka(), 60)
    robot, positions = measured.robot, write_positions(tmp_path / "positions.csv", measured)
    geometry, model = tmp_path / "geometry.json", tmp_path / "model.json"
    where = [f"{x}, {y}, {z}" for x, y, z in (tuple(f"{v} m" for v in m) for m in MARKERS)]
    markers = [part for each in where for part in ("--marker", each)]
    arm = ("--robot", "KR 210 R2700-2", "--tcp", robot.tip, "--draws", 40)
    shown = elastocal("geometry", positions, *arm, *markers, "--out", geometry)
    assert "mm from where it is described" in shown.err
    write_model(model, calibrated(robot), made_up_summary())
    names = [f"{name}[rad]" for name in robot.joint_names]
    heads = ",".join([*names, *(f"force_{axis}[N]" for axis in "xyz")])
    rows = tmp_path / "rows.csv"
    rows.write_text(f"{heads}\n0,-1,1,0,0.5,0,0,0,-500\n", encoding="utf-8")
    built = ("--geometry", geometry, "--payload", "80 kg", "--payload-centre", "0 m, 0 m, 0.2 m")
    elastocal("predict", model, rows, "--out", tmp_path / "out.csv", *built)
    heading, values = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    error = dict(zip(heading.split(","), values.split(","), strict=True))
    assert 1e-5 < abs(float(error["arm_error_x[m]"])) < 1e-2
    told = [
        json.loads(elastocal("compensate", model, rows, *more, "--json").out)
        for more in (("--out", tmp_path / "a.csv"), ("--out", tmp_path / "b.csv", *built))
    ]
    assert "deviations hold the errors of the arm as built" in told[1]["notes"][0]
    assert abs(told[1]["deviation"]["mean"] - told[0]["deviation"]["mean"]) > 1e-5
    lone = elastocal("compensate", model, rows, "--out", tmp_path / "c.csv", "--payload", "1 kg")
    assert "give --geometry" in lone.reason
    notes = json.loads(elastocal("export", model, "--c", tmp_path / "c", *built, "--json").out)
    assert any("elastocal_arm_error" in note for note in notes["notes"])
    header = (tmp_path / "c" / "elastocal_model.h").read_text(encoding="utf-8")
    assert "void elastocal_arm_error(const double q[], double error[3]);" in header


def test_angles_that_no_function_was_measured_at_are_named_by_every_command(tmp_path):
    measured = measure(kuka(), 30)
    robot, geometry, model = measured.robot, tmp_path / "geometry.json", tmp_path / "model.json"
    joint, none = robot.joint_names[1], np.zeros(2)
    function = JointFunction(joint, none, none, none, none, 8, 0.0, True, ((-0.5, 0.5),))
    write_json(geometry, replace(fitted(measured), functions=(function,)))
    write_model(model, calibrated(robot), made_up_summary())
    names = [f"{name}[rad]" for name in robot.joint_names]
    heads = ",".join([*names, *(f"force_{axis}[N]" for axis in "xyz")])
    rows, loaded = tmp_path / "rows.csv", "1,0,0.5,0,0,0,-500"
    rows.write_text(f"{heads}\n0,-1,{loaded}\n0,-0.4,{loaded}\n0,-0.9,{loaded}\n", "utf-8")
    out = tmp_path / "out.csv"
    for command in ("predict", "compensate"):
        told = elastocal(command, model, rows, "--out", out, "--geometry", geometry, "--json")
        assert told.code == 0, told.err
        (note,) = [each for each in json.loads(told.out)["notes"] if "its function" in each]
        assert note.startswith("2 rows of 3 have a joint where no position was measured within 4.5")
        assert f"({joint} at -57 to -52 deg)" in note
        out.unlink()
    foreign = tmp_path / "foreign.json"
    write_model(foreign, calibrated(catalogue.load("UR20")))
    refused = elastocal("predict", foreign, rows, "--out", out, "--geometry", geometry)
    assert "the geometry is of an arm with the joints" in refused.reason
    told = elastocal("export", model, "--c", tmp_path / "c", "--geometry", geometry, "--json")
    assert any(f"{joint} -29 to 29 deg" in note for note in json.loads(told.out)["notes"])


@pytest.mark.parametrize("largest", [0.0, 0.15, 0.5])
def test_the_limit_holds_for_deflection_and_geometry_together(largest):
    """A geometry of which half is nonsense, as a fit of mistaken positions is."""
    measured = measure(kuka(), 40, noise=0.0)
    model, robot = fitted(measured), measured.robot
    q = np.array([[0.0, -1.0, 1.0, 0.3, 0.6, 0.0]])
    load = (np.array([[0.0, 0.0, -500.0]]), None)
    truth = model.tool_of(robot)

    def nonsense(q: np.ndarray) -> np.ndarray:
        return truth(q) + np.array([0.2, 0.0, 0.0])

    def corrected() -> PathCorrection:
        return correct_rows(
            inverse_for(robot), calibrated(robot), q, robot.forward(q), load, str,
            largest=max(largest, 0.02), unloaded=nonsense,
        )  # fmt: skip

    if largest == 0.5:
        shift = np.linalg.norm(corrected().T_base_tcp[0, :3, 3] - robot.forward(q)[0, :3, 3])
        assert shift < largest
        return
    with pytest.raises(PathError, match=r"a correction of 20.* mm is above the limit"):
        corrected()


@pytest.mark.slow
def test_the_absolute_error_of_a_process_path_falls_by_nine_tenths():
    """Fibre placement on the simulated cell, typical preset, seed 0; geometry from 120 free poses.

    Before: the nominal arm, its base where it fits the free poses best, without correction.
    """
    demo = finished_demo("afp")
    cell, elastic = load_cell(demo / "cell.yaml"), read_model(demo / "model.json")
    robot = elastic.model.robot
    path = demo / "process" / "path.csv"
    rows = PathTable.open(path, lambda header: find_columns(header, robot)).rows()
    some = slice(None, None, 4)
    q, course = rows.joints[some], np.array(rows.names("course"))[some]
    T = robot.forward(q)
    force = rows.wrench_in_base(robot.forward(rows.joints))[0][some]
    measured, markers = _free_positions(cell, q)
    model = fitted(measured, markers)
    start = register(GeometryProblem(robot, measured.data))
    nominal = replace(model, stations={"s0": start.T_station_base[0]})
    corrected, solver, built = q.copy(), inverse_for(robot), model.tool_of(robot)
    for name in dict.fromkeys(course.tolist()):
        own = course == name
        load = (force[own], None)
        corrected[own] = correct_rows(solver, elastic, q[own], T[own], load, str, unloaded=built).q
    before, after = (
        station_error(measured, each, _real(cell, joints, force, course), T[:, :3, 3])
        for each, joints in ((nominal, q), (model, corrected))
    )
    assert 1e-3 < before.mean() < 4e-3
    assert after.mean() < 0.1 * before.mean()
    assert after.max() < 0.15 * before.max()


def _free_positions(cell: Cell, path: np.ndarray) -> tuple[Measured, np.ndarray]:
    """Return 120 free poses about a path by a tracker, and the markers' places in the true tcp."""
    statics, robot = SimulatedCell.of(cell, cell.file.simulation.seed).plant.statics, cell.robot
    rng = np.random.default_rng(7)
    low = np.maximum(robot.limits.lower, path.min(axis=0) - 0.7)
    high = np.minimum(robot.limits.upper, path.max(axis=0) + 0.7)
    q = rng.uniform(low, high, (120, len(low)))
    markers = statics.marker_tcp + np.array(
        [[0.0, 0.0, 0.0], [0.05, -0.12, 0.1], [-0.1, 0.1, 0.15]]
    )
    T, points = np.eye(4), []
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=3).as_matrix(), (3.0, 1.0, 0.5)
    for each in q:
        state = statics.free(each, 2e-5 * rng.standard_normal(3), None)
        R = Rotation.from_rotvec(state.twist[3:6]).as_matrix() @ robot.forward(each)[:3, :3]
        points.append(statics.tool_position(state) + markers @ R.T)
    seen = T[:3, 3] + np.array(points) @ T[:3, :3].T
    seen += rng.normal(0.0, 3e-5, seen.shape)
    free = Positions.unloaded(q, Payload())
    data = replace(free, markers=seen, station=np.full(len(q), "s0"))
    return Measured(robot, robot, data, frozenset(), T[None]), markers


def _real(cell: Cell, q: np.ndarray, force: np.ndarray, course: np.ndarray) -> np.ndarray:
    """Return where the tool truly is along courses under force, shape (row, 3), in m.

    The simulated controller takes out the sag as it was where a course began; a real one does so
    all along. So each row stands where the free arm would, and is moved by what the process does.
    """
    seed = cell.file.simulation.seed
    truth, statics = ProcessCell(cell, seed), SimulatedCell.of(cell, seed).plant.statics
    cold, found, at = replace(statics, warmth=np.zeros(())), [], ""
    for joints, load, name in zip(q, force, course.tolist(), strict=True):
        if name != at:
            truth.lift(name, joints)
            at = name
        moved = truth.press(joints, load).shift - truth.free_shift(joints)
        found.append(cold.tool_position(cold.free(joints, np.zeros(3), None)) + moved)
    return np.array(found)
