"""Mistakes in the logs of a run and in their map, and what `import` says of them.

Harm is how far predictions of the springs that are identified from the imported readings move
against those from the sound import, over the mean predicted deflection, at poses of no campaign.
"""

import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import elastocal as ec
from elastocal.dataset import Dataset
from elastocal.elastic import ElasticModel, bearing
from elastocal.errors import ElastocalError
from elastocal.identification import build, screen, solve
from elastocal.robot import Robot
from support import reported
from support.cli import elastocal
from support.foreign_logs import MAP, OFFSET, Rows, rows_of, write_logs, write_map
from support.kept import kept
from support.mistake_table import Outcome, judged
from support.run_cells import planned_cell


@dataclass(frozen=True)
class Logs:
    """Rows, the map by which they are imported and the cell that the map names."""

    rows: Rows
    cell: Path
    map: str = MAP
    edit: Callable[[str, str], str] = lambda _, text: text
    """Changes the text of a written log, or of the cell's file."""


@dataclass(frozen=True)
class LogMistake:
    """A mistake in logs or their map, and parts of the messages that name it rightly."""

    name: str
    named: tuple[str, ...]
    make: Callable[[Logs], Logs]


@dataclass(frozen=True)
class Recording:
    """The logs of a run; with a seed more noisy, begun elsewhere in space and time."""

    seed: int | None = None
    other: bool = False
    """Whether it is of 14 poses, with a lighter tool and a sensor that is turned; else of 7."""

    @property
    def title(self) -> str:
        """Return what it is called in the table of mistakes."""
        run = "another run" if self.other else "a run"
        return run if self.seed is None else f"{run}, noisier"

    @cached_property
    def logs(self) -> Logs:
        """The sound logs."""
        folder = _other_run() if self.other else reported.finished()
        rows, cell = rows_of(folder / "run"), folder / "cell" / "cell.yaml"
        if self.seed is None:
            return Logs(rows, cell)
        rng = np.random.default_rng(self.seed)

        def noisy(values: np.ndarray, sigma: float) -> np.ndarray:
            return values + sigma * rng.normal(size=values.shape)

        def seldom(stream: str, *fields: str) -> dict[str, np.ndarray]:
            step = int(rng.integers(1, 5))
            return {name: getattr(rows, name)[::step] for name in (f"{stream}_time", *fields)}

        rows = replace(rows, **seldom("force", *_FORCE), **seldom("point", *_TRACKER))
        rows = replace(
            rows,
            force=noisy(rows.force, 1.0) + rng.normal(0.0, 20.0, 3),
            moment=noisy(rows.moment, 0.1),
            position=noisy(rows.position, 5e-6) + rng.normal(0.0, 0.2, 3),
            force_time=rows.force_time + rng.uniform(-5.0, 5.0),
            point_time=rows.point_time * (1.0 + rng.normal(0.0, 3e-5)) + rng.uniform(-5.0, 5.0),
        )
        if self.seed % 5 == 0:  # few digits
            rows = replace(rows, force=np.round(rows.force), position=np.round(rows.position, 5))
        if self.seed % 7 == 0:  # all stands for a while, and goes on
            rows = _paused(rows, 120.0)
        return Logs(rows, cell)


def _paused(rows: Rows, pause: float) -> Rows:
    """Return rows of a run that was interrupted in the middle; nobody recorded the pause."""
    half = float(np.median(rows.arm_time) - rows.arm_time[0])
    times = {name: getattr(rows, name) for name in ("arm_time", "force_time", "point_time")}
    late = {name: time + pause * (time - time[0] > half) for name, time in times.items()}
    return replace(rows, **late)


def _other_run() -> Path:
    """Return a folder with ``cell`` and ``run`` of another tool, sensor, arm and other poses."""
    return kept("imported", _make_other_run)


