"""Readings on the arm as built: what was worked out with the arm as drawn is worked out anew.

A dataset holds joints as they were read, and by the kinematics of the arm as drawn: how far the
controller meant to go, how the force lies in base, and how the tracker stands. With the calibrated
arm, from joints ``q`` and those of the reference ``q_0``,

    dp_c' = dp_c + (p_b(q) - p_b(q_0)) - (p_d(q) - p_d(q_0)),    f' = R_b(q) R_d(q)^T f,
    dp_m' = R dp_m,

where ``p`` is the marker and ``R_d``, ``R_b`` the attitude of the tool as drawn and as built, and
``R`` turns the station as it was registered into the one that the markers give on the arm as built.
"""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset, write_vector
from elastocal.errors import present
from elastocal.findings import Finding, Kind
from elastocal.identification import reference_joints
from elastocal.procedure.derive.readings import robot_errors
from elastocal.procedure.registration import Registration, UnloadedReadings, register
from elastocal.results import brief_repr
from elastocal.robot import BUILT_MARK, Robot, parse_urdf

STATIONS_AS_DRAWN = Kind(
    "derive.stations-as-drawn",
    "the readings do not say where the tracker saw the marker: its stations are registered on the"
    " arm as drawn",
    advice="Make the dataset again (`elastocal derive`, `elastocal import`) and calibrate with it.",
)
NOT_REGISTERED = Kind(
    "derive.not-registered-as-built",
    "station {station} is registered on the arm as drawn: {why}",
)


@brief_repr
@dataclass(frozen=True, eq=False)
class RebuiltReadings:
    """A dataset on the arm as built."""

    dataset: Dataset
    findings: tuple[Finding, ...] = ()
    """Parts that are still nominal."""


def is_of_arm_as_drawn(dataset: Dataset, robot: Robot) -> bool:
    """Return whether a dataset was worked out with the drawing of an arm that is known as built."""
    known = dataset.robot_urdf is not None and dataset.tcp_frame is not None
    return known and BUILT_MARK in robot.urdf and BUILT_MARK not in str(dataset.robot_urdf)


def on_arm_as_built(
    dataset: Dataset, built: Robot, marker: tuple[float, float, float] | None
) -> RebuiltReadings:
    """Return a dataset worked out with the arm as built.

    Parameters
    ----------
    dataset : Dataset
        One that names the arm as drawn; another comes back as it is.
    built : Robot
        The same arm as built (`elastocal.geometry.GeometryModel.as_built`).
    marker : tuple of float, optional
        Marker in the tcp frame as the geometry found it, in m; by default the dataset's.

    Raises
    ------
    DatasetError
        If the joints are not those of the arm.
    """
    if not is_of_arm_as_drawn(dataset, built) or dataset.marker_displacement is None:
        return RebuiltReadings(dataset)
    drawn = Robot.from_urdf(present(dataset.robot_urdf, "robot_urdf"), dataset.tcp_frame or "")
    links = {str(link.get("name")) for link in parse_urdf(built.urdf).findall("link")}
    if built.tip != drawn.tip and drawn.tip in links:
        # Another tool of it is meant: force and marker of the dataset are of its own.
        own = Robot.from_urdf(built.urdf, drawn.tip, built.base)
        built, marker = replace(own, gravity=built.gravity), None
    dataset = replace(dataset, reference_joint_position=_references(dataset, drawn))
    order = [dataset.joint_names.index(name) for name in built.joint_names]
    lever = dataset.marker or (0.0, 0.0, 0.0)
    found = marker if marker is not None and dataset.marker is not None else lever
    arms = _Arms(drawn, built, np.array(lever), np.array(found), order)
    turn, turn_0 = arms.turns(dataset)
    stations, findings = _stations(dataset, arms)
    seen = present(dataset.marker_displacement, "marker_displacement").copy()
    position = None if dataset.marker_position is None else dataset.marker_position.copy()
    for fit in stations.stations:
        rows = np.isin(dataset.poses, fit.poses)
        R, t = fit.T_base_tracker[:3, :3], fit.T_base_tracker[:3, 3]
        seen[rows] = seen[rows] @ R.T
        if position is not None:
            position[rows] = position[rows] @ R.T + t
    stated = {"robot_urdf": built.urdf, "tcp_frame": built.tip}
    stated |= {} if dataset.marker is None else {"marker": write_vector(found)}
    return RebuiltReadings(
        replace(
            dataset,
            force=(turn @ dataset.force[..., None])[..., 0],
            moment=_turned(turn, dataset.moment),
            reference_force=_turned(turn_0, dataset.reference_force),
            tcp_position=None
            if dataset.tcp_position is None
            else dataset.tcp_position + arms.shift(dataset),
            controller_displacement=dataset.controller_displacement + arms.gain(dataset),
            marker_displacement=seen,
            marker_position=position,
            attributes={**dataset.attributes, **stated},
        ),
        findings,
    )


def _turned(turn: FloatArray, vectors: FloatArray | None) -> FloatArray | None:
    return None if vectors is None else (turn @ vectors[..., None])[..., 0]


