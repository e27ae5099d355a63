"""Checks of every load case at a pose (paper section 4.1): ``friction``, ``torque``, ``sensor``.

The disk sticks; gravity and load stay within the actuators' torques; the load stays within the
force sensor's ranges, lever arm included.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.checks.check import PostureCheck
from elastocal.planning.postures import Postures
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr
from elastocal.robot import GRAVITY, Robot
from elastocal.wording import phrase

_NO_LOAD = 1e-9
"""Torque in N·m below which a load case does not load a joint."""


@brief_repr
@dataclass(frozen=True, eq=False)
class FrictionCheck(PostureCheck):
    """``mu fz / safety - |f_lateral|``, the smallest over the load cases; alike at every pose."""

    force_tcp: FloatArray
    """Force on the robot in each load case, tcp frame, shape (load_case, 3), in N."""
    mu: float
    """Coefficient of static friction between disk and surface."""
    safety: float
    """Factor by which the friction must exceed the lateral force, at least 1."""
    name: str = "friction"
    unit: str = "N"
    advice: str = phrase(
        "press harder, ask for less lateral force, or use a disk with more friction"
    )
    order: ClassVar[int] = 50

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self:
        """Return the check of the load cases."""
        loads = cell.file.load_cases
        return cls(loads.force_tcp, loads.friction, loads.safety)

    @property
    def everywhere(self) -> float:
        """Margin at whatever posture, in N."""
        lateral = np.hypot(self.force_tcp[:, 0], self.force_tcp[:, 1])
        # Pushing onto the surface is a force on the robot along -z of the tcp.
        held = self.mu * -self.force_tcp[:, 2] / self.safety
        return float(np.min(held - lateral))

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,), in N."""
        return np.full(len(postures), self.everywhere)


@brief_repr
@dataclass(frozen=True, eq=False)
class TorqueCheck(PostureCheck):
    """Smallest part of a joint's allowed torque that is left, over joints, loads and places.

    In every load case, and unloaded, in contact and at the approach pose: pressing on a surface
    below it relieves an arm, so that its own weight may be the larger load. Standing still under
    a force ``f`` on the robot at the tcp, the actuators supply

        tau = g(q) - J^T f - J_com^T (m g),

    with ``g`` the arm's gravity torques and ``m g`` the weight of the tool at its centre of mass.
    """

    robot: Robot
    force_tcp: FloatArray
    """Force on the robot in each load case, tcp frame, shape (load_case, 3), in N."""
    torque_limits: FloatArray
    """Continuous torque of each joint, shape (joint,), in N·m (N); NaN: not known, not judged."""
    tool_mass: float
    """Mass behind the flange in kg."""
    tool_centre: FloatArray
    """Its centre of mass in the tcp frame, shape (3,), in m."""
    gravity: tuple[float, float, float] = GRAVITY
    """In base, in m/s²."""
    name: str = "torque"
    unit: str = "1"
    advice: str = phrase(
        "lower the forces, bring the tooling nearer, or give the true continuous torques"
    )
    order: ClassVar[int] = 60

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of the actuators; None when the torque of no joint is known.

        Limits of the URDF alone are not judged on an arm without masses, since the torque of its
        weight is unknown; those that the cell file states are (`require_loads_possible_anywhere`
        refuses them).
        """
        if not (cell.robot.has_masses or cell.file.limits.torque.values):
            return None
        check = cls(
            cell.robot,
            np.array([*cell.file.presses.values()]),
            cell.torque_limits,
            cell.file.tool.mass,
            cell.tool_centre_tcp,
            tuple(cell.gravity_base.tolist()),
        )
        return check if check.judged else None

    @property
    def judged(self) -> tuple[str, ...]:
        """Names of the joints whose torque is known."""
        known = np.isfinite(self.torque_limits)
        return tuple(
            name for name, is_known in zip(self.robot.joint_names, known, strict=True) if is_known
        )

    def torques(self, postures: Postures) -> FloatArray:
        """Return the static torques in contact, shape (load_case, pose, joint), in N·m (N)."""
        jacobian = self.robot.jacobian(postures.q)
        R_base_tcp = postures.T_base_tcp[:, :3, :3]
        lever = R_base_tcp @ self.tool_centre
        J_com = jacobian.translation + np.cross(jacobian.rotation, lever[..., None], axis=-2)
        weight = self.tool_mass * np.asarray(self.gravity)
        resting = self.robot.gravity_torques(postures.q, self.gravity)
        resting = resting - np.einsum("pij,i->pj", J_com, weight)
        force = np.einsum("pij,lj->lpi", R_base_tcp, self.force_tcp)
        return np.asarray(resting - np.einsum("pij,lpi->lpj", jacobian.translation, force))

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,): 1 is unloaded, 0 at the limit."""
        known = np.isfinite(self.torque_limits)
        if not np.any(known):
            return np.ones(len(postures))
        unloaded = replace(self, force_tcp=np.zeros((1, 3)))
        # The tool is turned at the approach pose as it is in contact.
        away = replace(postures, q=postures.q_approach)
        torques = [self.torques(postures), unloaded.torques(postures), unloaded.torques(away)]
        used = np.abs(np.concatenate(torques)[..., known]) / self.torque_limits[known]
        return np.asarray(1.0 - used.max(axis=(0, 2)))

    def bearable(self, postures: Postures) -> FloatArray:
        """Return by what the load cases may be multiplied, shape (pose,), until a joint gives in.

        0 or less where the weight of arm and tool alone is too much.
        """
        known = np.isfinite(self.torque_limits)
        resting = replace(self, force_tcp=np.zeros((1, 3))).torques(postures)[..., known]
        load = self.torques(postures)[..., known] - resting
        room = self.torque_limits[known] - np.sign(load) * resting
        share = room / np.maximum(np.abs(load), _NO_LOAD)
        return np.asarray(share.min(axis=(0, 2), initial=np.inf))