def _make_other_run(folder: Path) -> None:
    made = planned_cell(
        folder,
        14,
        "afp",
        (r"preset: kind", "preset: typical"),
        (
            r'  mass: "60 kg"\n  centre_of_mass: .*',
            '  mass: "38 kg"\n  centre_of_mass: ["20 mm", "0 mm", "150 mm"]',
        ),
        (
            r'"0 mm", "30 mm"\]\}   # in flange\n  force_range',
            '"0 mm", "30 mm"], abc: ["60 deg", "0 deg", "0 deg"]}\n  force_range',
        ),
        (r"\n  seed: 1\n", "\n  seed: 4\n"),
        (r"\n  seed: 0\n", "\n  seed: 6\n"),
    )
    result = elastocal("run", made.cell, "--plan", made.plan, "--out", folder / "run")
    assert result.code == 0, result.err


def _map(old: str, new: str) -> Callable[[Logs], Logs]:
    assert old in MAP, old
    return lambda logs: replace(logs, map=logs.map.replace(old, new))


def _rows(change: Callable[[Rows], dict[str, np.ndarray]]) -> Callable[[Logs], Logs]:
    return lambda logs: replace(logs, rows=replace(logs.rows, **change(logs.rows)))


def _scaled(**factors: object) -> Callable[[Logs], Logs]:
    return _rows(lambda r: {k: getattr(r, k) * np.array(f) for k, f in factors.items()})


def _turned(axis: str, degrees: float) -> Callable[[Logs], Logs]:
    R = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    return _rows(lambda r: {"force": r.force @ R, "moment": r.moment @ R})


def _together(*changes: Callable[[Logs], Logs]) -> Callable[[Logs], Logs]:
    def made(logs: Logs) -> Logs:
        for change in changes:
            logs = change(logs)
        return logs

    return made


def _cut(stream: str, fields: tuple[str, ...], low: float, high: float) -> Callable[[Logs], Logs]:
    """Return the logs without a stretch, in parts of the duration, of one stream."""

    def change(r: Rows) -> dict[str, np.ndarray]:
        time = getattr(r, f"{stream}_time")
        at = (time - time[0]) / np.ptp(time)
        kept = (at < low) | (at > high)
        return {name: getattr(r, name)[kept] for name in (f"{stream}_time", *fields)}

    return _rows(change)


def _frozen(field: str, column: int, since: float = 0.5) -> Callable[[Logs], Logs]:
    def change(r: Rows) -> dict[str, np.ndarray]:
        values = getattr(r, field).copy()
        first = int(since * len(values))
        values[first:, column] = values[first, column]
        return {field: values}

    return _rows(change)


def _after(field: str, shift: list[float], since: float = 0.5) -> Callable[[Logs], Logs]:
    def change(r: Rows) -> dict[str, np.ndarray]:
        values = getattr(r, field)
        late = (np.arange(len(values)) >= since * len(values))[:, None]
        return {field: values + late * np.array(shift)}

    return _rows(change)


def _cell(old: str, new: str) -> Callable[[Logs], Logs]:
    """Return logs whose cell says something else of the arm or the tool."""

    def edit(name: str, text: str) -> str:
        if name != "cell.yaml":
            return text
        changed, count = re.subn(old, new, text)
        assert count == 1, old
        return changed

    return lambda logs: replace(logs, edit=edit)


def _without_pose(logs: Logs) -> Logs:
    lines = [line for line in logs.map.splitlines() if "pose:" not in line]
    return replace(logs, map="\n".join(lines) + "\n")


def _moved_joint(joint: int, radians: float) -> Callable[[Logs], Logs]:
    def change(r: Rows) -> dict[str, np.ndarray]:
        return {"q": r.q + radians * (np.arange(r.q.shape[1]) == joint)}

    return _together(_without_pose, _rows(change))


def _still_marker(r: Rows) -> dict[str, np.ndarray]:
    """Return a reflector that was left at the foot of the arm."""
    noise = 1e-5 * np.random.default_rng(0).normal(size=r.position.shape)
    return {"position": r.position[0] + noise}


def _stepped_back(r: Rows) -> dict[str, np.ndarray]:
    """Return a clock of the sensor that was set back by a minute on the way."""
    late = np.arange(len(r.force_time)) > len(r.force_time) // 2
    return {"force_time": r.force_time - 60.0 * late}


def _doubled(log: str) -> Callable[[str, str], str]:
    def edit(name: str, text: str) -> str:
        lines = text.splitlines(keepends=True)
        middle = len(lines) // 2
        again = lines[middle : middle + 300]
        return "".join([*lines[: middle + 300], *again, *lines[middle + 300 :]])

    return lambda name, text: edit(name, text) if name == log else text


