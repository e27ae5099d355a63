"""Run folders with made-up streams: a stiff robot, known deflections, a known tool and station."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.cell import Cell, fingerprint, load_cell
from elastocal.cell.devices import (
    ArmState,
    BeamState,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.cell.examples import write_example
from elastocal.files import sha256
from elastocal.planning import PlanResult, write_plan
from elastocal.procedure import (
    Event,
    Journal,
    PoseLog,
    PoseRecorder,
    RunFolder,
    RunRecord,
    file_sha256,
)
from elastocal.procedure.record import ReadingStatus, Window
from support import plans

RECORD = RunRecord(
    elastocal="0.1.0",
    plan="",
    cell="",
    cell_file="cell.yaml",
    seed=7,
    started="2026-01-02T03:04:05+00:00",
)
COMPLIANCE = np.array([[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 0.9]]) * 1e-6
"""Deflection of the tcp by force, in base, in m/N."""
TURNING = np.array([[0.0, 0.4, 0.1], [-0.3, 0.0, 0.2], [0.1, -0.2, 0.0]]) * 1e-6
"""Rotation of the tool by force, in base, in rad/N."""
RATE = 100.0


def _station() -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("zyx", [1.1, -0.2, 0.3]).as_matrix()
    T[:3, 3] = (2.4, -4.0, 2.2)
    return T


@dataclass(frozen=True, eq=False)
class Truth:
    """What the streams of a made-up run are made from."""

    T_base_tracker: np.ndarray = field(default_factory=_station)
    lever: np.ndarray = field(default_factory=lambda: np.array([0.111, 0.002, -0.0885]))
    """Marker in the tcp frame, in m."""
    mass: float = 60.0
    centre: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.15]))
    """Centre of mass in the sensor's frame, in m."""
    bias: np.ndarray = field(default_factory=lambda: np.array([12.0, -30.0, 55.0]))
    drift: np.ndarray = field(default_factory=lambda: np.array([0.002, 0.0, -0.004]))
    """In N/s."""
    force_noise: float = 0.5
    marker_noise: float = 10e-6
    station: str = "station_1"
    heavier_from: int = 1_000
    """First pose at which the tool is heavier."""
    heavier_by: float = 0.0
    """In kg."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run folder, and what its dataset must say."""

    path: Path
    plan: PlanResult
    truth: Truth
    force: np.ndarray
    """Shape (pose, load case, 3), in base, in N."""
    deflection: np.ndarray
    """Of the marker, shape (pose, load case, 3), in m."""
    controller: np.ndarray
    """Displacement of the marker by the controller, shape (pose, load case, 3), in m."""


Change = Callable[[int, Window], Window | None]
"""Changes the window of a pose; None leaves it out."""


def keep(_: int, window: Window) -> Window:
    return window


@cache
def _loaded(path: Path) -> Cell:
    return load_cell(path)


def record_run(
    folder: Path, truth: Truth | None = None, change: Change = keep, poses: int = 6, seed: int = 0
) -> Run:
    """Write cell, plan, journal and streams of a run."""
    truth, rng = truth or Truth(), np.random.default_rng(seed)
    places, plan = RunFolder(folder), plans.plan()
    write_example(places.cell, "afp")
    for made in (places.plan, places.streams):
        made.mkdir()
    text = write_plan(places.plan, plan).read_text(encoding="utf-8")
    cell = _loaded(places.cell / "cell.yaml")
    wanted = np.empty((3, poses, len(plan.contact.load_cases), 3))
    with Journal(places.journal) as journal:
        copies = {"plan": sha256(text), "cell": fingerprint(cell)}
        journal.write(0.0, Event.START, run=RECORD.model_copy(update=copies))
        for pose in plan.poses[:poses]:
            later = pose.id >= truth.heavier_from
            now = replace(truth, mass=truth.mass + truth.heavier_by) if later else truth
            log, wanted[:, pose.id] = _record_pose(places, cell, plan, pose.id, now, change, rng)
            digest = file_sha256(places.streams / log.streams)
            journal.write(log.windows[-1].end, Event.COMMIT, log=log, streams_sha256=digest)
    return Run(folder, plan, truth, *wanted)


