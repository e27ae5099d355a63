"""The elastic step starts from a geometry: springs are fitted on the arm as built."""

from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.dataset import Dataset, write
from elastocal.errors import GeometryError
from elastocal.geometry import GeometryModel, GeometryProblem, geometry_model
from elastocal.geometry.ladder import climb
from elastocal.identification import CalibrateResult
from elastocal.progress import silent
from elastocal.records import write_json
from elastocal.robot import Robot, of_one_arm, tcp_gap, with_joint_origins, with_tool
from support.cli import elastocal
from support.loaded_arms import SPRINGS, acquire, tooled
from support.measured_arms import MARKERS, Measured, kuka, measure

BELIEVED = MARKERS[0] + [0.004, -0.003, 0.005]
"""Where the cell has the marker, in m."""
ERROR = 5e-3
"""Ten times what arms have, so that it shows."""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> tuple[Measured, GeometryModel, Path]:
    """Return an arm, its geometry, and a folder with it and with readings under load."""
    measured = measure(tooled(), 100, noise=0.0, error=ERROR)
    problem = GeometryProblem(measured.robot, measured.data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    model = geometry_model(problem, found, "made of a--file.csv", MARKERS)
    folder = tmp_path_factory.mktemp("elastic")
    write_json(folder / "geometry.json", model)
    write(readings(measured), folder / "data.nc")
    return measured, model, folder


def readings(measured: Measured, **given: object) -> Dataset:
    """Return what a cell records of the true arm, light forces, so that all is linear."""
    noiseless = {"press": 60.0, "tracker": 0.0, "sensor": 0.0, "marker": BELIEVED}
    return acquire(measured, **(noiseless | given))


def spring_error(result: CalibrateResult) -> float:
    """Return the largest relative error."""
    return float(np.abs(result.calibrated.compliance / SPRINGS - 1.0).max())


def test_springs_are_those_of_the_arm_as_built(campaign, tmp_path):
    _, _, folder = campaign
    drawn = ec.calibrate(folder / "data.nc", springs="actuated")
    built = ec.calibrate(
        folder / "data.nc", springs="actuated", geometry=folder / "geometry.json",
        out=tmp_path / "model.json",
    )  # fmt: skip
    assert spring_error(built) < 3e-4
    assert spring_error(drawn) > 1e-2
    assert "on the arm as built of" in built.calibrated.provenance
    assert built.calibration.settings.marker == pytest.approx(tuple(MARKERS[0]), abs=1e-4)


def test_the_arm_as_built_reaches_where_the_true_one_does(campaign):
    measured, model, _ = campaign
    q = measured.data.q[:10]
    built = model.as_built(measured.robot)
    T, own = measured.T_station_base[0], model.stations["s0"]
    for robot, tool in ((measured.robot, np.zeros(3)), (_longer(measured.robot), [0.1, 0.2, 0.3])):
        there = model.as_built(robot).forward(q)
        truth = measured.truth.forward(q)
        truth = truth[:, :3, 3] + truth[:, :3, :3] @ np.array(tool)
        seen = truth @ T[:3, :3].T + T[:3, 3]
        assert np.allclose(there[:, :3, 3] @ own[:3, :3].T + own[:3, 3], seen, atol=1e-6)
    assert np.allclose(model.markers_on(built), MARKERS, atol=1e-6)
    assert model.as_drawn(built).urdf == measured.robot.urdf


def _longer(robot: Robot) -> Robot:
    X = np.eye(4)
    X[:3, 3] = (0.1, 0.2, 0.3)
    return Robot.from_urdf(with_tool(robot.urdf, robot.tip, "long", X), "long")


@pytest.mark.slow
def test_paths_are_corrected_alike_by_a_model_of_the_arm_as_built(campaign, tmp_path):
    """What is programmed is the controller's, whichever arm the springs were fitted on."""
    measured, _, folder = campaign
    names = [f"{name}[rad]" for name in measured.robot.joint_names]
    rows = tmp_path / "rows.csv"
    heads = ",".join([*names, *(f"force_{axis}[N]" for axis in "xyz")])
    rows.write_text(f"{heads}\n0.1,-1,1,0.2,0.5,0,0,0,-500\n", encoding="utf-8")
    found = []
    for how in ((), ("--geometry", folder / "geometry.json")):
        model, out = tmp_path / "model.json", tmp_path / "out.csv"
        calibrate = ("calibrate", folder / "data.nc", "--springs", "actuated", "--force", *how)
        assert elastocal(*calibrate, "--out", model).code == 0
        built = ("--geometry", folder / "geometry.json", "--limit", "1 m")
        assert elastocal("compensate", model, rows, "--out", out, "--force", *built).code == 0
        text = out.read_text(encoding="utf-8").splitlines()[1]
        found.append(np.array([float(cell) for cell in text.split(",")[:6]]))
    # The springs of the arm as drawn, ten times as wrong as arms are, are a third off.
    assert np.abs(found[0] - found[1]).max() < 3e-4
    assert np.abs(found[0] - [0.1, -1, 1, 0.2, 0.5, 0]).max() > 1e-3


def test_the_geometry_of_another_arm_is_refused(campaign, tmp_path):
    _, _, folder = campaign
    other = ("--robot", "KR 210 R3100-2", "--tcp", "flange", "--out", tmp_path / "model.json")
    result = elastocal(
        "calibrate", folder / "data.nc", "--geometry", folder / "geometry.json", *other
    )
    assert "the geometry is of another arm" in result.reason


def test_frames_that_lie_elsewhere_on_their_axes_are_refused(campaign):
    _, model, _ = campaign
    robot = kuka()
    along = np.eye(4)
    along[:3, 3] = 0.1 * robot.chain.joints[3].axis
    moved = {"joint_a4": along, "joint_a5": _before(robot, 4, along)}
    slid = Robot.from_urdf(with_joint_origins(robot.urdf, moved), robot.tip)
    assert np.allclose(slid.forward(np.ones(6)), robot.forward(np.ones(6)), atol=1e-9)
    with pytest.raises(GeometryError, match="the frame of joint_a4 lies elsewhere"):
        model.as_built(slid)


def _before(robot: Robot, joint: int, T: np.ndarray) -> np.ndarray:
    """Return what leaves a joint where it was although the link before it has moved by T."""
    place = robot.chain.joints[joint].placement
    return np.linalg.inv(place) @ np.linalg.inv(T) @ place


def test_the_arm_as_built_counts_as_the_one_as_drawn():
    """So that cells and earlier models of the arm go on fitting; without its mark it does not."""
    measured = measure(kuka(), 60)
    problem = GeometryProblem(measured.robot, measured.data)
    model = geometry_model(problem, climb(problem, 40, np.random.default_rng(1), silent), "test")
    drawn, built = measured.robot, model.as_built(measured.robot)
    gap = tcp_gap(drawn, built)
    assert not gap.closed
    assert of_one_arm(gap, drawn, built)
    assert not of_one_arm(gap, drawn, drawn)
    assert not of_one_arm(tcp_gap(_longer(drawn), built), _longer(drawn), built)
