"""Checks of what an arm is told, before anything is begun."""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import CommandChecks
from elastocal.drivers.kuka_rsi._cycle import AMISS, Cycle
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, overshoot
from elastocal.drivers.kuka_rsi.messages import ProgramState
from elastocal.drivers.kuka_rsi.settings import Bounds
from elastocal.errors import DeviceError

_WRIST = math.radians(5.0)
"""Least |A5| at which the tool is moved straight: near 0 axes 4 and 6 run away."""


class RsiChecks(CommandChecks):
    """Checks of commands, with those of corrections."""

    def require_programmed_place(self, offset: FloatArray) -> None:
        """Refuse a joint move on top of a correction, base, shape (3,), in m.

        Raises
        ------
        DeviceError
            With its length.
        """
        size = float(np.linalg.norm(offset))
        self.require(
            size <= AMISS,
            "move_joints: correction at its begin",
            f"{1e3 * size:.2f} mm",
            f"at most {1e3 * AMISS:g} mm (adopt_position)",
        )


SOURCE = "kuka_rsi"
CHECKS = RsiChecks(SOURCE)
SILENT = 0.25
"""Time without a message after which the arm counts as stopped, in s."""
OUT = (ProgramState.ABSENT, ProgramState.ENDED)
"""States of a program that is not in its loop."""


def require_ready(cycle: Cycle, silent: float, mode: str) -> None:
    """Refuse to enable an arm while anything stands against it.

    Without a force it may be enabled: a tool must come off the surface without one.

    Parameters
    ----------
    cycle : Cycle
        The newest state.
    silent : float
        Its age, in s.
    mode : str
        Of the settings.

    Raises
    ------
    DeviceError
        With what stands against it.
    """
    why = None
    if mode != "contact":
        why = f"mode {mode} moves nothing: devices.arm.mode must be contact"
    elif not silent <= SILENT:
        why = f"no message from the controller for {silent:.2f} s"
    elif cycle.state in OUT:
        why = "the program elcal_run on the controller is not in its loop: select and start it"
    if why is not None:
        raise DeviceError(f"{SOURCE} cannot be enabled: {why}")


@dataclass(frozen=True)
class StraightMoveRules:
    """What straight moves keep to."""

    bounds: Bounds
    law: ForceLaw
    delay: float
    """From force to standstill, in s."""

    def require_room(self, command: str, end: FloatArray, speed: float) -> None:
        """Refuse a move that leaves what corrections may do.

        Parameters
        ----------
        command : str
            Name of the command.
        end : ndarray, shape (3,)
            Correction at its end, base, in m.
        speed : float
            In m/s.
        """
        bounds, size = self.bounds, float(np.linalg.norm(end))
        CHECKS.require(
            size <= bounds.correction,
            f"{command}: correction at its end",
            f"{1e3 * size:.1f} mm",
            f"at most {1e3 * bounds.correction:g} mm (largest_correction)",
        )
        CHECKS.require(
            speed <= bounds.speed,
            f"{command} speed",
            f"{1e3 * speed:g} mm/s",
            f"at most {1e3 * bounds.speed:g} mm/s (correction_speed)",
        )

    def require_away(self, direction: FloatArray, approached: FloatArray | None) -> None:
        """Refuse a retract along a direction of an approach that felt a surface, both (3,)."""
        if approached is not None and not float(direction @ approached) < 0.0:
            raise DeviceError(
                f"{SOURCE}: retract direction {direction.tolist()} leads into the surface,"
                f" which was approached along {np.round(approached, 4).tolist()}"
            )

    def require_bent_wrist(self, q: FloatArray) -> None:
        """Refuse a move with axes 4 and 6 in line; joints of shape (joint,), A5 last but one."""
        bend = abs(math.remainder(float(q[-2]), math.pi))
        CHECKS.require(
            bend >= _WRIST,
            "A5",
            f"{math.degrees(bend):.1f} deg from straight",
            f"at least {math.degrees(_WRIST):g} deg for a straight move",
        )

    def require_gentle(self, speed: float, contact_force: float) -> None:
        """Refuse a guarded move that would press too hard before it stands."""
        if math.isinf(contact_force):
            return
        stiffness, room = self.law.stiffness, self.bounds.force - contact_force
        further = overshoot(speed, stiffness, self.delay)
        if not further <= room:
            allowed = max(room, 0.0) / (stiffness * self.delay)
            raise DeviceError(
                f"kuka_rsi refuses approach: at {1e3 * speed:.3g} mm/s it would press"
                f" {further:.0f} N beyond {contact_force:g} N before it stands (delay"
                f" {1e3 * self.delay:.0f} ms, stiffness {1e-6 * stiffness:.3g} N/um), force limit"
                f" {self.bounds.force:.0f} N: at most {1e3 * allowed:.2g} mm/s"
            )
