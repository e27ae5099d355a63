"""Protocols of the devices that Procedure 1 needs; simulators and drivers implement them.

No call may take longer than a supervision cycle (``procedure.cycle``, 40 ms): the watchdog that
calls is the same that stops the arm. A driver whose line may be slow talks to it in a thread of
its own and answers from what came last. A call may raise `DeviceError`, or an `OSError` of its
line; the arm is then brought off the surface with what still works.

A new driver is one package under ``elastocal.drivers`` and an entry in the contract tests of
``tests/contracts/``.
"""

from dataclasses import dataclass

from elastocal.cell.devices.arm import RobotArm
from elastocal.cell.devices.clock import Clock
from elastocal.cell.devices.force_sensor import ForceSensor
from elastocal.cell.devices.metrology import Metrology


@dataclass(frozen=True, eq=False)
class Devices:
    """Everything that is switched on during a run, with the time that they share."""

    arm: RobotArm
    sensor: ForceSensor
    metrology: Metrology
    clock: Clock
