"""The driver of the simulated cell: all devices in a time of their own, or some in the rig's."""

from collections.abc import Mapping
from dataclasses import dataclass

from elastocal.cell import KINDS, Cell, DeviceSet, DeviceSettings, RigContext
from elastocal.sim.wire import LiveCell
from elastocal.sim.workcell import simulated_devices


@dataclass(frozen=True)
class SimulatedDriver:
    """Makes devices that need no hardware; see `elastocal.cell.Driver`."""

    kinds = frozenset(KINDS)
    real = False

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - the protocol's form
        """Return settings without a key: the sections ``simulation`` and ``faults`` say it all."""
        return DeviceSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Make the devices of a simulated cell.

        If all devices are simulated, time passes only while a caller sleeps, and results are
        reproducible to the last bit. Beside real devices the cell follows the clock of the rig.
        """
        if wanted.keys() == self.kinds - (set() if cell.file.trackers else {"metrology"}):
            all_of_it = simulated_devices(cell, context.seed, context.start)
            arm, sensor, metrology = all_of_it.arm, all_of_it.sensor, all_of_it.metrology
            clock, stack = all_of_it.clock, all_of_it.stack
            return DeviceSet(arm, sensor, metrology, clock=clock, stack=stack)
        live = LiveCell(cell, context.seed, context.clock)
        return DeviceSet(
            arm=live.arm() if "arm" in wanted else None,
            sensor=live.sensor() if "sensor" in wanted else None,
            metrology=live.metrology() if "metrology" in wanted else None,
            feed=live if "sensor" in wanted else None,
            stack=live.stack,
        )


DRIVER = SimulatedDriver()
