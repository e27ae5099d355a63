"""The simulated instruments: force/torque sensor and laser trackers.

The sensor (see `elastocal.cell.devices.ForceSensor`) shows

    reading = (1 + X) wrench + zero + drift t + noise

with the wrench of contact and tool weight in the sensor's frame, and cross-talk ``X`` over the
ranges of the axes, itself too (gain). The drift counts from the last restart.

Each tracker station (see `elastocal.cell.devices.Metrology`) stands near where the cell file puts
it, turned as it happens to be; that turn is what the registration of a run has to find. Noise grows
with the distance, the same along each axis. A part of it comes from moving air and changes slowly,
as a first-order process of `AIR_TIME`.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import BeamState, Cell, PointBlock, SensorStatus, WrenchBlock
from elastocal.errors import DeviceError, nearest
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._sampling import BLOCK, NoiseStream, SampleGrid, Samples, generator
from elastocal.sim.workcell._timeline import MICROSECONDS, Segment

TRACKER_SOURCE = "simulated laser tracker"
COVERAGE = 1.96
"""Standard deviations within which 95 % of the samples lie."""
AIR_TIME = 0.4
"""Time constant of the slow noise, in s. An assumption."""
SENSOR_SOURCE = "simulated force sensor"


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
            source=SENSOR_SOURCE,
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
        return reading + unrest * (self._matrix @ segment.ripple_wrench)

    def _clipped(self, times: IndexArray, values: FloatArray) -> FloatArray:
        """Keep the readings within the ranges, and notice when they were not."""
        if self._plant.schedule.any_span:
            values[self._plant.schedule.struck("ft_saturation", times), 2] = 2.0 * self._range[2]
        if np.any(np.abs(values) > self._range):
            self._saturated = True
            return np.clip(values, -self._range, self._range)
        return values

    def _with_faults(self, times: IndexArray, values: FloatArray) -> tuple[IndexArray, FloatArray]:
        frozen = self._plant.schedule.struck("ft_frozen", times)
        if len(frozen):
            values[frozen] = values[frozen[0] - 1] if frozen[0] > 0 else self._last
        lost = self._plant.schedule.struck("ft_dropout", times)
        return np.delete(times, lost), np.delete(values, lost, axis=0)


class SimulatedTracker:
    """One or several stations, of which one measures."""

    def __init__(self, plant: Plant) -> None:
        """Set the cell's stations up; the first one measures.

        Raises
        ------
        DeviceError
            If the cell has no station.
        """
        cell, entry = plant.cell, plant.cell.file.simulation.tracker
        if not cell.file.trackers:
            raise DeviceError(f"cell {cell.name} has no tracker to simulate (key 'trackers')")
        self._plant, self._entry = plant, entry
        self._names = tuple(tracker.name for tracker in cell.file.trackers)
        self._T_base_station = {
            tracker.name: _station(plant.seed, tracker.name, tracker.position_base, entry.placing)
            for tracker in cell.file.trackers
        }
        self._station = self._names[0]
        self._noise = NoiseStream(_draw(entry.turbulence, entry.rate), plant.seed)
        self._grid, self._samples = SampleGrid(entry.rate, plant.now), Samples(6)
        self._still: tuple[Segment, str, FloatArray, FloatArray] | None = None
        self.restart(plant.now, "HOME")

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the stations."""
        return self._names

    @property
    def rate(self) -> float:
        """Nominal number of samples a second."""
        return self._entry.rate

    def look(self, station: str) -> None:
        """Measure with this station from now on, and find the marker again if it was lost.

        Raises
        ------
        DeviceError
            If there is no such station.
        """
        if station not in self._names:
            raise DeviceError(
                f"{TRACKER_SOURCE} has no station {station!r}{nearest(station, self._names)}"
                f" (stations: {', '.join(self._names)})"
            )
        self.catch_up(self._plant.now)
        if station != self._station:
            self._samples.drain()
        self._station = station

    def read(self) -> PointBlock:
        """Return the positions since the last call; none while the beam is broken."""
        now = self._plant.now
        self.catch_up(now)
        times, values = self._samples.drain()
        spans = self._plant.schedule.spans("beam_break")
        broken = any(s.holds(now) and s.station in (None, self._station) for s in spans)
        return PointBlock(
            time=times,
            position=values[:, :3],
            sigma=values[:, 3:],
            beam=BeamState.BROKEN if broken else BeamState.LOCKED,
            station=self._station,
            source=TRACKER_SOURCE,
        )

    def _true(self, times: IndexArray) -> tuple[FloatArray, FloatArray]:
        """Return marker in the station's frame, shape (time or 1, 3), and sigma, (.., 1)."""
        segment = self._plant.segment
        if self._still is not None and self._still[:2] == (segment, self._station):
            return self._still[2:]
        T = self.T_base_station(self._station)
        marker = (segment.seen(times)[:, :3] - T[:3, 3]) @ T[:3, :3]
        distance = np.sqrt(np.sum(marker**2, axis=1, keepdims=True))
        sigma = (self._entry.noise + self._entry.noise_per_metre * distance) / COVERAGE
        if times[0] >= segment.end:
            self._still = (segment, self._station, marker, sigma)
        return marker, sigma

    def T_base_station(self, station: str) -> FloatArray:
        """Return where a station truly stands now, shape (4, 4), in m."""
        T = self._T_base_station[station].copy()
        for fault in self._plant.schedule.lasting("station_bumped", self._plant.visit):
            if fault.station in (None, station):
                T[:3, 3] += fault.offset
        return T

    def restart(self, now: int, key: str) -> None:
        """Begin to count samples, with the noise that belongs to a key."""
        self._grid.restart(now)
        self._noise.restart("tracker", key)
        self._still = None

    def catch_up(self, now: int) -> None:
        """Take the samples that are due."""
        first, last = self._grid.due(now)
        if first >= last:
            return
        times = self._grid.times(first, last)
        marker, sigma = self._true(times)
        values = np.empty((len(times), 6))
        values[:, :3] = marker + sigma * self._noise.take(first, last)
        values[:, 3:] = sigma
        if self._plant.schedule.any_span:
            lost = self._plant.schedule.struck("beam_break", times, self._station)
            times, values = np.delete(times, lost), np.delete(values, lost, axis=0)
        if len(times):
            self._samples.add(times, values)


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
    return cell.file.simulation.sensor.bias * sensor_range(cell) * zero


