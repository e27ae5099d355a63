"""What a cell records of an arm under load that is not as drawn; no equation of the fit is used.

As a cell does, that knows the drawing alone: the sensor sits on the tool, and its force is turned
into base by the attitude as drawn; the tracker is registered by a rigid fit of the unloaded marker
to where the drawing has it; the controller's displacement is that of the drawing.
"""

import re

import numpy as np

from elastocal.dataset import Dataset
from elastocal.robot import Robot, with_tool
from support.measured_arms import MARKERS, Measured, kuka

SPRINGS = np.array([3e-7, 4e-7, 5e-7, 1.6e-6, 1.9e-6, 3.2e-6])
"""Of the joints, in rad/(N·m)."""
_APPROACH = 1.5e-3
"""How far each joint goes from the reference to the press, in rad: some 4 mm at the tool."""


def acquire(  # noqa: PLR0913 (a campaign has as many properties)
    measured: Measured,
    *,
    seed: int = 0,
    poses: int = 24,
    press: float = 900.0,
    tracker: float = 3e-6,
    sensor: float = 0.5,
    marker: np.ndarray = MARKERS[0],
    with_places: bool = True,
    springs: np.ndarray = SPRINGS,
) -> Dataset:
    """Return the dataset of a campaign: three presses a pose, the second station after half of it.

    Parameters
    ----------
    measured : Measured
        The arm as drawn and as it is.
    seed, poses : int
        Of the noise; number of poses.
    press, tracker, sensor : float
        Force along the tool in N; noise of an averaged coordinate in m, and of a force in N.
    marker : ndarray, shape (3,)
        Where the cell believes the marker to be, in m; it is at ``MARKERS[0]``.
    with_places : bool
        Whether it is recorded where the marker was seen.
    springs : ndarray, shape (joint,)
        What is planted, in rad/(N·m).
    """
    rng, drawn, true = np.random.default_rng(seed), measured.robot, measured.truth
    middle, reach = [0.0, -1.35, 1.15, 0.0, 0.95, 0.0], [1.2, 0.45, 0.55, 1.5, 0.45, 2.0]
    q_0 = np.array(middle) + np.array(reach) * rng.uniform(-1.0, 1.0, (poses, 6))
    aside = 0.3 * press
    tools = np.array([[0.0, 0.0, -press], [aside, 0.0, -press], [0.0, aside, -press]])
    q = q_0[:, None] + rng.normal(0.0, _APPROACH, (poses, len(tools), 6))
    felt = np.einsum("plij,lj->pli", true.forward(q)[..., :3, :3], tools)
    torque = np.einsum("plij,pli->plj", jacobian(true, q), felt)
    station = np.arange(poses) * 2 // poses
    at_zero = _seen(measured, station, _point(true, q_0, MARKERS[0])[:, None])[:, 0]
    loaded = _seen(measured, station, _point(true, q + springs * torque, MARKERS[0]))
    at_zero = at_zero + rng.normal(0.0, tracker, at_zero.shape)
    loaded = loaded + rng.normal(0.0, tracker, loaded.shape)
    shown = tools + rng.normal(0.0, sensor, felt.shape)
    expected = _point(drawn, q_0, marker)
    R, t = np.empty((poses, 3, 3)), np.empty((poses, 3))
    for number in range(2):
        mine = station == number
        R[mine], t[mine] = _rigid(at_zero[mine], expected[mine])
    names = np.array(["left", "right"])[station]
    return Dataset.from_arrays(
        joint_position=q,
        reference_joint_position=q_0,
        force=np.einsum("plij,plj->pli", drawn.forward(q)[..., :3, :3], shown),
        controller_displacement=_point(drawn, q, marker) - expected[:, None],
        marker_displacement=np.einsum("pij,plj->pli", R, loaded - at_zero[:, None]),
        marker_position=np.einsum("pij,pj->pi", R, at_zero) + t if with_places else None,
        stations={n: np.flatnonzero(names == n).tolist() for n in ("left", "right")}
        if with_places
        else None,
        tcp_position=drawn.forward(q_0)[:, :3, 3],
        joint_names=drawn.joint_names,
        load_cases=("normal", "north", "east"),
        robot_name=drawn.name,
        robot_urdf=drawn.urdf,
        tcp_frame=drawn.tip,
        marker=tuple(marker.tolist()),
    )


def _point(robot: Robot, q: np.ndarray, point: np.ndarray) -> np.ndarray:
    T = robot.forward(q)
    return T[..., :3, 3] + T[..., :3, :3] @ point


def jacobian(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return how the tcp moves by the joints, by central differences, shape (..., 3, joint)."""
    step = 1e-6
    columns = [
        (robot.forward(q + step * e)[..., :3, 3] - robot.forward(q - step * e)[..., :3, 3])
        / (2.0 * step)
        for e in np.eye(q.shape[-1])
    ]
    return np.stack(columns, axis=-1)


def _seen(measured: Measured, station: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (pose, n, 3) in the frames of the stations that look at the poses."""
    T = measured.T_station_base[station]
    return np.einsum("pij,pnj->pni", T[:, :3, :3], points) + T[:, None, :3, 3]


def _rigid(here: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotation and the shift that take points nearest to others (Kabsch 1976)."""
    a, b = here.mean(axis=0), there.mean(axis=0)
    U, _, Vt = np.linalg.svd((here - a).T @ (there - b))
    R = Vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ U.T
    return R, b - R @ a


def tooled() -> Robot:
    """Return six axes with a tool that stands off the last one, so that forces turn it too.

    They weigh nothing, so that no sag comes into the places of the unloaded marker.
    """
    robot, X = kuka(), np.eye(4)
    X[:3, 3] = (0.18, 0.0, 0.32)
    weightless = re.sub(r"<inertial>.*?</inertial>", "", robot.urdf, flags=re.DOTALL)
    return Robot.from_urdf(with_tool(weightless, robot.tip, "tool", X), "tool")
