"""Paths over the simulated dome, and a model calibrated on the arm that is to follow them."""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.elastic import ElasticModel, layout
from elastocal.identification import CalibratedModel, Observability, calibrate
from elastocal.robot import Robot, xyzabc_from_T
from elastocal.sim.arm.measurement import START, SphericalCap
from support.cells import TRACKED, Cell, rich_truth, robot
from support.problems import elastic

FORCE_TCP = np.array([150.0, -80.0, -1100.0])
"""Compaction with lateral forces, on the robot, in the tcp frame, in N."""


@cache
def calibrated() -> CalibratedModel:
    """Return the model calibrated on the arm with bending links, from noisy readings."""
    readings = Cell(rich_truth(), noise=TRACKED).readings()
    return calibrate(elastic(), readings, np.random.default_rng(0)).calibrated


def made_up(robot: Robot) -> CalibratedModel:
    """Return a model of any robot, all springs equal, without a calibration."""
    model = ElasticModel(robot, layout(robot, "bearing"))
    n = len(model.springs)
    c = np.full(n, 1e-6)
    return CalibratedModel(model, c, np.tile(c, (40, 1)), Observability(n, 1.0, (True,) * n, ()))


def dome_course(count: int = 40, width: float = 0.4) -> np.ndarray:
    """Return poses along a course over the dome, z into the surface, shape (count, 4, 4)."""
    cap = SphericalCap()
    y = np.linspace(-width, width, count)
    apex, lean = np.array(cap.apex), np.arctan2(*np.array(cap.normal)[[0, 2]])
    turn = Rotation.from_euler("y", lean).as_matrix()
    local = np.stack([np.zeros(count), y, np.sqrt(cap.radius**2 - y**2)], axis=1) / cap.radius
    normal = local @ turn.T
    T = np.tile(np.eye(4), (count, 1, 1))
    x = np.array([1.0, 0.0, 0.0]) - normal * normal[:, :1]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    T[:, :3, :3] = np.stack([x, np.cross(-normal, x), -normal], axis=-1)
    T[:, :3, 3] = apex + cap.radius * (normal - turn[:, 2])
    return T


def start_text() -> str:
    """Return the posture above the dome as the command line takes it."""
    return ", ".join(f"{value} rad" for value in START)


def write_csv(path: Path, columns: dict[str, object]) -> Path:
    """Write columns, numbers to the last digit."""
    texts = [
        [value if isinstance(value, str) else repr(float(value)) for value in column]
        for column in columns.values()
    ]
    lines = [",".join(columns), *map(",".join, zip(*texts, strict=True))]
    path.write_text("\n".join(lines) + "\n")
    return path


def read_csv(path: Path, *names: str) -> np.ndarray:
    """Return columns by their headers, shape (row, column)."""
    header, *rows = (line.split(",") for line in path.read_text().splitlines())
    return np.array([[float(row[header.index(name)]) for name in names] for row in rows])


def joint_columns(q: np.ndarray, unit: str = "deg") -> dict[str, np.ndarray]:
    values = np.degrees(q) if unit == "deg" else q
    return {
        f"{name}[{unit}]": column
        for name, column in zip(robot().joint_names, values.T, strict=True)
    }


def euler_columns(T: np.ndarray) -> dict[str, np.ndarray]:
    pose = xyzabc_from_T(T) * np.array([1e3] * 3 + [180.0 / np.pi] * 3)
    names = ("x[mm]", "y[mm]", "z[mm]", "a[deg]", "b[deg]", "c[deg]")
    return dict(zip(names, pose.T, strict=True))


def quaternion_columns(T: np.ndarray) -> dict[str, np.ndarray]:
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    names = ("x[m]", "y[m]", "z[m]", "qx", "qy", "qz", "qw")
    return dict(zip(names, np.hstack([T[:, :3, 3], quaternion]).T, strict=True))


def force_columns(force: np.ndarray, prefix: str = "force_") -> dict[str, np.ndarray]:
    return {f"{prefix}{axis}[N]": column for axis, column in zip("xyz", force.T, strict=True)}
