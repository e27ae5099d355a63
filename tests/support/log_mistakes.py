"""Mistakes in the logs of a run and in their map, and what `import` says of them.

Harm is the largest change of forces, moments, displacements of the marker and joints against the
sound import, RMS over the readings of both, each over its own size (the joints over 1 rad).
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import elastocal as ec
from elastocal.dataset import Dataset
from elastocal.errors import ElastocalError
from support import reported
from support.foreign_logs import MAP, OFFSET, Rows, rows_of, write_logs, write_map
from support.mistake_table import Outcome, judged


@dataclass(frozen=True)
class Logs:
    """Rows and the map by which they are imported; ``edit`` changes the text of a written log."""

    rows: Rows
    map: str = MAP
    edit: Callable[[str, str], str] = lambda _, text: text


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

    @property
    def title(self) -> str:
        """Return what it is called in the table of mistakes."""
        return "a run" if self.seed is None else "a noisier one"

    @cached_property
    def logs(self) -> Logs:
        """The sound logs."""
        rows = rows_of(reported.finished() / "run")
        if self.seed is None:
            return Logs(rows)
        rng = np.random.default_rng(self.seed)

        def noisy(values: np.ndarray, sigma: float) -> np.ndarray:
            return values + sigma * rng.normal(size=values.shape)

        return Logs(
            replace(
                rows,
                force=noisy(rows.force, 1.0) + rng.normal(0.0, 20.0, 3),
                moment=noisy(rows.moment, 0.1),
                position=noisy(rows.position, 5e-6) + rng.normal(0.0, 0.2, 3),
                force_time=rows.force_time + rng.uniform(-5.0, 5.0),
                point_time=rows.point_time * (1.0 + rng.normal(0.0, 3e-5)) + rng.uniform(-5.0, 5.0),
            )
        )


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
_DECIMALS = "cannot read|number|decimal|column"

LOG_MISTAKES = (
    LogMistake("joints in rad for deg", ("limits",), _map("A6], unit: deg", "A6], unit: rad")),
    LogMistake("rail in m for mm", ("limits",), _map("[E1], unit: mm", "[E1], unit: m")),
    LogMistake("A1, A2 exchanged", ("tool frame lies", "limits"), _map("[A1, A2,", "[A2, A1,")),
    LogMistake(
        "A5, A6 exchanged, no pose",
        ("joint", "tool frame"),
        _together(
            _map("A5, A6]", "A6, A5]"),
            lambda logs: replace(
                logs, map="\n".join(x for x in logs.map.splitlines() if "pose:" not in x) + "\n"
            ),
        ),
    ),
    LogMistake("A3 reversed", ("joint's sign",), _scaled(q=[1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0])),
    LogMistake("A6 frozen from half way on", ("tool frame", "A6"), _frozen("q", 6)),
    LogMistake("force in kgf for N", ("unit", "weight"), _scaled(force=1 / 9.80665)),
    LogMistake("force in N for kN", ("unit", "largest force"), _map("unit: kN", "unit: N")),
    LogMistake("force in lbf for N", ("unit", "weight"), _scaled(force=1 / 4.4482216)),
    LogMistake("counts taken as newtons", ("force",), _scaled(force=1e6, moment=1e6)),
    LogMistake("moments in N m for N mm", ("moment",), _scaled(moment=1e-3)),
    LogMistake("acts_on forgotten", ("acts_on",), _map("    acts_on: environment\n", "")),
    LogMistake("force_z dead", ("Fz",), _scaled(force=[1, 1, 0])),
    LogMistake("force_x dead", ("Fx",), _scaled(force=[0, 1, 1])),
    LogMistake("force_x frozen from half way on", ("Fx",), _frozen("force", 0)),
    LogMistake("force_x reversed", ("Fx", "left-handed"), _scaled(force=[-1, 1, 1])),
    LogMistake("force x, y exchanged", ("left-handed", "exchanged"), _map("[Fx, Fy,", "[Fy, Fx,")),
    LogMistake("sensor turned by 90 deg", ("turned",), _turned("z", 90.0)),
    LogMistake("sensor turned by 10 deg", ("turned",), _turned("z", 10.0)),
    LogMistake(
        "sensor's frame called base",
        ("frame", "turned"),
        _map("    acts_on: environment\n", "    acts_on: environment\n    frame: base\n"),
    ),
    LogMistake("zero pressed half way", ("zero",), _after("force", [100.0, 0, 300.0])),
    LogMistake("time of the sensor in s for ms", ("time",), _map("unit: ms}", "unit: s}")),
    LogMistake("one clock, 0.3 s apart", ("clock",), lambda logs: _shared(logs, 0.3)),
    LogMistake("one clock, 2 s apart", ("clock",), lambda logs: _shared(logs, 2.0)),
    LogMistake(
        "clock of the sensor drifts by 0.2 %",
        ("drift",),
        _rows(lambda r: {"force_time": r.force_time * 1.002}),
    ),
    LogMistake("tracker in inches for mm", ("marker", "inch"), _scaled(position=1 / 25.4)),
    LogMistake("tracker in m for mm", ("marker",), _map("6], unit: mm", "6], unit: m")),
    LogMistake("tracker left-handed", ("left-handed", "handed"), _scaled(position=[1, 1, -1])),
    LogMistake("tracker x, y exchanged", ("handed",), _map("[4, 5, 6]", "[5, 4, 6]")),
    LogMistake("marker_z dead", ("marker",), _scaled(position=[1, 1, 0])),
    LogMistake("marker_y frozen from half way on", ("marker",), _frozen("position", 1)),
    LogMistake("station bumped by 5 mm", ("moved",), _after("position", [5e-3, 0, 0])),
    LogMistake(
        "tracker of another run",
        ("same work",),
        _rows(lambda r: {"position": r.position[::-1].copy()}),
    ),
    LogMistake(
        "sensor of another run",
        ("same work",),
        _rows(lambda r: {"force": r.force[::-1].copy(), "moment": r.moment[::-1].copy()}),
    ),
    LogMistake(
        "a lost part of the sensor", ("missing", "reading"), _cut("force", _FORCE, 0.4, 0.5)
    ),
    LogMistake("a lost part of the tracker", ("missing",), _cut("point", _TRACKER, 0.4, 0.5)),
    LogMistake(
        "300 rows of the sensor twice",
        ("time", "twice"),
        lambda logs: replace(logs, edit=_doubled("force.csv")),
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
        files = write_logs(logs.rows, folder)
        for file in files:
            file.write_text(logs.edit(file.name, file.read_text()), encoding="utf-8")
        path = write_map(folder, reported.finished() / "cell" / "cell.yaml", logs.map)
        try:
            found = ec.import_logs(files, map=path)
        except ElastocalError as error:
            return None, (str(error),)
        return found.dataset, found.figures.warnings


_SIZES = {"force": None, "moment": None, "marker_displacement": None, "joint_position": 1.0}
"""Columns that are compared, and their size; None: RMS of the sound ones."""


def _harm(sound: Dataset, found: Dataset) -> float:
    """Return the largest change of a column; NaN where the readings are others."""
    if sound.force.shape != found.force.shape:
        return float("nan")
    both = sound.usable & found.usable
    if not both.any():
        return float("nan")
    change = 0.0
    for name, size in _SIZES.items():
        was, now = (getattr(each, name)[both] for each in (sound, found))
        change = max(change, _rms(now - was) / (size or _rms(was)))
    return change


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))
