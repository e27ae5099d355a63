"""Springs fitted on the arm as built, from logs that know the drawing alone."""

from pathlib import Path

import numpy as np
import pytest

import elastocal as ec
from elastocal.errors import LogError
from elastocal.geometry import GeometryProblem, geometry_model
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from elastocal.records import write_json
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.loaded_arms import SPRINGS, jacobian, tooled
from support.measured_arms import MARKERS, Measured, measure

CAMPAIGNS, POSES = 20, 24
TOOL, SENSOR = np.array([0.18, 0.0, 0.32]), np.array([0.0, 0.0, 0.03])
"""Tool tip, and the measuring frame of the sensor, in the flange in m."""
BIAS = np.array([41.0, -18.0, 88.0, 3.0, -2.0, 0.9])
"""Of the sensor, in N and N·m."""
HOLD, MOVE, STEP = 1.6, 1.2, 0.04
"""Time of a reading, of the way to the next, and between two samples, in s."""

MAP = """\
schema: elastocal.log-map/1
robot: {urdf: arm.urdf}
tcp: {xyz: ["180 mm", "0 mm", "320 mm"]}
sensor: {xyz: ["0 mm", "0 mm", "30 mm"]}
marker: ["98 mm", "202 mm", "303 mm"]
logs:
  - log: arm.csv
    time: {column: t, unit: s}
    joints: [{columns: [A1, A2, A3, A4, A5, A6], unit: deg}]
  - log: force.csv
    time: {column: t, unit: s}
    force: {columns: [Fx, Fy, Fz], unit: N}
    moment: {columns: [Mx, My, Mz], unit: N*m}
  - log: tracker.csv
    time: {column: t, unit: s}
    markers: [{columns: [X, Y, Z], unit: mm}]
"""


def write_logs(
    folder: Path,
    measured: Measured,
    seed: int,
    *,
    moves: tuple[float, float] = (0.7, 1.3),
    presses: tuple[float, float] = (1.0, 1.0),
) -> list[Path]:
    """Write URDF, map and the three logs of presses on the arm as it is; return the logs.

    Between the bounds of `moves` lies how long each takes, between those of `presses` how hard
    each pose is pressed on, over what is usual.
    """
    rng, drawn, true = np.random.default_rng(seed), measured.robot, measured.truth
    middle, reach = [0.0, -1.35, 1.15, 0.0, 0.95, 0.0], [1.2, 0.45, 0.55, 1.5, 0.45, 2.0]
    tools = np.array([[0, 0, 0], [0, 0, -900], [270, 0, -900], [0, 270, -900.0]])
    q_0 = np.array(middle) + np.array(reach) * rng.uniform(-1.0, 1.0, (POSES, 6))
    knots = np.repeat(q_0, len(tools), axis=0)
    pressed = np.tile(np.arange(len(tools)) > 0, POSES)[:, None]
    knots = knots + pressed * rng.normal(0.0, 5e-4, knots.shape)  # the way of the controller
    harder = np.random.default_rng(seed + 1).uniform(*presses, POSES)
    loads = np.tile(tools, (POSES, 1)) * np.repeat(harder, len(tools))[:, None]
    # No two moves take equally long: clocks are found by what is not periodic.
    took = np.where(pressed[:, 0], MOVE, 2.0 * MOVE) * rng.uniform(*moves, len(knots))
    begun = np.cumsum(HOLD + took) - (HOLD + took)
    time = np.arange(0.0, begun[-1], STEP)
    knot = np.searchsorted(begun, time, side="right") - 1
    part = np.clip((time - begun[knot] - HOLD) / took[knot], 0.0, 1.0)[:, None]
    q, tool = (each[knot] + part * (each[knot + 1] - each[knot]) for each in (knots, loads))
    torque = np.einsum("nij,ni->nj", jacobian(true, q), _turned(true, q, tool))
    T, S = true.forward(q + SPRINGS * torque), measured.T_station_base[0]
    marker = T[:, :3, 3] + T[:, :3, :3] @ MARKERS[0]
    seen = S[:3, 3] + marker @ S[:3, :3].T + rng.normal(0.0, 1.5e-5, marker.shape)
    shown = np.hstack([tool, np.cross(TOOL - SENSOR, tool)]) + BIAS
    shown = shown + rng.normal(0.0, [1.0] * 3 + [0.3] * 3, shown.shape)
    (folder / "arm.urdf").write_text(drawn.urdf, encoding="utf-8")
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    texts = {
        "arm.csv": ("t,A1,A2,A3,A4,A5,A6", time, np.degrees(q)),
        "force.csv": ("t,Fx,Fy,Fz,Mx,My,Mz", time + 3.0, shown),
        "tracker.csv": ("t,X,Y,Z", time - 8.0, 1e3 * seen),
    }
    for name, (head, clock, values) in texts.items():
        rows = np.column_stack([clock, values])
        np.savetxt(folder / name, rows, "%.5f", delimiter=",", header=head, comments="")
    return [folder / name for name in texts]


