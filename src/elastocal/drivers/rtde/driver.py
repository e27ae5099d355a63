"""The driver that cell files name ``rtde``: arm and sensor of a Universal Robots controller."""

from collections.abc import Callable, Mapping
from typing import Annotated

import numpy as np
from pydantic import Field, FiniteFloat

from elastocal.cell import LOOPBACK, Cell, DevicePlace, DeviceSet, DeviceSettings, RigContext
from elastocal.drivers.rtde._ur_rtde import UrControl, UrReceive, open_control, open_receive
from elastocal.drivers.rtde.arm import UrArm
from elastocal.drivers.rtde.line import UrLine, UrSensor, pose_of_T
from elastocal.errors import DeviceError

_PORT = 30004
"""By which a controller is known, of those that it answers at."""
_CONTROL_RATE = 500.0
"""Of the commanding half, in Hz; controllers of version 5 take it."""
_FAR_OFF = 0.02
"""How far the controller's tcp may be from the model's, in m: nominal against calibrated arms."""


class RtdeSettings(DeviceSettings):
    """What stands under an arm or a sensor whose driver is ``rtde``."""

    address: str = LOOPBACK
    """Of the controller, which has its ports fixed: 30004, 30003, 29999."""
    rate: Annotated[FiniteFloat, Field(ge=10.0, le=500.0)] = 125.0
    """Samples a second."""

    def device_places(self) -> tuple[DevicePlace, ...]:
        """Return where the controller is."""
        return (DevicePlace(self.address, _PORT),)


class RtdeDriver:
    """Arms of Universal Robots, and their own force/torque sensors.

    Parameters
    ----------
    receive, control : callable, optional
        Open the two halves of a connection; by default those of ``ur-rtde``.
    """

    kinds = frozenset({"arm", "sensor"})
    real = True

    def __init__(
        self,
        receive: Callable[[str, float], UrReceive] = open_receive,
        control: Callable[[str, float], UrControl] = open_control,
    ) -> None:
        self._open_receive, self._open_control = receive, control

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - one for both
        """Return the settings; see `elastocal.cell.Driver`."""
        return RtdeSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Connect to the controller; see `elastocal.cell.Driver.connect`."""
        chosen = [each for each in wanted.values() if isinstance(each, RtdeSettings)]
        settings = chosen[0]
        if any(each.address != settings.address for each in chosen):
            raise DeviceError("rtde: arm and sensor must be of one controller (key 'address')")
        if cell.robot.external_axes or len(cell.robot.joint_names) != 6:
            raise DeviceError(f"rtde knows six joints, {cell.robot.name} has others")
        rate = max(each.rate for each in chosen)
        line = UrLine(self._open_receive(settings.address, rate), context.clock, rate)
        try:
            line.start()
            if context.watches:
                return DeviceSet(close=line.close, readings=lambda: line.readings(wanted))
            arm = self._arm(cell, line, settings, context) if "arm" in wanted else None
        except DeviceError:
            line.close()
            raise

        def close() -> None:
            if arm is not None:
                arm.close()
            line.close()

        sensor = None
        if "sensor" in wanted:
            if cell.file.sensor is None:
                raise DeviceError(f"cell {cell.name} describes no sensor (key 'sensor')")
            sensor = UrSensor(line, cell.file.sensor.force_range)
        feed = line if sensor is not None else None
        return DeviceSet(arm=arm, sensor=sensor, feed=feed, close=close, lines=line.lines)

    def _arm(self, cell: Cell, line: UrLine, settings: RtdeSettings, context: RigContext) -> UrArm:
        control = self._open_control(settings.address, _CONTROL_RATE)
        try:
            control.setTcp(pose_of_T(cell.T_flange_tcp))
            control.setPayload(cell.file.tool.mass, cell.file.tool.centre_of_mass)
            _require_same_tcp(cell, line)
        except DeviceError:
            control.stopScript()
            control.disconnect()
            raise
        return UrArm(line, control, context.clock, cell)


def _require_same_tcp(cell: Cell, line: UrLine) -> None:
    """Refuse a controller whose tcp is elsewhere than the model has it."""
    sample = line.sample()
    gap = cell.robot.forward(sample.q)[:3, 3] - sample.T_base_tcp[:3, 3]
    off = float(np.linalg.norm(gap))
    if not off <= _FAR_OFF:
        raise DeviceError(
            f"rtde: the controller's tcp is {1e3 * off:.1f} mm from the model's at the same joints"
            f" (allowed {1e3 * _FAR_OFF:.0f} mm): is it this arm, and this tool?"
        )


DRIVER = RtdeDriver()
