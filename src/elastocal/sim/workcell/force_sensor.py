"""The simulated force/torque sensor; see `elastocal.cell.devices.ForceSensor`.

    reading = (1 + X) wrench + zero + drift t + noise

with the wrench of contact and tool weight in the sensor's frame, and cross-talk ``X`` over the
ranges of the axes, itself too (gain). The drift counts from the last restart.
"""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.cell.devices import SensorStatus, WrenchBlock
from elastocal.errors import DeviceError
from elastocal.sim.workcell.clock import MICROSECONDS
from elastocal.sim.workcell.instruments import SampleGrid, Samples, held
from elastocal.sim.workcell.keys import BLOCK, NoiseStream, generator
from elastocal.sim.workcell.plant import Plant
from elastocal.sim.workcell.segment import Segment

SOURCE = "simulated force sensor"


class SimulatedForceSensor:
    """A sensor with faults of its own."""

    def __init__(self, plant: Plant) -> None:
        """Put the cell's sensor between flange and tool."""
        cell, entry = plant.cell, plant.cell.file.simulation.sensor
        self._plant, self._entry = plant, entry
        self._range = sensor_range(cell)
        self._matrix = sensor_matrix(cell, plant.seed)
        self._zero = sensor_zero(cell, plant.seed)
        sigma = np.repeat([entry.force_noise, entry.moment_noise], 3)
        self._noise = NoiseStream(lambda rng: sigma * rng.standard_normal((BLOCK, 6)), plant.seed)
        self._grid, self._samples = SampleGrid(entry.rate, plant.now), Samples(6)
        self._still: tuple[Segment, FloatArray] | None = None
        self._last = np.zeros(6)
        self._saturated = False
        self._slope = np.zeros(6)
        self.restart(plant.now, "HOME")

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""
        return self._entry.rate

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest few hundred when there are more."""
        self.catch_up(self._plant.now)
        times, values = self._samples.drain()
        status = SensorStatus.SATURATED if self._saturated else SensorStatus.OK
        self._saturated = False
        return WrenchBlock(
            time=times,
            force=values[:, :3],
            moment=values[:, 3:],
            force_sigma=self._entry.force_noise,
            moment_sigma=self._entry.moment_noise,
            status=status,
            source=SOURCE,
        )

    def restart(self, now: int, key: str) -> None:
        """Begin to count samples, with the noise and drift that belong to a key."""
        self._grid.restart(now)
        self._noise.restart("sensor", key)
        share = self._entry.drift / 60.0 / self._range[0]
        draw = generator(self._plant.seed, "drift", key).standard_normal(6)
        self._slope = share * self._range * draw

    def catch_up(self, now: int) -> None:
        """Take the samples that are due."""
        first, last = self._grid.due(now)
        if first >= last:
            return
        times = self._grid.times(first, last)
        since = (times - self._grid.begin) / MICROSECONDS
        values = self._true(times) + since[:, None] * self._slope
        values += self._noise.take(first, last)
        values = self._clipped(times, values)
        if self._plant.schedule.any_span:
            times, values = self._with_faults(times, values)
        if len(times):
            self._last = values[-1]
            self._samples.add(times, values)

    def _true(self, times: IndexArray) -> FloatArray:
        """Return readings without noise and drift, shape (sample or 1, 6)."""
        segment = self._plant.segment
        if self._still is not None and self._still[0] is segment:
            reading = self._still[1]
        else:
            reading = segment.seen(times)[:, 3:] @ self._matrix.T + self._zero
            if times[0] >= segment.end:
                self._still = (segment, reading)
        unrest = segment.unrest(times)
        if unrest is None:
            return reading
        shaken: FloatArray = reading + unrest * (self._matrix @ segment.ripple_wrench)
        return shaken

    def _clipped(self, times: IndexArray, values: FloatArray) -> FloatArray:
        """Keep the readings within the ranges, and notice when they were not."""
        if self._plant.schedule.any_span:
            values[held(self._plant, "ft_saturation", times), 2] = 2.0 * self._range[2]
        if np.any(np.abs(values) > self._range):
            self._saturated = True
            return np.clip(values, -self._range, self._range)
        return values

    def _with_faults(self, times: IndexArray, values: FloatArray) -> tuple[IndexArray, FloatArray]:
        frozen = held(self._plant, "ft_frozen", times)
        if len(frozen):
            values[frozen] = values[frozen[0] - 1] if frozen[0] > 0 else self._last
        lost = held(self._plant, "ft_dropout", times)
        return np.delete(times, lost), np.delete(values, lost, axis=0)


def sensor_range(cell: Cell) -> FloatArray:
    """Return the ranges of the sensor's axes, shape (6,), in N and N·m.

    Raises
    ------
    DeviceError
        If the cell has no sensor.
    """
    sensor = cell.file.sensor
    if sensor is None:
        raise DeviceError(f"cell {cell.name} has no force sensor to simulate (key 'sensor')")
    return np.concatenate([sensor.largest_force, sensor.largest_moment])


def sensor_zero(cell: Cell, seed: int) -> FloatArray:
    """Return what the sensor reads under nothing, shape (6,), in N and N·m."""
    zero = generator(seed, "sensor", "zero").standard_normal(6)
    bias: FloatArray = cell.file.simulation.sensor.bias * sensor_range(cell) * zero
    return bias


def sensor_matrix(cell: Cell, seed: int) -> FloatArray:
    """Return what the sensor reads per true wrench, shape (6, 6)."""
    scale, share = sensor_range(cell), cell.file.simulation.sensor.cross_talk
    talk = share * generator(seed, "sensor", "cross-talk").standard_normal((6, 6))
    matrix: FloatArray = np.eye(6) + talk * np.divide.outer(scale, scale)
    return matrix


def force_gain(cell: Cell, seed: int) -> FloatArray:
    """Return the force that the sensor reads per force at the tool, sensor frame, (3, 3)."""
    matrix, T_sensor_tcp = sensor_matrix(cell, seed), cell.T_sensor_tcp
    assert T_sensor_tcp is not None
    moment = np.cross(T_sensor_tcp[:3, 3], np.eye(3)).T
    gain: FloatArray = matrix[:3, :3] + matrix[:3, 3:] @ moment
    return gain
