"""Check ``torque``: gravity and load stay within the actuators' torques (paper section 4.1).

In every load case, and unloaded, in contact and at the approach pose: pressing on a surface below
it relieves an arm, so that its own weight may be the larger load. Standing still under a force
``f`` on the robot at the tcp, the actuators supply

    tau = g(q) - J^T f - J_com^T (m g),

with ``g`` the arm's gravity torques and ``m g`` the weight of the tool at its centre of mass.
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


@brief_repr
@dataclass(frozen=True, eq=False)
class TorqueCheck(PostureCheck):
    """Smallest part of a joint's allowed torque that is left, over joints, loads and places."""

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
    advice: str = "lower the forces, bring the tooling nearer, or give the true continuous torques"
    order: ClassVar[int] = 60

    @classmethod
    def of(cls, cell: Cell, surface: Surface) -> Self | None:
        """Return the check of the actuators; None when the torque of no joint is known."""
        check = cls(
            cell.robot,
            cell.file.load_cases.force_tcp,
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