def _references(dataset: Dataset, drawn: Robot) -> FloatArray:
    """Return the joints at which the zero was read, shape (pose, joint), in the dataset's order.

    Where they were not recorded, they are those at which the displacement began.
    """
    if dataset.reference_joint_position is not None:
        return dataset.reference_joint_position
    readings = dataset.readings(drawn.joint_names)
    zero, q_0 = (
        np.full((len(dataset.poses), len(drawn.joint_names)), np.nan),
        dict[int, list[FloatArray]](),
    )
    for pose, each in zip(readings.pose.tolist(), reference_joints(drawn, readings), strict=True):
        q_0.setdefault(pose, []).append(each)
    for pose, each in q_0.items():
        zero[dataset.poses.index(pose)] = np.mean(each, axis=0)
    order = [drawn.joint_names.index(name) for name in dataset.joint_names]
    return np.asarray(zero[:, order])


@dataclass(frozen=True, eq=False)
class _Arms:
    """An arm as drawn and as built, with the marker of each."""

    drawn: Robot
    built: Robot
    lever: FloatArray
    """Marker in the tcp as drawn, shape (3,), in m."""
    found: FloatArray
    """Marker in the tcp as built, shape (3,), in m."""
    order: list[int]
    """Of the dataset's joints, in the order of the arms."""

    def gain(self, dataset: Dataset) -> FloatArray:
        """Return by how much a displacement is larger as built, shape (pose, load_case, 3)."""
        q, q_0 = self._joints(dataset)
        built = _marker(self.built, q, self.found) - _marker(self.built, q_0, self.found)
        drawn = _marker(self.drawn, q, self.lever) - _marker(self.drawn, q_0, self.lever)
        return np.asarray(built - drawn)

    def shift(self, dataset: Dataset) -> FloatArray:
        """Return how far the tcp is at the reference from where it is drawn, shape (pose, 3)."""
        _, q_0 = self._joints(dataset)
        built, drawn = (_forward(arm, q_0[:, 0])[:, :3, 3] for arm in (self.built, self.drawn))
        return np.asarray(built - drawn)

    def turns(self, dataset: Dataset) -> tuple[FloatArray, FloatArray]:
        """Return the rotations from directions as drawn: of readings and of references.

        Returns
        -------
        ndarray, shape (pose, load_case, 3, 3), and ndarray, shape (pose, 3, 3)
        """
        q, q_0 = self._joints(dataset)
        return self._turn(q), self._turn(q_0[:, 0])

    def _turn(self, q: FloatArray) -> FloatArray:
        built, drawn = (_forward(arm, q)[..., :3, :3] for arm in (self.built, self.drawn))
        return np.asarray(built @ np.swapaxes(drawn, -1, -2))

    def _joints(self, dataset: Dataset) -> tuple[FloatArray, FloatArray]:
        q_0 = present(dataset.reference_joint_position, "reference_joint_position")
        return dataset.joint_position[..., self.order], q_0[:, None, self.order]


def _forward(robot: Robot, q: FloatArray) -> FloatArray:
    """Return poses of the tool, shape (..., 4, 4); NaN where joints are not known."""
    known = np.isfinite(q).all(axis=-1)
    T = np.full((*q.shape[:-1], 4, 4), np.nan)
    T[known] = robot.forward(q[known])
    return T


def _marker(robot: Robot, q: FloatArray, lever: FloatArray) -> FloatArray:
    T = _forward(robot, q)
    return np.asarray(T[..., :3, 3] + T[..., :3, :3] @ lever)


def _stations(dataset: Dataset, arms: _Arms) -> tuple[Registration, tuple[Finding, ...]]:
    """Return how each station is registered on the arm as built, seen from that as drawn."""
    at, q_0 = dataset.marker_position, present(dataset.reference_joint_position, "reference")
    station_of = {pose: name for name, poses in dataset.stations.items() for pose in poses}
    rows = [
        row
        for row, pose in enumerate(dataset.poses)
        if at is not None and pose in station_of and np.isfinite([*at[row], *q_0[row]]).all()
    ]
    q = q_0[rows][:, arms.order]
    sigma = np.full((len(rows), 1), np.nan)
    if dataset.marker_sigma is not None:
        sigma = np.asarray(dataset.marker_sigma[rows].max(axis=2))
    seen = UnloadedReadings(
        pose=np.array(dataset.poses, dtype=np.intp)[rows],
        station=tuple(station_of[dataset.poses[row]] for row in rows),
        position=np.empty((0, 3)) if at is None else at[rows],
        sigma=np.where(np.isnan(sigma), 0.0, sigma).max(axis=1, initial=0.0),
        T_base_tcp=_forward(arms.built, q),
        robot_error=robot_errors(arms.built, q, np.array(arms.built.gravity), arms.found),
    )
    found = register(seen, arms.found)
    if not rows:
        return found, (STATIONS_AS_DRAWN(),)
    lost = found.unregistered.items()
    return found, tuple(NOT_REGISTERED(station=name, why=why) for name, why in lost)