def _shared(logs: Logs, late: float) -> Logs:
    """Return logs of controller and sensor that are said to share a clock, and do not."""
    text = logs.map.replace(
        "    acts_on: environment\n", "    acts_on: environment\n    clock: a\n"
    )
    text = text.replace("  - log: controller.csv\n", "  - log: controller.csv\n    clock: a\n")
    # `write_logs` takes OFFSET off: put back, but for what the clocks are apart.
    return replace(
        logs, map=text, rows=replace(logs.rows, force_time=logs.rows.force_time + OFFSET + late)
    )


_TRACKER, _FORCE = ("position",), ("force", "moment")

LOG_MISTAKES = (
    LogMistake("joints in rad for deg", ("limits",), _map("A6], unit: deg", "A6], unit: rad")),
    LogMistake("rail in m for mm", ("limits",), _map("[E1], unit: mm", "[E1], unit: m")),
    LogMistake(
        "A1, A2 exchanged",
        (
            "tool frame lies",
            "limits",
        ),
        _map("[A1, A2,", "[A2, A1,"),
    ),
    LogMistake(
        "A5, A6 exchanged, no pose",
        ("joint_a5 and joint_a6 are swapped",),
        _together(_map("A5, A6]", "A6, A5]"), _without_pose),
    ),
    LogMistake(
        "A1, A4 exchanged, no pose",
        (
            "joint_a1 and joint_a4 are swapped",
            "limits",
        ),
        _together(_map("[A1, A2, A3, A4,", "[A4, A2, A3, A1,"), _without_pose),
    ),
    LogMistake(
        "A1 reversed, no pose",
        ("joint_a1 turns the other way",),
        _together(_scaled(q=[1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0]), _without_pose),
    ),
    LogMistake(
        "A4 reversed, no pose",
        ("joint_a4 turns the other way",),
        _together(_scaled(q=[1.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0]), _without_pose),
    ),
    LogMistake(
        "rail reversed, no pose",
        ("rail",),
        _together(_scaled(q=[-1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]), _without_pose),
    ),
    LogMistake(
        "zero of A3 10 deg off, no pose", ("zero of joint_a3",), _moved_joint(3, np.radians(10.0))
    ),
    LogMistake(
        "zero of A5 90 deg off, no pose",
        (
            "zero of joint_a5",
            "limits",
        ),
        _moved_joint(5, np.radians(90.0)),
    ),
    LogMistake(
        "A4 frozen from half way on, no pose",
        ("joint_a4 holds",),
        _together(_frozen("q", 4), _without_pose),
    ),
    LogMistake(
        "another model of the arm",
        ("tool frame",),
        _cell("model: KR 120 R2700 extra HA", "model: KR 210 R3100 ultra"),
    ),
    LogMistake(
        "another model of the arm, no pose",
        (
            "the arm is",
            "another arm",
        ),
        _together(
            _cell("model: KR 120 R2700 extra HA", "model: KR 210 R3100 ultra"), _without_pose
        ),
    ),
    LogMistake(
        "arm hangs from the ceiling",
        (
            "ceiling",
            "mount",
            "gravity",
        ),
        _cell(
            r'mounting: {xyz: \["0 m", "0 m", "0 m"\]}',
            'mounting: {xyz: ["0 m", "0 m", "0 m"], abc: ["0 deg", "0 deg", "180 deg"]}',
        ),
    ),
    LogMistake(
        "tool's mass a tenth of what hangs",
        ("feels a tool of",),
        _cell(r'(tool: .*\n  mass: )"(\d)(\d) kg"', r'\1"\2.\3 kg"'),
    ),
    LogMistake(
        "marker said to be 0.4 m off",
        ("place of the marker",),
        _cell(r'position: \["110 mm"', 'position: ["510 mm"'),
    ),
    LogMistake(
        "A3 reversed",
        ("joint_a3 reversed",),
        _scaled(q=[1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0]),
    ),
    LogMistake(
        "A6 frozen from half way on",
        (
            "tool frame",
            "joint_a6 holds",
        ),
        _frozen("q", 6),
    ),
    LogMistake("force in kgf for N", ("kgf",), _scaled(force=1 / 9.80665)),
    LogMistake("force in N for kN", ("kN in a column of N",), _map("unit: kN", "unit: N")),
    LogMistake("force in lbf for N", ("lbf",), _scaled(force=1 / 4.4482216)),
    LogMistake(
        "counts taken as newtons",
        (
            "looks like",
            "unit",
        ),
        _scaled(force=1e6, moment=1e6),
    ),
    LogMistake("moments in N m for N mm", ("moments .* unit",), _scaled(moment=1e-3)),
    LogMistake("acts_on forgotten", ("acts_on",), _map("    acts_on: environment\n", "")),
    LogMistake("force_z dead", ("Fz",), _scaled(force=[1, 1, 0])),
    LogMistake("force_x dead", ("Fx",), _scaled(force=[0, 1, 1])),
    LogMistake("force_x frozen from half way on", ("Fx",), _frozen("force", 0)),
    LogMistake(
        "force_x reversed",
        (
            "force_x .* sign",
            "Fx",
        ),
        _scaled(force=[-1, 1, 1]),
    ),
    LogMistake(
        "force x, y exchanged", ("force_x and force_y are exchanged",), _map("[Fx, Fy,", "[Fy, Fx,")
    ),
    LogMistake("sensor turned by 90 deg", ("turned",), _turned("z", 90.0)),
    LogMistake("sensor turned by 10 deg", ("turned",), _turned("z", 10.0)),
    LogMistake(
        "sensor's frame called base",
        ("in the sensor's frame already",),
        _map("    acts_on: environment\n", "    acts_on: environment\n    frame: base\n"),
    ),
    LogMistake("sensor upside down", ("turned",), _turned("x", 180.0)),
    LogMistake("force_z twice its size", ("force_z .* gain",), _scaled(force=[1, 1, 2])),
    LogMistake("force_y half its size", ("force_y .* gain",), _scaled(force=[1, 0.5, 1])),
    LogMistake("zero pressed half way", ("zeroed",), _after("force", [100.0, 0, 300.0])),
    LogMistake(
        "time of the sensor in s for ms",
        ("another unit than the map",),
        _map("unit: ms}", "unit: s}"),
    ),
    LogMistake(
        "time of the tracker in ms for s",
        ("another unit than the map",),
        _map("{{column: 7, unit: s}}", "{{column: 7, unit: ms}}"),
    ),
    LogMistake(
        "one clock, 0.3 s apart",
        (
            "clock",
            "row before",
        ),
        lambda logs: _shared(logs, 0.3),
    ),
    LogMistake(
        "one clock, 2 s apart",
        (
            "share a clock",
            "row before",
        ),
        lambda logs: _shared(logs, 2.0),
    ),
    LogMistake(
        "clock of the sensor drifts by 0.2 %",
        ("drift",),
        _rows(lambda r: {"force_time": r.force_time * 1.002}),
    ),
    LogMistake("tracker in inches for mm", ("inch",), _scaled(position=1 / 25.4)),
    LogMistake(
        "tracker in m for mm",
        ("column is in mm, but its heading says m",),
        _map("6], unit: mm", "6], unit: m"),
    ),
    LogMistake("tracker left-handed", ("left-handed",), _scaled(position=[1, 1, -1])),
    LogMistake("tracker x, y exchanged", ("left-handed",), _map("[4, 5, 6]", "[5, 4, 6]")),
    LogMistake("marker_z dead", ("column '6' holds",), _scaled(position=[1, 1, 0])),
    LogMistake("marker_y frozen from half way on", ("column '5' holds",), _frozen("position", 1)),
    LogMistake(
        "marker frozen from half way on",
        ("columns '4', '5', '6' hold the same",),
        _together(*(_frozen("position", axis) for axis in range(3))),
    ),
    LogMistake(
        "a reflector that stands still",
        (
            "nothing changes",
            "same work",
        ),
        _rows(_still_marker),
    ),
    LogMistake("marker_x twice its size", ("marker_x",), _scaled(position=[2, 1, 1])),
    LogMistake(
        "station bumped by 5 mm", ("station tracker moved",), _after("position", [5e-3, 0, 0])
    ),
    LogMistake(
        "tracker of another run",
        (
            "log of another run",
            "same work",
        ),
        _rows(lambda r: {"position": r.position[::-1].copy()}),
    ),
    LogMistake(
        "sensor of another run",
        (
            "log of another run",
            "same work",
        ),
        _rows(lambda r: {"force": r.force[::-1].copy(), "moment": r.moment[::-1].copy()}),
    ),
    LogMistake(
        "a lost part of the sensor", ("force.csv: nothing for",), _cut("force", _FORCE, 0.4, 0.5)
    ),
    LogMistake(
        "a lost part of the tracker",
        ("tracker.txt: nothing for",),
        _cut("point", _TRACKER, 0.4, 0.5),
    ),
    LogMistake(
        "300 rows of the sensor twice",
        ("its time is before",),
        lambda logs: replace(logs, edit=_doubled("force.csv")),
    ),
    LogMistake(
        "clock of the sensor set back by 60 s", ("its time is before",), _rows(_stepped_back)
    ),
    LogMistake(
        "decimal commas of the sensor",
        ("column", "number"),
        lambda logs: replace(
            logs, edit=lambda n, t: t.replace(".", ",") if n == "force.csv" else t
        ),
    ),
    LogMistake(
        "load cases with another sign",
        ("no load is near",),
        lambda logs: replace(logs, map=logs.map + "load_cases: {{up: ['0 N','0 N','1100 N']}}\n"),
    ),
    LogMistake(
        "a load case not in the map",
        ("near none",),
        lambda logs: replace(logs, map=logs.map + "load_cases: {{up: ['0 N','0 N','-1100 N']}}\n"),
    ),
)