@brief_repr
@dataclass(frozen=True, eq=False)
class SensorCheck(PostureCheck):
    """Smallest part of a sensor range that is left, over axes and load cases.

    The sensor measures the force in its own frame and, at its lever arm, the moment ``r x f``; both
    ends of the tool's weight (pointing any way) are added as a safe bound.
    """

    force_tcp: FloatArray
    """Force on the robot in each load case, tcp frame, shape (load_case, 3), in N."""
    T_sensor_tcp: FloatArray
    """Tcp in the sensor frame, shape (4, 4), in m."""
    force_range: FloatArray
    """Largest force of each axis, shape (3,), in N."""
    moment_range: FloatArray
    """Largest moment of each axis, shape (3,), in N·m."""
    tool_weight: float = 0.0
    """Weight carried by the sensor, in N."""
    tool_lever: float = 0.0
    """Distance of that weight from the sensor, in m."""
    name: str = "sensor"
    unit: str = "1"
    advice: str = phrase("lower the forces, shorten the tool, or use a sensor with a larger range")
    order: ClassVar[int] = 70

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of the cell's sensor; None without one."""
        sensor, T_sensor_tcp = cell.file.sensor, cell.T_sensor_tcp
        if sensor is None or T_sensor_tcp is None:
            return None
        centre = T_sensor_tcp[:3, :3] @ cell.tool_centre_tcp + T_sensor_tcp[:3, 3]
        return cls(
            np.array([*cell.file.presses.values()]),
            T_sensor_tcp,
            sensor.largest_force,
            sensor.largest_moment,
            cell.file.tool.mass * float(np.linalg.norm(cell.gravity_base)),
            float(np.linalg.norm(centre)),
        )

    @property
    def everywhere(self) -> float:
        """Margin at whatever posture: 1 is unloaded, 0 at the limit."""
        R, r = self.T_sensor_tcp[:3, :3], self.T_sensor_tcp[:3, 3]
        force = self.force_tcp @ R.T
        moment = np.cross(r, force)
        used = np.maximum(
            (np.abs(force) + self.tool_weight) / self.force_range,
            (np.abs(moment) + self.tool_weight * self.tool_lever) / self.moment_range,
        )
        return 1.0 - float(used.max())

    def margin(self, postures: Postures) -> FloatArray:
        """Return the margin of each posture, shape (pose,): 1 is unloaded, 0 at the limit."""
        return np.full(len(postures), self.everywhere)
