"""The devices of a simulated cell, from its cell file."""

from dataclasses import dataclass

from elastocal.cell import Cell
from elastocal.cell.devices import Devices
from elastocal.sim.workcell.arm import SimulatedArm
from elastocal.sim.workcell.clock import SimClock
from elastocal.sim.workcell.force_control import ForceControl
from elastocal.sim.workcell.force_sensor import SimulatedForceSensor, force_gain, sensor_range
from elastocal.sim.workcell.plant import Plant
from elastocal.sim.workcell.tracker import SimulatedTracker


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """Devices, and the truth behind them for those who may know it: tests."""

    devices: Devices
    plant: Plant
    arm: SimulatedArm
    sensor: SimulatedForceSensor
    tracker: SimulatedTracker

    @classmethod
    def of(cls, cell: Cell, seed: int, start: float = 0.0) -> "SimulatedCell":
        """Return a simulated cell; see `simulated_devices`."""
        sensor_range(cell)  # a cell without sensor is refused before the long work
        clock = SimClock(start)
        plant = Plant(cell, seed, clock)
        arm = SimulatedArm(plant, ForceControl(plant, force_gain(cell, seed)))
        sensor, tracker = SimulatedForceSensor(plant), SimulatedTracker(plant)
        plant.instruments = [sensor, tracker]
        return cls(Devices(arm, sensor, tracker, clock), plant, arm, sensor, tracker)


def simulated_devices(cell: Cell, seed: int, start: float = 0.0) -> Devices:
    """Return arm, force sensor, tracker and clock of a simulated cell.

    Parameters
    ----------
    cell : Cell
        The cell; its sections ``simulation`` and ``faults`` say what is hidden in it.
    seed : int
        Of everything random.
    start : float
        What the clock shows at the beginning, in s.

    Raises
    ------
    DeviceError
        If the cell has no sensor or no tracker, or its robot fewer than six joints.
    FileAccessError
        If the mesh of the surface cannot be read.
    """
    return SimulatedCell.of(cell, seed, start).devices
