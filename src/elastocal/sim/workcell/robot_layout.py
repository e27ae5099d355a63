"""Where the simulated robot gives way, and how much: from the cell file to springs.

From the foot to the tool: floor or rail carriage (three turns about the foot), the drives of
external axes, per arm joint a gear and two tilts of its bearing, a hinge pair in the middle of
each of the two long links, and the end-effector (three turns and three shifts at the sensor).
Six or eighteen springs at the joints can express none but the gears and tilts, and those only
where they are linear.

Figures that the file leaves out are those of `elastocal.sim.arm.elastic_arm` for an arm of 1.1 t,
in proportion to the mass that the arm moves: an assumption that brings a small robot to the right
order of magnitude.
"""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import DeviceError
from elastocal.robot import (
    inverse_transform,
)
from elastocal.sim.arm.elastic_arm import AXIAL_STIFFNESS, LINK_BENDING, across, link_vector, triple
from elastocal.sim.arm.linkage import Linkage
from elastocal.sim.arm.springs import Linear, Skeleton, TruthSpring, lay_out
from elastocal.sim.workcell.springs import BalancerSpring, GearLaws, RobotSprings

ARM_JOINTS = 6
MOVED_MASS = 850.0
"""Mass in kg that an arm of 1.1 t moves: all but its foot."""
BALANCER_RATE = 5.5e4
"""Of the balancer's spring on such an arm, in N/m: 3 kN·m with the arm stretched out."""
HIGH_TORQUE = 1.65
"""Stiffness of a gear at high torque over that of a straight line through measured deflections, to
which play, bending links and floor add. An assumption."""
_SHORT_LINK = 0.2
"""A link shorter than this does not bend, in m."""


@dataclass(frozen=True, eq=False)
class RobotLayout:
    """Skeleton and springs of the simulated robot."""

    linkage: Linkage
    skeleton: Skeleton
    springs: RobotSprings
    sensor_after: int
    """Number of elements in front of the body that carries the sensor."""
    external: int
    """Number of joints before the arm."""


def lay_out_robot(cell: Cell) -> RobotLayout:
    """Return the simulated robot of a cell.

    Raises
    ------
    DeviceError
        If the robot has fewer than six joints.
    RobotError
        If the simulator cannot read its URDF.
    """
    linkage = Linkage.from_urdf(cell.robot.urdf, cell.robot.tip, cell.robot.base)
    names, external = linkage.joint_names, len(linkage.joint_names) - ARM_JOINTS
    if external < 0:
        raise DeviceError(
            f"the simulated arm needs six joints; {linkage.name} has {len(names)}"
            f" ({', '.join(names)})"
        )
    truth, scale = cell.file.simulation, cell.file.simulation.truth
    size = _size(linkage, external)
    usual = size * HIGH_TORQUE * np.array(AXIAL_STIFFNESS)
    stiffness = scale.gears * np.array(truth.gears.stiffness or usual)
    gears = [
        _spring(linkage, external + i, linkage.axis[external + i], float(k))
        for i, k in enumerate(stiffness)
    ]
    bearings = scale.bearings / scale.gears * np.array(truth.bearings.ratio)
    bending = scale.links * (truth.links.bending or size * LINK_BENDING)
    springs = [
        *_drives(cell, linkage, external),
        *_floor(linkage, external, scale.floor * truth.floor.tilt),
        *gears,
        *(s for i, k in enumerate(stiffness) for s in _tilts(linkage, external + i, k * bearings)),
        *(s for i in (1, 2) for s in _bending(linkage, names[external + i], bending)),
        *_end_effector(cell, linkage),
    ]
    skeleton = lay_out(linkage, springs)
    return RobotLayout(
        linkage,
        skeleton,
        _robot_springs(cell, linkage, skeleton, gears, size),
        skeleton.ends[-1] - 6,
        external,
    )


def _robot_springs(
    cell: Cell, linkage: Linkage, skeleton: Skeleton, gears: list[TruthSpring], size: float
) -> RobotSprings:
    stiffness = np.array([_stiffness(spring) for spring in skeleton.springs])
    order = [id(spring) for spring in skeleton.springs]
    which = np.array([order.index(id(gear)) for gear in gears])
    laws = GearLaws.of(cell.file.simulation.gears, which, stiffness[which])
    balancer = _balancer(cell, linkage, size)
    return RobotSprings(stiffness, laws, None, balancer, int(which[1]), np.zeros(()))


