"""Checks of what an arm is told, before anything is begun."""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.force_control import ForceLaw, overshoot
from elastocal.drivers.kuka_rsi.settings import Bounds
from elastocal.errors import DeviceError
from elastocal.robot import Robot

_WRIST = math.radians(5.0)
"""Least |A5| at which the tool is moved straight: near 0 axes 4 and 6 run away."""
_UNIT = 1e-6
"""How far the length of a direction may be from 1."""


def require(holds: bool, what: str, value: object, allowed: str) -> None:
    """Refuse a value.

    Raises
    ------
    DeviceError
        Naming it and what is allowed.
    """
    if not holds:
        raise DeviceError(f"kuka_rsi: {what} is {value}: must be {allowed}")


def check_vector(what: str, values: FloatArray, size: int) -> FloatArray:
    """Return finite numbers, shape (size,), as an array of their own.

    Raises
    ------
    DeviceError
        If they are not as they must be.
    """
    array = np.array(values, dtype=float)
    fits = array.shape == (size,) and bool(np.all(np.isfinite(array)))
    require(fits, what, array.tolist(), f"{size} finite numbers")
    return array


def check_joint_move(robot: Robot, q: FloatArray, speed: float) -> FloatArray:
    """Return the target of a joint move, shape (joint,), in rad or m, as an array of its own.

    Raises
    ------
    DeviceError
        If it is beyond a limit, or the speed is no part of the axis speeds.
    """
    target, limits = check_vector("joint target", q, len(robot.joint_names)), robot.limits
    for name, value, low, high in zip(
        robot.joint_names, target, limits.lower, limits.upper, strict=True
    ):
        require(low <= value <= high, f"joint target {name}", value, f"{low:g} to {high:g}")
    require(0.0 < speed <= 1.0, "speed", speed, "a part of the axis speeds in (0, 1]")
    return target


def check_line(what: str, direction: FloatArray, distance: float, speed: float) -> FloatArray:
    """Return the direction of a straight move, shape (3,), of length 1 exactly.

    Raises
    ------
    DeviceError
        If it is no unit vector, or distance or speed is not above 0 and finite.
    """
    array = check_vector(f"{what} direction", direction, 3)
    length = float(np.linalg.norm(array))
    require(abs(length - 1.0) <= _UNIT, f"length of the {what} direction", length, "1")
    require(0.0 < distance < math.inf, f"{what} distance", distance, "above 0 m and finite")
    require(0.0 < speed < math.inf, f"{what} speed", speed, "above 0 m/s and finite")
    return array / length


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
        require(
            size <= bounds.correction,
            f"{command}: correction at its end",
            f"{1e3 * size:.1f} mm",
            f"at most {1e3 * bounds.correction:g} mm (largest_correction)",
        )
        require(
            speed <= bounds.speed,
            f"{command} speed",
            f"{1e3 * speed:g} mm/s",
            f"at most {1e3 * bounds.speed:g} mm/s (correction_speed)",
        )

    def require_bent_wrist(self, q: FloatArray) -> None:
        """Refuse a move with axes 4 and 6 in line; joints of shape (joint,), A5 last but one."""
        bend = abs(math.remainder(float(q[-2]), math.pi))
        require(
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
