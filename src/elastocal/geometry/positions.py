"""Absolute positions of markers on the tool, with what loaded the arm."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.arm import ArmErrors, frames
from elastocal.results import brief_repr
from elastocal.robot import Robot

LEAST_READINGS = 4
"""Fewer rows say nothing."""


@dataclass(frozen=True)
class Payload:
    """A mass at the tool, beyond what the robot's description has."""

    mass: float = 0.0
    """In kg."""
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the tcp, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Positions:
    """Rows of a measurement, in SI units; the arrays belong to the rows in order of time."""

    q: FloatArray
    """Joints by the controller, shape (row, joint), in rad or m."""
    markers: FloatArray
    """Markers in the frame of the row's station, shape (row, marker, 3), in m; NaN where hidden."""
    station: NDArray[np.str_]
    """Tracker station of each row, shape (row,)."""
    pose: IndexArray
    """Label of the pose, shape (row,): rows of one pose are kept together."""
    campaign: NDArray[np.str_]
    """Shape (row,)."""
    payload: FloatArray
    """Mass at the tool beyond what the URDF has, shape (row,), in kg."""
    payload_centre: FloatArray
    """Its centre in the tcp, shape (row, 3), in m."""
    force: FloatArray
    """Process force on the robot at the tcp, in base, shape (row, 3), in N."""
    lines: tuple[int, ...] = ()
    """Line of the file of each row."""

    @classmethod
    def unloaded(cls, q: FloatArray, payload: Payload) -> "Positions":
        """Return poses without measurement or contact, with a payload."""
        rows = len(q)
        return cls(
            q=q,
            markers=np.empty((rows, 0, 3)),
            station=np.full(rows, ""),
            pose=np.arange(rows),
            campaign=np.full(rows, ""),
            payload=np.full(rows, payload.mass),
            payload_centre=np.tile(np.array(payload.centre), (rows, 1)),
            force=np.zeros((rows, 3)),
        )

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.q)

    @property
    def seen(self) -> BoolArray:
        """Whether each marker was seen, shape (row, marker)."""
        return np.asarray(np.isfinite(self.markers).all(axis=2))

    @property
    def stations(self) -> tuple[str, ...]:
        """Stations in order of appearance."""
        return tuple(dict.fromkeys(self.station.tolist()))

    def rows(self, chosen: BoolArray | IndexArray) -> "Positions":
        """Return some of the rows."""
        own = {name: value for name, value in vars(self).items() if name != "lines"}
        lines = tuple(np.array(self.lines)[chosen].tolist()) if self.lines else ()
        return Positions(**{name: value[chosen] for name, value in own.items()}, lines=lines)


def joint_torques(robot: Robot, data: Positions) -> FloatArray:
    """Return the torques of weight, payload and process force, shape (row, joint).

    About the nominal axes: the errors of an arm of some millimetres change them by a thousandth.
    In N·m (N along a rail).

    Raises
    ------
    GeometryError
        If joints are not finite.
    """
    if not np.isfinite(data.q).all():
        raise GeometryError("joints must be finite numbers")
    gravity = np.asarray(robot.gravity, dtype=float)
    torque = np.zeros_like(data.q)
    if robot.has_masses:
        torque -= robot.gravity_torques(data.q)
    at = frames(robot, data.q, torque, ArmErrors.none(data.q.shape[1]))
    T = at.T_base_tcp
    centre = T[:, :3, 3] + np.einsum("nij,nj->ni", T[:, :3, :3], data.payload_centre)
    weight = data.payload[:, None] * gravity
    revolute = np.array([joint.revolute for joint in robot.chain.joints])[:, None]
    for point, force in ((centre, weight), (T[:, :3, 3], data.force)):
        about = np.einsum("jni,jni->jn", at.axis, np.cross(point - at.origin, force))
        along = np.einsum("jni,ni->jn", at.axis, force)
        torque += np.where(revolute, about, along).T
    return torque
