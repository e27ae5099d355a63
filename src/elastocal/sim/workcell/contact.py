"""The contact disk on the tooling: what gives way under a force, and when it slips.

The disk sinks in by ``f_n / k_n`` and the tooling yields by ``f_n / k_t`` along its normal; both
are true motion of the tool, which marker and controller see alike. Sideways the disk follows
Mindlin's law for a contact of which an outer ring slips already (R. D. Mindlin, "Compliance of
elastic bodies in contact", J. Appl. Mech. 16, 1949; K. L. Johnson, "Contact Mechanics", 1985, 7.2),

    shear = (3 mu f_n / 2 k_s) (1 - (1 - f_l / mu f_n)^(2/3)),

which starts as ``f_l / k_s`` and ends in full sliding at Coulomb's limit ``f_l = mu f_n``. It is
taken without its own hysteresis. The ring does not slip the same way twice: a random part of the
slip grows towards the limit.
"""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell

LIMIT = 0.999
"""Part of the friction limit that a sliding contact keeps up: its shear is finite."""


@dataclass(frozen=True)
class ContactLaw:
    """Disk, tooling and friction between them."""

    normal_stiffness: float
    """k_n in N/m."""
    shear_stiffness: float
    """k_s in N/m."""
    tooling_stiffness: float
    """k_t in N/m."""
    friction: float
    """mu."""
    micro_slip: float
    """Standard deviation of the random slip along each axis at half the limit, in m."""

    @classmethod
    def of(cls, cell: Cell) -> "ContactLaw":
        """Return the contact of a cell."""
        entry = cell.file.simulation.contact
        friction = entry.friction
        return cls(
            entry.normal_stiffness,
            entry.shear_stiffness,
            entry.tooling_stiffness,
            cell.file.load_cases.friction if friction is None else friction,
            entry.micro_slip,
        )

    def effort(self, force_tcp: FloatArray) -> float:
        """Return the lateral force over the friction limit; above 1 the contact slides.

        Parameters
        ----------
        force_tcp : ndarray, shape (3,)
            Force on the robot in the tcp frame, in N; it presses where z is below 0.
        """
        lateral = float(np.hypot(force_tcp[0], force_tcp[1]))
        if lateral == 0.0:
            return 0.0
        limit = self.friction * -float(force_tcp[2])
        return lateral / limit if limit > 0.0 else np.inf

    def held(self, force_tcp: FloatArray) -> FloatArray:
        """Return the force that friction lets build up, shape (3,), in N."""
        part = min(1.0, LIMIT / max(self.effort(force_tcp), 1e-12))
        held: FloatArray = force_tcp * np.array([part, part, 1.0])
        return held

    def shear(self, force_tcp: FloatArray) -> FloatArray:
        """Return how far the tool goes sideways, tcp frame, shape (3,), in m."""
        effort = self.effort(force_tcp)
        if effort == 0.0:
            return np.zeros(3)
        growth = 1.5 * (1.0 - (1.0 - min(effort, LIMIT)) ** (2.0 / 3.0)) / effort
        shear: FloatArray = -growth / self.shear_stiffness * force_tcp * np.array([1.0, 1.0, 0.0])
        return shear

    def slip_sigma(self, force_tcp: FloatArray) -> float:
        """Return the standard deviation of the random slip, in m."""
        effort = min(self.effort(force_tcp), 0.95)
        return self.micro_slip * effort / (1.0 - effort)


@dataclass(frozen=True, eq=False)
class Contact:
    """The disk on one place of the tooling."""

    law: ContactLaw
    anchor: FloatArray
    """Where the tool is without any force, in base, shape (3,), in m; moves when it slips."""
    R_base_tcp: FloatArray
    """Orientation that the controller keeps, shape (3, 3)."""
    normal: FloatArray
    """Outward normal of the tooling in base, shape (3,)."""
    q_touch: FloatArray
    """Joints at which the tool touches without force, shape (joint,), in rad or m."""

    def tool_position(self, force_base: FloatArray) -> FloatArray:
        """Return where the tool is under a force on the robot, in base, shape (3,), in m."""
        force_tcp = self.R_base_tcp.T @ force_base
        sunk = -force_tcp * np.array([0.0, 0.0, 1.0]) / self.law.normal_stiffness
        tooling = -self.normal * (self.normal @ force_base) / self.law.tooling_stiffness
        moved: FloatArray = self.R_base_tcp @ (sunk + self.law.shear(force_tcp)) + tooling
        return self.anchor + moved

    def slipped(self, lateral_tcp: FloatArray) -> "Contact":
        """Return the contact after a slip, tcp frame, shape (2,), in m."""
        return replace(self, anchor=self.anchor + self.R_base_tcp[:, :2] @ lateral_tcp)