def _record_pose(
    places: RunFolder,
    cell: Cell,
    plan: PlanResult,
    pose: int,
    truth: Truth,
    change: Change,
    rng: np.random.Generator,
) -> tuple[PoseLog, np.ndarray]:
    recorder = PoseRecorder(cell.robot.joint_names)
    q_0 = np.array(plan.poses[pose].joints)
    T_0 = cell.robot.forward(q_0)
    windows, wanted = [], np.empty((3, len(plan.contact.load_cases), 3))
    for number, (case, force_tcp) in enumerate(_loads(plan)):
        start = 100.0 * pose + 3.0 * number
        q = q_0 if case is None else q_0 + rng.normal(size=q_0.shape) * 2e-4
        T = cell.robot.forward(q)
        force = T[:3, :3] @ np.array(force_tcp)
        real = T[:3, 3] + T[:3, :3] @ truth.lever + _deflection(T, force, truth)
        _samples(recorder, cell, truth, start, q, force, real, rng)
        if case is not None:
            commanded = T[:3, 3] - T_0[:3, 3] + (T[:3, :3] - T_0[:3, :3]) @ truth.lever
            wanted[:, number - 1] = force, _deflection(T, force, truth), commanded
        window = change(
            pose,
            Window(
                load_case=case,
                start=start,
                end=start + 1.0,
                station=truth.station,
                status=ReadingStatus.OK,
            ),
        )
        windows += [window] if window else []
    name = places.stream(pose, 1).name
    recorder.save(places.streams / name)
    return PoseLog(pose=pose, attempt=1, streams=name, windows=tuple(windows)), wanted


def _loads(plan: PlanResult) -> Iterator[tuple[str | None, tuple[float, float, float]]]:
    yield None, (0.0, 0.0, 0.0)
    yield from plan.contact.load_cases.items()


def _deflection(T: np.ndarray, force: np.ndarray, truth: Truth) -> np.ndarray:
    moved: np.ndarray = COMPLIANCE @ force + np.cross(TURNING @ force, T[:3, :3] @ truth.lever)
    return moved


def _samples(
    recorder: PoseRecorder,
    cell: Cell,
    truth: Truth,
    start: float,
    q: np.ndarray,
    force: np.ndarray,
    marker: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Record a second before the window and the window itself, all alike."""
    time = start - 1.0 + np.arange(1, 2 * int(RATE) + 1) / RATE
    time = time[time > 0.0]
    T, count = cell.robot.forward(q), len(time)
    assert cell.T_sensor_tcp is not None
    R = T[:3, :3] @ np.linalg.inv(cell.T_sensor_tcp)[:3, :3]
    weight = truth.mass * (R.T @ cell.gravity_base)
    raw = R.T @ force + weight + truth.bias + time[:, None] * truth.drift
    moment = np.cross(truth.centre, weight) + np.zeros((count, 3))
    noise = rng.normal(size=(count, 3)) * truth.force_noise
    recorder.wrenches(
        WrenchBlock(
            time,
            raw + noise,
            moment + 0.02 * noise,
            truth.force_noise,
            0.02,
            SensorStatus.OK,
            "made up",
        )
    )
    seen = (marker - truth.T_base_tracker[:3, 3]) @ truth.T_base_tracker[:3, :3]
    recorder.points(
        PointBlock(
            time,
            seen + rng.normal(size=(count, 3)) * truth.marker_noise,
            np.full((count, 3), truth.marker_noise),
            BeamState.LOCKED,
            truth.station,
            "made up",
        )
    )
    for moment_of in time[::4]:
        recorder.arm(ArmState(float(moment_of), q, T, Motion.HOLDING, True, None, "made up"))