def _turned(robot: Robot, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", robot.forward(q)[:, :3, :3], force)


def inside(seed: int, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return which planted springs lie inside their intervals: as built, and as drawn."""
    measured = measure(tooled(), 60, seed=seed, noise=2e-5, error=1e-3)
    problem = GeometryProblem(measured.robot, measured.data)
    found = climb(problem, 40, np.random.default_rng(1), silent)
    write_json(folder / "geometry.json", geometry_model(problem, found, "test", MARKERS))
    data = folder / "data.nc"
    ec.import_logs(write_logs(folder, measured, seed), map=folder / "map.yaml", out=data)
    held = []
    for given in ({"geometry": folder / "geometry.json"}, {}):
        low, high = ec.calibrate(data, springs="actuated", **given).calibrated.interval()
        held.append((low <= SPRINGS) & (high >= SPRINGS))
    return held[0], held[1]


@pytest.mark.slow
def test_springs_of_twenty_imported_campaigns_lie_inside_their_intervals(tmp_path):
    """Twenty arms off by 1 mm and 1 mrad a joint; of 120 springs 95 % are 114.

    Of 120 that hold with 95 %, each by itself, fewer than 107 do in one of 300 repetitions.
    """
    as_built, as_drawn = [], []
    for seed in range(CAMPAIGNS):
        folder = tmp_path / str(seed)
        folder.mkdir()
        built, drawn = inside(seed, folder)
        as_built.append(built)
        as_drawn.append(drawn)
        print(seed, built.astype(int), drawn.astype(int), flush=True)
    print("by spring", np.sum(as_built, axis=0), "as drawn", np.sum(as_drawn, axis=0))
    assert np.sum(as_built) >= 107
    assert np.sum(as_built) >= np.sum(as_drawn)


OFFSET = -3.0
"""Of the clock of the sensor's log, in s."""


@pytest.mark.parametrize(
    ("presses", "decided"), some_by_day([((1.0, 1.0), False), ((0.5, 1.0), True)])
)
def test_of_equally_long_moves_the_deflection_or_the_map_says_which_is_which(
    tmp_path, presses, decided
):
    measured = measure(tooled(), 60, seed=0, noise=2e-5, error=1e-3)
    files = write_logs(tmp_path, measured, 0, moves=(1.0, 1.0), presses=presses)
    path = tmp_path / "map.yaml"
    if not decided:
        both = r"force\.csv: its clock fits arm\.csv at -3\.\d\d s and at \+9\.\d\d s about as well"
        with pytest.raises(LogError, match=both):
            ec.import_logs(files, map=path)
        text = path.read_text(encoding="utf-8")
        path.write_text(
            text.replace("- log: force.csv", '- log: force.csv\n    offset: "-2.2 s"'),
            encoding="utf-8",
        )
    clocks = {each.clock: each for each in ec.import_logs(files, map=path).figures.clocks}
    assert clocks["force.csv"].offset == pytest.approx(OFFSET, abs=0.1)


@pytest.mark.parametrize(
    ("seen_as", "named"),
    some_by_day([([1.0 / 25.4] * 3, "`unit: in` at markers"), ([1.0, 1.0, -1.0], "left-handed")]),
)
def test_a_mistaken_marker_is_named_before_the_clock_of_equally_long_moves(
    tmp_path, seen_as, named
):
    measured = measure(tooled(), 60, seed=0, noise=2e-5, error=1e-3)
    files = write_logs(tmp_path, measured, 0, moves=(1.0, 1.0))
    rows = np.loadtxt(files[2], delimiter=",", skiprows=1) * [1.0, *seen_as]
    np.savetxt(files[2], rows, "%.6f", delimiter=",", header="t,X,Y,Z", comments="")
    with pytest.raises(LogError, match=rf"^.*{named}.*\(force\.csv: its clock fits"):
        ec.import_logs(files, map=tmp_path / "map.yaml")
