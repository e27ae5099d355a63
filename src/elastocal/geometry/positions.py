"""Absolute positions of markers on the tool, with what loaded the arm."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.arm import ArmErrors, JointLoads, frames
from elastocal.results import brief_repr
from elastocal.robot import ChainJoint, Robot

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


def joint_loads(robot: Robot, data: Positions, *, assumed: bool = False) -> JointLoads:
    """Return what weight, payload and process force ask of each joint.

    About the nominal axes: the errors of an arm of some millimetres change it by a thousandth.

    Parameters
    ----------
    robot : Robot
        The nominal arm.
    data : Positions
        Joints and loads.
    assumed : bool
        Whether the arm's masses are assumed, so that its own weight is told apart.

    Raises
    ------
    GeometryError
        If joints are not finite.
    """
    q, joints = data.q, robot.chain.joints
    if not np.isfinite(q).all():
        raise GeometryError("joints must be finite numbers")
    at = frames(robot, q, JointLoads.none(q), ArmErrors.none(len(joints)))
    T, gravity = at.T_base_tcp, np.asarray(robot.gravity, dtype=float)
    # Mass and first moment of all links that hang on a joint, from the tip back to the base.
    mass, first = 0.0, np.zeros((len(q), 3))
    hung, turning = np.zeros((2, len(joints), len(q), 3))
    for k in reversed(range(len(joints))):
        mass += joints[k].mass
        first = first + joints[k].mass * _centre(joints[k], q[:, k], at.rotation[k], at.origin[k])
        hung[k], turning[k] = mass * gravity, np.cross(first - mass * at.origin[k], gravity)
    centre = T[:, :3, 3] + np.einsum("nij,nj->ni", T[:, :3, :3], data.payload_centre)
    pull = data.payload[:, None] * gravity
    force = np.broadcast_to(pull + data.force, hung.shape)
    moment = np.cross(centre - at.origin, pull) + np.cross(T[:, :3, 3] - at.origin, data.force)
    revolute = np.array([joint.revolute for joint in joints])[:, None, None]

    def along(force: FloatArray, moment: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("jni,jni->nj", at.axis, np.where(revolute, moment, force)))

    others, weight = along(force, moment), along(hung, turning)
    local = np.einsum("jnki,jnk->nji", at.rotation, moment + turning)
    if assumed:
        return JointLoads(others, local, weight)
    return JointLoads(others + weight, local, np.zeros_like(weight))


def _centre(joint: ChainJoint, q: FloatArray, R: FloatArray, origin: FloatArray) -> FloatArray:
    """Return the centre of mass of the links behind a joint in base, shape (row, 3), in m."""
    if joint.revolute:
        turned = Rotation.from_rotvec(q[:, None] * joint.axis).apply(joint.centre_of_mass)
    else:
        turned = joint.centre_of_mass + q[:, None] * joint.axis
    return np.asarray(origin + np.einsum("nij,nj->ni", R, turned))
