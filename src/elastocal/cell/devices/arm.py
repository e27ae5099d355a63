"""A robot arm as the calibration procedure needs it (paper Procedure 1, steps 4-25).

Every command returns at once; the arm is asked how far it is by `RobotArm.state`. A caller looks
again each supervision cycle, so that a watchdog can stop the arm at any step. Forces are those on
the robot at the tool centre point (spec section 1).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from elastocal.arrays import FloatArray


class Motion(Enum):
    """What the arm is doing."""

    DISARMED = "disarmed"
    """Drives off, or not released for motion by `RobotArm.enable`."""
    IDLE = "idle"
    """Standing in position control; the last command is done."""
    MOVING = "moving"
    """On a joint-space move."""
    APPROACHING = "approaching"
    """On a guarded linear move."""
    HOLDING = "holding"
    """In force control, building up or holding a load case."""
    RELEASING = "releasing"
    """In force control, ramping the force to zero."""
    RETRACTING = "retracting"
    """On a linear move away from the surface."""
    STOPPED = "stopped"
    """Stopped by a fault, a limit or `RobotArm.stop`; needs `RobotArm.enable` again."""


@dataclass(frozen=True, eq=False)
class ArmState:
    """What the controller says of the arm."""

    time: float
    """When, in s of the clock."""
    q: FloatArray
    """Joint positions of the controller, shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame that the controller computes from them, shape (4, 4), in m."""
    motion: Motion
    in_contact: bool
    """Whether a guarded move ended because the contact force was reached, until a retract."""
    fault: str | None
    """Why it stopped; None when nothing is wrong."""
    source: str
    """Device that says so."""


class RobotArm(Protocol):
    """An arm with a guarded approach and force control at the tool.

    Contract: no command moves anything before `enable`; a command that is not allowed in the
    present state raises `DeviceError`; `stop` is allowed in every state and any number of times.
    """

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every joint array."""

    def state(self) -> ArmState:
        """Return the newest state, within a supervision cycle; it does not wait for a newer one."""

    def enable(self) -> None:
        """Release the arm for motion; it then is idle. Refused while a fault stands."""

    def disable(self) -> None:
        """Take the release back; the arm stands."""

    def move_joints(self, q: FloatArray, speed: float) -> None:
        """Start a synchronous joint-space move.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            Target in rad or m.
        speed : float
            Fraction of the axis speeds, in (0, 1].
        """

    def approach(
        self, direction_base: FloatArray, distance: float, speed: float, contact_force: float
    ) -> None:
        """Start a straight move that ends at a distance or when a force is felt.

        Parameters
        ----------
        direction_base : ndarray, shape (3,)
            Unit vector in base.
        distance : float
            Longest way, in m.
        speed : float
            In m/s.
        contact_force : float
            Force against the motion at which the arm stops, in N; infinite: never.
        """

    def hold(self, force_tcp: FloatArray, rate: float) -> None:
        """Start to build up a force and hold it, orientation kept.

        Parameters
        ----------
        force_tcp : ndarray, shape (3,)
            Force on the robot in the tcp frame, in N.
        rate : float
            Fastest change of the force, in N/s.
        """

    def release(self, rate: float) -> None:
        """Start to ramp the force to zero; the arm then is idle, without force, at the surface."""

    def retract(self, direction_base: FloatArray, distance: float, speed: float) -> None:
        """Start a straight move away from the surface; see `approach`."""

    def stop(self) -> None:
        """Stop at once, in position control. Always allowed."""
