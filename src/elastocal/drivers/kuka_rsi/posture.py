"""Joints and tool frame of a controller in SI and in the robot's own joint order, and back."""

import math
from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.link import Cycle
from elastocal.drivers.kuka_rsi.messages import NO_CORRECTION, ProgramState, RobMessage, Six
from elastocal.errors import DeviceError
from elastocal.robot import Robot, T_from_xyzabc

_ARM = 6
_DECIMALS = 3
"""Fewest decimals of RIst, in mm and deg; the controller's default is 1."""
_TURNED = math.radians(1.0)
"""Largest angle between RIst and the tool frame of the robot's description, in rad."""


class PostureReader:
    """Reads messages as the posture of a robot.

    Parameters
    ----------
    robot : Robot
        Its description; external axes come first in every joint array.
    signs : sequence of int
        Sense of A1 to A6 against its joints, 1 or -1.

    Raises
    ------
    DeviceError
        If the arm has not six turning joints, or there are more than six external axes.
    """

    def __init__(self, robot: Robot, signs: Sequence[int]) -> None:
        external, revolute = robot.external_axes, robot.revolute
        arm = revolute[external:]
        if len(arm) != _ARM or not all(arm) or external > _ARM:
            raise DeviceError(
                f"kuka_rsi: {robot.name} has the joints {', '.join(robot.joint_names)}: a KUKA has"
                " six turning axes behind at most six external ones"
            )
        self._robot, self._external = robot, external
        scale = [math.radians(1.0) if turns else 1e-3 for turns in revolute[:external]]
        self._scale = np.array([*scale, *(math.radians(1.0) * sign for sign in signs)])
        self.scales: tuple[float, ...] = tuple(self._scale.tolist())
        """From mm and deg of the controller to each joint, in m and rad."""

    def joints(self, message: RobMessage) -> list[float]:
        """Return the joint positions of a message, in rad or m: what a correction needs of it.

        Raises
        ------
        DeviceError
            If the controller does not send them.
        """
        if message.axes is None:
            raise _not_sent("AIPos")
        external = (message.external or ())[: self._external]
        if len(external) < self._external:
            raise _not_sent(f"EIPos.E{len(external) + 1}")
        given = (*external, *message.axes)
        return [scale * value for scale, value in zip(self.scales, given, strict=True)]

    def read(self, message: RobMessage, now: float, mode: str) -> Cycle:
        """Return the state of a message.

        Parameters
        ----------
        now : float
            When it came, in s of the clock.
        mode : str
            Mode of `RsiSettings`; who only measures needs less.

        Raises
        ------
        DeviceError
            If the controller does not send what is needed.
        """
        actual = message.actual
        if actual is None:
            raise _not_sent("RIst")
        if message.decimals < _DECIMALS:
            raise DeviceError(
                f"the controller sends RIst with {message.decimals} decimals, at least {_DECIMALS}"
                " are needed: set Precision of its ETHERNET object to 6"
            )
        q = np.array(self.joints(message))
        setpoint = message.setpoint
        if mode == "contact":
            if setpoint is None:
                raise _not_sent("RSol")
            if message.state is None:
                raise _not_sent("Krl.State")
        place = np.array(actual[:3])
        return Cycle(
            time=now,
            q=q,
            T_base_tcp=T_from_xyzabc(*(1e-3 * place), *np.radians(actual[3:])),
            offset=1e-3 * (place - (place if setpoint is None else setpoint[:3])),
            state=message.state or ProgramState.ABSENT,
            command=message.command or 0,
        )

    def as_told(self, q: FloatArray) -> tuple[Six, Six]:
        """Return joints, shape (joint,), as A1 to A6 in deg and E1 to E6 in mm or deg."""
        values = (q / self._scale).tolist()
        external = (*values[: self._external], *NO_CORRECTION)[:_ARM]
        a1, a2, a3, a4, a5, a6 = values[self._external :]
        e1, e2, e3, e4, e5, e6 = external
        return (a1, a2, a3, a4, a5, a6), (e1, e2, e3, e4, e5, e6)

    def require_model(self, cycle: Cycle, tolerance: float) -> None:
        """Refuse a controller whose tool is not where the robot's description has it.

        Raises
        ------
        DeviceError
            If RIst is farther from it than a tolerance in m, or turned by more than a degree.
        """
        T = self._robot.forward(cycle.q)
        gap = float(np.linalg.norm(T[:3, 3] - cycle.T_base_tcp[:3, 3]))
        R = T[:3, :3].T @ cycle.T_base_tcp[:3, :3]
        turn = math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(R)) - 1.0))))
        if not (gap <= tolerance and turn <= _TURNED):
            raise DeviceError(
                f"kuka_rsi: RIst is {1e3 * gap:.1f} mm and {math.degrees(turn):.2f} deg from where"
                f" {self._robot.name} has its tool at these joints (allowed {1e3 * tolerance:g} mm,"
                f" {math.degrees(_TURNED):g} deg): check $TOOL, $BASE, signs of the axes"
            )


def _not_sent(element: str) -> DeviceError:
    return DeviceError(f"the controller does not send {element}: see its ETHERNET file")