def _size(linkage: Linkage, external: int) -> float:
    """Return the mass that the arm moves over that of a 1.1 t arm; 1 when it is not known."""
    moved = sum(body.mass for body in linkage.masses if body.joint > external)
    return moved / MOVED_MASS if moved > 0.0 else 1.0


def _stiffness(spring: TruthSpring) -> float:
    law = spring.law
    assert isinstance(law, Linear)
    return law.k


def _spring(linkage: Linkage, joint: int, axis: FloatArray, stiffness: float) -> TruthSpring:
    name, revolute = linkage.joint_names[joint], linkage.revolute[joint]
    return TruthSpring(name, triple(axis), Linear(stiffness), revolute)


def _drives(cell: Cell, linkage: Linkage, external: int) -> list[TruthSpring]:
    entry, scale = cell.file.simulation.external, cell.file.simulation.truth.external
    stiffness = {True: scale * entry.turning, False: scale * entry.linear}
    return [
        _spring(linkage, joint, linkage.axis[joint], stiffness[linkage.revolute[joint]])
        for joint in range(external)
    ]


def _floor(linkage: Linkage, external: int, tilt: float) -> list[TruthSpring]:
    """Return turns about the point of axis 1 that is nearest to the origin of base."""
    T_base_joint, screws = linkage.T_base_joint[external], linkage.screws
    axis, point = screws.axis[external], screws.point[external]
    foot = point - axis * (axis @ point)
    at = triple(T_base_joint[:3, :3].T @ (foot - point))
    name = linkage.joint_names[external]
    return [TruthSpring(name, triple(T_base_joint[k, :3]), Linear(tilt), at=at) for k in range(3)]


def _tilts(linkage: Linkage, joint: int, stiffness: FloatArray) -> list[TruthSpring]:
    name = linkage.joint_names[joint]
    return [
        TruthSpring(name, triple(direction), Linear(float(k)))
        for direction, k in zip(across(linkage.axis[joint]), stiffness, strict=True)
    ]


def _bending(linkage: Linkage, joint: str, stiffness: float) -> list[TruthSpring]:
    """Return two hinges in the middle of a link across it; none for a short one."""
    index = linkage.joint_names.index(joint)
    ends = linkage.T_base_joint[index : index + 2, :3, 3]
    if not np.linalg.norm(ends[1] - ends[0]) > _SHORT_LINK:
        return []
    link = link_vector(linkage, joint)
    at = triple(0.5 * link)
    return [
        TruthSpring(joint, triple(direction), Linear(stiffness), distal=True, at=at)
        for direction in across(link / np.linalg.norm(link))
    ]


def _end_effector(cell: Cell, linkage: Linkage) -> list[TruthSpring]:
    """Return three turns and three shifts at the sensor, last of all springs."""
    entry, scale = cell.file.simulation.end_effector, cell.file.simulation.truth.end_effector
    T_tcp_sensor = cell.T_tcp_flange
    if cell.file.sensor is not None:
        T_tcp_sensor = cell.T_tcp_flange @ cell.file.sensor.T_flange_sensor
    T = inverse_transform(linkage.T_base_joint[-1]) @ linkage.T_base_tip @ T_tcp_sensor
    at, name = triple(T[:3, 3]), linkage.joint_names[-1]
    kinds = ((True, scale * entry.turn), (False, scale * entry.shift))
    return [
        TruthSpring(name, triple(T[:3, k]), Linear(stiffness), turns, distal=True, at=at)
        for turns, stiffness in kinds
        for k in range(3)
    ]


def _balancer(cell: Cell, linkage: Linkage, size: float) -> BalancerSpring | None:
    """Return the balancer of axis 2, tuned for the way the robot is mounted.

    Upright is where the link behind axis 2 points along axis 1 against gravity. Without a link,
    or with axis 1 level (a robot on a wall), no spring balances the arm.
    """
    entry, scale = cell.file.simulation.balancer, cell.file.simulation.truth.balancer
    first = len(linkage.joint_names) - ARM_JOINTS
    screws, arm = linkage.screws, linkage.T_base_joint[first + 2, :3, 3]
    up = -screws.axis[first] * (screws.axis[first] @ cell.gravity_base)
    axis = screws.axis[first + 1]
    link, up = (v - axis * (axis @ v) for v in (arm - screws.point[first + 1], up))
    if not entry.fitted or not min(np.linalg.norm(link), np.linalg.norm(up)) > 1e-6:
        return None
    upright = math.atan2(float(axis @ np.cross(link, up)), float(link @ up))
    rate = scale * (entry.rate or size * BALANCER_RATE)
    return BalancerSpring(rate, entry.free_length, entry.anchor, entry.lever, upright)
