"""The raw streams of a run, written as three other programs would: units, commas, clocks."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.procedure import read_commits, read_streams
from elastocal.procedure.record import Streams

OFFSET, DRIFT = 3.2, 50e-6
"""Of the clock of the force sensor, in s and s/s."""
TRACKER_OFFSET = -41.7
"""Of the clock of the tracker, in s."""

MAP = """\
schema: elastocal.log-map/1
cell: {cell}
logs:
  - log: controller.csv
    time: {{column: Zeit, unit: s}}
    joints: [{{columns: [E1], unit: mm}}, {{columns: [A1, A2, A3, A4, A5, A6], unit: deg}}]
    pose: {{position: {{columns: [X, Y, Z], unit: mm}}, angles: {{columns: [A, B, C], unit: deg}}}}
  - log: force.csv
    time: {{column: ms, unit: ms}}
    force: {{columns: [Fx, Fy, Fz], unit: kN}}
    moment: {{columns: [Tx, Ty, Tz], unit: N*mm}}
    acts_on: environment
  - log: tracker.txt
    time: {{column: 7, unit: s}}
    markers: [{{columns: [4, 5, 6], unit: mm}}]
"""


@dataclass(frozen=True)
class Rows:
    """What the devices of a run said, one array a column group."""

    arm_time: np.ndarray
    q: np.ndarray
    T: np.ndarray
    force_time: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    point_time: np.ndarray
    position: np.ndarray


def rows_of(run: Path) -> Rows:
    """Return all raw samples of the poses that a run has committed."""
    some = [
        read_streams(run / "streams" / log.streams) for log in read_commits(run / "journal.jsonl")
    ]
    return Rows(
        _joined(some, "arm", "time"),
        _joined(some, "arm", "q"),
        _joined(some, "arm", "T_base_tcp"),
        _joined(some, "wrench", "time"),
        _joined(some, "wrench", "force"),
        _joined(some, "wrench", "moment"),
        _joined(some, "points", "time"),
        _joined(some, "points", "position"),
    )


def write_logs(rows: Rows, folder: Path) -> list[Path]:
    """Write three foreign logs; return them."""
    angles = Rotation.from_matrix(rows.T[:, :3, :3]).as_euler("ZYX", degrees=True)
    rail, axes = 1e3 * rows.q[:, :1], np.degrees(rows.q[:, 1:])
    arm = np.hstack([rows.arm_time[:, None], rail, axes, 1e3 * rows.T[:, :3, 3], angles])
    clock = (rows.force_time - OFFSET) / (1.0 + DRIFT)
    # What another sensor says presses on the tooling, not on the robot.
    wrench = np.hstack([1e3 * clock[:, None], -1e-3 * rows.force, -1e3 * rows.moment])
    points = np.hstack([1e3 * rows.position, (rows.point_time - TRACKER_OFFSET)[:, None]])
    head = "Zeit;E1;A1;A2;A3;A4;A5;A6;X;Y;Z;A;B;C\n"
    controller = head + "".join(line.replace(".", ",") for line in _lines(arm, ";", "%.4f"))
    force = "# a box\nms,Fx,Fy,Fz,Tx,Ty,Tz\n" + "".join(_lines(wrench, ",", "%.6f"))
    tracker = "// points in mm\n" + "".join(f"C G p {line}" for line in _lines(points, " ", "%.4f"))
    texts = {"controller.csv": controller, "force.csv": force, "tracker.txt": tracker}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in texts]


def write_map(folder: Path, cell: Path, text: str = MAP) -> Path:
    """Write the map of `write_logs`."""
    path = folder / "map.yaml"
    path.write_text(text.format(cell=cell), encoding="utf-8")
    return path


def _joined(some: list[Streams], stream: str, field: str) -> np.ndarray:
    return np.concatenate([getattr(getattr(each, stream), field) for each in some])


def _lines(values: np.ndarray, delimiter: str, form: str) -> Iterable[str]:
    return (delimiter.join(form % value for value in row) + "\n" for row in values.tolist())