def log_outcome(recording: Recording, mistake: LogMistake) -> Outcome:
    """Return what `import` says of logs in which a mistake is made, and its harm."""
    sound, _ = _sound(recording)
    found, said = _imported(mistake.make(recording.logs))
    harm = float("nan") if sound is None or found is None else _harm(sound, found)
    return judged(mistake.name, mistake.named, harm, found is None, said)


def log_alarms(recording: Recording) -> tuple[str, ...]:
    """Return what `import` says of sound logs."""
    return _sound(recording)[1]


@lru_cache(maxsize=2)
def _sound(recording: Recording) -> tuple[Dataset | None, tuple[str, ...]]:
    return _imported(recording.logs)


def _imported(logs: Logs) -> tuple[Dataset | None, tuple[str, ...]]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(logs.cell.parent, folder / "cell")
        cell = folder / "cell" / logs.cell.name
        files = write_logs(logs.rows, folder)
        for file in (*files, cell):
            text = file.read_text(encoding="utf-8")
            file.write_text(logs.edit(file.name, text), encoding="utf-8")
        path = write_map(folder, cell, logs.map)
        try:
            found = ec.import_logs(files, map=path)
        except ElastocalError as error:
            return None, (str(error),)
        return found.dataset, found.figures.warnings


def _harm(sound: Dataset, found: Dataset) -> float:
    """Return how far predictions move over the mean deflection; NaN: there is no fit."""
    rng = np.random.default_rng(0)
    q = sound.joint_position[sound.usable]
    q, force = rng.permutation(q + rng.normal(0.0, 0.2, q.shape)), sound.force[sound.usable]
    try:
        right, wrong = (_predicted(each, q, force) for each in (sound, found))
    except ElastocalError:
        return float("nan")
    size = np.linalg.norm(right, axis=1).mean()
    return float(np.linalg.norm(right - wrong, axis=1).mean() / size)


def _predicted(data: Dataset, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return predicted displacements of the tool, shape (posture, 3), in m."""
    robot = Robot.from_urdf(data.robot_urdf, data.tcp_frame)
    model = ElasticModel(robot, bearing(robot))
    readings = data.readings(robot.joint_names)
    problem = build(model, readings, None, None if data.marker is None else np.array(data.marker))
    compliance = solve(problem.take(~screen(problem).blunder)).compliance
    return model.observation_blocks(q, force) @ compliance