def sensor_matrix(cell: Cell, seed: int) -> FloatArray:
    """Return what the sensor reads per true wrench, shape (6, 6)."""
    scale, share = sensor_range(cell), cell.file.simulation.sensor.cross_talk
    talk = share * generator(seed, "sensor", "cross-talk").standard_normal((6, 6))
    return np.eye(6) + talk * np.divide.outer(scale, scale)


def force_gain(cell: Cell, seed: int) -> FloatArray:
    """Return the force that the sensor reads per force at the tool, sensor frame, (3, 3)."""
    matrix, T_sensor_tcp = sensor_matrix(cell, seed), cell.T_sensor_tcp
    assert T_sensor_tcp is not None
    moment = np.cross(T_sensor_tcp[:3, 3], np.eye(3)).T
    return matrix[:3, :3] + matrix[:3, 3:] @ moment


def _station(seed: int, name: str, position: FloatArray, placing: float) -> FloatArray:
    """Return T_base_station, shape (4, 4): some way off, and turned at random."""
    rng = generator(seed, "station", name)
    T = np.eye(4)
    T[:3, 3] = position + placing * rng.standard_normal(3)
    T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    return T


def _draw(slow: float, rate: float) -> Callable[[np.random.Generator], FloatArray]:
    """Return what draws a block of noise of unit size, shape (`BLOCK`, 3)."""
    keep = math.exp(-1.0 / (rate * AIR_TIME))

    def draw(rng: np.random.Generator) -> FloatArray:
        fast, drive = rng.standard_normal((2, BLOCK, 3))
        drive[1:] *= math.sqrt(1.0 - keep**2)
        air = lfilter([1.0], [1.0, -keep], drive, axis=0)
        noise: FloatArray = math.sqrt(1.0 - slow**2) * fast + slow * air
        return noise

    return draw
