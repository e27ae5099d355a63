"""The simulated instruments: force/torque sensor and laser trackers.

The sensor (see `elastocal.cell.devices.ForceSensor`) measures

    reading = (1 + X) wrench + lag + zero + drift t + noise

with the wrench of contact and tool weight in the sensor's frame, and cross-talk ``X`` over the
ranges of the axes, itself too (gain). Drift and hysteresis (lag) count from the last restart.

Each tracker station (see `elastocal.cell.devices.Metrology`) is near its position in the cell file,
with a random orientation, which the registration of a run must find. Noise grows with the distance,
the same along each axis. A part of it comes from moving air and changes slowly, as a first-order
process of `_AIR_TIME`.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import BeamState, Cell, PointBlock, SensorStatus, WrenchBlock
from elastocal.errors import DeviceError, nearest, present
from elastocal.results import brief_repr
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._imperfections import ForceGain, SensorHysteresis
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._timeline import MICROSECONDS, Segment, generator

TRACKER_SOURCE = "simulated laser tracker"
COVERAGE = 1.96
"""Standard deviations within which 95 % of the samples lie."""
_AIR_TIME = 0.4
"""Time constant of the slow noise, in s. An assumption."""
SENSOR_SOURCE = "simulated force sensor"
NEWEST = 500
"""Samples that are kept for a caller that does not look; older ones are lost."""
BLOCK = 512
"""Samples that are drawn at once."""
Draw = Callable[[np.random.Generator], FloatArray]
"""Draws a block of noise, shape (`BLOCK`, axis)."""


class SampleBuffer:
    """Samples that were not read yet, at a fixed interval in µs from the last restart on."""

    def __init__(self, rate: float, now: int) -> None:
        """Sample so often, in Hz, from now on, in µs."""
        self._period = round(MICROSECONDS / rate)
        self._times: list[IndexArray] = []
        self._values: list[FloatArray] = []
        self.restart(now)

    def restart(self, now: int) -> None:
        """Count from now on, in µs."""
        self.begin, self._next = now, 1

    def due(self, now: int) -> tuple[int, int]:
        """Return the numbers of the samples that are due, from the first to before the last."""
        first = self._next
        self._next = last = max(first, (now - self.begin) // self._period + 1)
        return max(first, last - NEWEST), last

    def times(self, first: int, last: int) -> IndexArray:
        """Return the times of samples in µs, shape (sample,)."""
        return self.begin + self._period * np.arange(first, last)

    def add(self, times: IndexArray, values: FloatArray) -> None:
        """Keep some more; forget blocks that are too old to be among the newest."""
        self._times.append(times)
        self._values.append(values)
        while len(self._times) > 1 and sum(map(len, self._times[1:])) >= NEWEST:
            del self._times[0], self._values[0]

    def drain(self) -> tuple[FloatArray, FloatArray]:
        """Return times in s and six columns of the newest samples, and forget them all."""
        if not self._times:
            return np.empty(0), np.empty((0, 6))
        times, values = np.concatenate(self._times), np.concatenate(self._values)
        self._times, self._values = [], []
        return times[-NEWEST:] / MICROSECONDS, values[-NEWEST:]


@brief_repr
@dataclass(frozen=True, eq=False)
class LinkEncoders:
    """Secondary encoders behind the gears of the arm, with errors of their own."""

    joints: tuple[str, ...]
    """Joints of the arm, each of which has one."""
    noise: float
    """Standard deviation of a sample, in rad."""
    rate: float
    """Samples a second."""
    eccentricity: float
    """Amplitude of the error once a turn, in rad."""
    phase: FloatArray
    """Where that is zero, shape (arm joint,), in rad."""

    @classmethod
    def of(cls, cell: Cell) -> "LinkEncoders | None":
        """Return the encoders of a simulated cell; None: its arm has none."""
        entry, names = truth_of(cell).encoders, cell.robot.joint_names
        if entry.noise is None:
            return None
        joints = names[cell.robot.external_axes :]
        rng = generator(truth_of(cell).seed, "encoders")
        phase = rng.uniform(-np.pi, np.pi, len(joints))
        return cls(joints, entry.noise, entry.rate, entry.eccentricity, phase)

    def scatter(self, time: float) -> float:
        """Return the standard deviation of a mean over a time in s, in rad."""
        return self.noise / math.sqrt(max(time * self.rate, 1.0))

    def read(self, q: FloatArray, gears: FloatArray, noise: FloatArray) -> FloatArray:
        """Return the positions of links as read, shape (..., joint); NaN at external axes.

        Parameters
        ----------
        q, gears : ndarray, shape (..., joint)
            Positions of the motors, and of the links from there, in rad or m.
        noise : ndarray, shape (..., arm joint)
            In rad.
        """
        links = np.full_like(q, np.nan)
        own = slice(links.shape[-1] - len(self.joints), None)
        wobble = self.eccentricity * np.sin(q[..., own] + self.phase)
        links[..., own] = q[..., own] + gears[..., own] + wobble + noise
        return links


class NoiseStream:
    """Noise by the number of the sample, independent of the order of access."""

    def __init__(self, draw: Draw, seed: int) -> None:
        """Draw blocks of shape (`BLOCK`, axis) by ``draw``."""
        self._draw, self._seed = draw, seed
        self._words: tuple[object, ...] = ()
        self._number, self._block = -1, np.empty((0, 0))

    def restart(self, *words: object) -> None:
        """Restart with sample 0, for the purpose that the words name."""
        self._words, self._number = words, -1

    def take(self, first: int, last: int) -> FloatArray:
        """Return samples ``first`` to before ``last``, shape (sample, axis)."""
        number = first // BLOCK
        if number == (last - 1) // BLOCK:
            block = self._load(number)
            return block[first - number * BLOCK : last - number * BLOCK]
        border = (number + 1) * BLOCK
        return np.concatenate([self.take(first, border), self.take(border, last)])

    def _load(self, number: int) -> FloatArray:
        if number != self._number:
            self._block = self._draw(generator(self._seed, *self._words, number))
            self._number = number
        return self._block


class _SimulatedInstrument(ABC):
    """A device that samples what goes on, with noise that belongs to what the arm was sent to."""

    def __init__(self, plant: Plant, rate: float, name: str, draw: Draw) -> None:
        self._plant, self.rate, self._name = plant, rate, name
        self._noise = NoiseStream(draw, plant.seed)
        self._buffer = SampleBuffer(rate, plant.now)
        self.restart(plant.now, "HOME")

    def restart(self, now: int, key: str) -> None:
        """Begin to count samples, with the noise that belongs to a key."""
        self._buffer.restart(now)
        self._noise.restart(self._name, key)

    def catch_up(self, now: int) -> None:
        """Take the samples that are due."""
        first, last = self._buffer.due(now)
        if first < last:
            times = self._buffer.times(first, last)
            times, values = self._measure(times, self._noise.take(first, last))
            if len(times):
                self._buffer.add(times, values)

    @abstractmethod
    def _measure(self, times: IndexArray, noise: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Return which samples come, by their times in µs, and their six columns."""


class SimulatedForceSensor(_SimulatedInstrument):
    """A sensor with faults of its own."""

    def __init__(self, plant: Plant) -> None:
        """Put the cell's sensor between flange and tool."""
        cell, entry = plant.cell, truth_of(plant.cell).sensor
        self._entry, self.range = entry, sensor_range(cell)
        self.matrix, self.zero = sensor_matrix(cell, plant.seed), sensor_zero(cell, plant.seed)
        self.sigma = np.repeat([entry.force_noise, entry.moment_noise], 3)
        share = entry.hysteresis
        self._hysteresis = SensorHysteresis(share, self.range) if share > 0.0 else None
        self._still: tuple[Segment, FloatArray] | None = None
        self._last = np.zeros(6)
        self._saturated = False
        super().__init__(plant, entry.rate, "sensor", self._draw)

    def _draw(self, rng: np.random.Generator) -> FloatArray:
        return self.sigma * rng.standard_normal((BLOCK, 6))

    def slope(self, rng: np.random.Generator) -> FloatArray:
        """Return a drift drawn at random, shape (6,), in N/s and N·m/s."""
        share = self._entry.drift / 60.0 / self.range[0]
        slope: FloatArray = share * self.range * rng.standard_normal(6)
        return slope

    def read(self) -> WrenchBlock:
        """Return the samples since the last call; the newest few hundred when there are more."""
        self.catch_up(self._plant.now)
        times, values = self._buffer.drain()
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
        super().restart(now, key)
        self._still = None
        if self._hysteresis is not None:
            self._hysteresis.relax()
        self._slope = self.slope(generator(self._plant.seed, "drift", key))

    def _measure(self, times: IndexArray, noise: FloatArray) -> tuple[IndexArray, FloatArray]:
        since = (times - self._buffer.begin) / MICROSECONDS
        values = self._true(times) + since[:, None] * self._slope
        values += noise
        values = self._clipped(times, values)
        if self._plant.schedule.active:
            times, values = self._with_faults(times, values)
        if len(times):
            self._last = values[-1]
        return times, values

    def _true(self, times: IndexArray) -> FloatArray:
        """Return the true transform of a station, shape (4, 4), in m."""
        segment = self._plant.segment
        if self._still is not None and self._still[0] is segment:
            reading = self._still[1]
        else:
            wrench = segment.seen(times)[:, 3:]
            reading = wrench @ self.matrix.T + self.zero
            if self._hysteresis is not None:
                reading += self._hysteresis.lag(wrench)
            if times[0] >= segment.end:
                self._still = (segment, reading)
        unrest = segment.unrest(times)
        if unrest is None:
            return reading
        return reading + unrest * (self.matrix @ segment.ripple_wrench)

    def _clipped(self, times: IndexArray, values: FloatArray) -> FloatArray:
        """Keep the readings within the ranges, and notice when they were not."""
        if self._plant.schedule.active:
            values[self._plant.schedule.struck("ft_saturation", times), 2] = 2.0 * self.range[2]
        if np.any(np.abs(values) > self.range):
            self._saturated = True
            return np.clip(values, -self.range, self.range)
        return values

    def _with_faults(self, times: IndexArray, values: FloatArray) -> tuple[IndexArray, FloatArray]:
        values[:, 0] += self._plant.schedule.collision_force(times)
        frozen = self._plant.schedule.struck("ft_frozen", times)
        if len(frozen):
            values[frozen] = values[frozen[0] - 1] if frozen[0] > 0 else self._last
        lost = self._plant.schedule.struck("ft_dropout", times)
        return np.delete(times, lost), np.delete(values, lost, axis=0)


class SimulatedTracker(_SimulatedInstrument):
    """One or several stations, of which one measures."""

    def __init__(self, plant: Plant) -> None:
        """Set the cell's stations up; the first one measures.

        Raises
        ------
        DeviceError
            If the cell has no station.
        """
        cell, entry = plant.cell, truth_of(plant.cell).tracker
        if not cell.file.trackers:
            raise DeviceError(f"cell {cell.name} has no tracker to simulate (key 'trackers')")
        self._entry = entry
        self.stations = tuple(tracker.name for tracker in cell.file.trackers)
        self._T_base_station = {
            tracker.name: _station(plant.seed, tracker.name, tracker.position_base, entry.placing)
            for tracker in cell.file.trackers
        }
        self._station = self.stations[0]
        self._still: tuple[Segment, str, FloatArray, FloatArray] | None = None
        draw = _draw(entry.turbulence, entry.rate)
        super().__init__(plant, entry.rate, "tracker", draw)

    def look(self, station: str) -> None:
        """Measure with this station from now on, and find the marker again if it was lost.

        Raises
        ------
        DeviceError
            If there is no such station.
        """
        if station not in self.stations:
            raise DeviceError(
                f"{TRACKER_SOURCE} has no station {station!r}{nearest(station, self.stations)}"
                f" (stations: {', '.join(self.stations)})"
            )
        self.catch_up(self._plant.now)
        if station != self._station:
            self._buffer.drain()
        self._station = station

    def read(self) -> PointBlock:
        """Return the positions since the last call; none while the beam is broken."""
        now = self._plant.now
        self.catch_up(now)
        times, values = self._buffer.drain()
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
        sigma = self._sigma(distance)
        if times[0] >= segment.end:
            self._still = (segment, self._station, marker, sigma)
        return marker, sigma

    def _sigma(self, distance: FloatArray) -> FloatArray:
        """Return the standard deviation of a sample along an axis, at distances in m."""
        sigma: FloatArray = (self._entry.noise + self._entry.noise_per_metre * distance) / COVERAGE
        return sigma

    def scatter(self, point_base: FloatArray, time: float) -> FloatArray:
        """Return the standard deviation of a mean over a time, each axis, shape (...), in m.

        Parameters
        ----------
        point_base : ndarray, shape (..., 3)
            Where the marker is, in m.
        time : float
            In s.
        """
        distance = np.linalg.norm(point_base - self.T_base_station(self._station)[:3, 3], axis=-1)
        entry = self._entry
        return self._sigma(distance) * averaged_noise(entry.turbulence, time, entry.rate)

    def T_base_station(self, station: str) -> FloatArray:
        """Return the true present transform of a station, shape (4, 4), in m."""
        T = self._T_base_station[station].copy()
        for fault in self._plant.schedule.lasting("station_bumped", self._plant.visit):
            if fault.station in (None, station):
                T[:3, 3] += fault.offset
        return T

    def restart(self, now: int, key: str) -> None:
        """Begin to count samples, with the noise that belongs to a key."""
        super().restart(now, key)
        self._still = None

    def _measure(self, times: IndexArray, noise: FloatArray) -> tuple[IndexArray, FloatArray]:
        marker, sigma = self._true(times)
        values = np.empty((len(times), 6))
        values[:, :3] = marker + sigma * noise
        values[:, 3:] = sigma
        if self._plant.schedule.active:
            lost = self._plant.schedule.struck("beam_break", times, self._station)
            times, values = np.delete(times, lost), np.delete(values, lost, axis=0)
        return times, values


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
    """Return the sensor's zero, shape (6,), in N and N·m."""
    zero = generator(seed, "sensor", "zero").standard_normal(6)
    return truth_of(cell).sensor.bias * sensor_range(cell) * zero


def sensor_matrix(cell: Cell, seed: int) -> FloatArray:
    """Return the sensor's reading per true wrench, shape (6, 6)."""
    scale, share = sensor_range(cell), truth_of(cell).sensor.cross_talk
    talk = share * generator(seed, "sensor", "cross-talk").standard_normal((6, 6))
    return np.eye(6) + talk * np.divide.outer(scale, scale)


def force_gain(cell: Cell, seed: int) -> ForceGain:
    """Return the gain of the sensor's force axes."""
    matrix, T_sensor_tcp = sensor_matrix(cell, seed), cell.T_sensor_tcp
    T_sensor_tcp = present(T_sensor_tcp, "T_sensor_tcp")
    moment = np.cross(T_sensor_tcp[:3, 3], np.eye(3)).T
    return ForceGain(matrix[:3, :3] + matrix[:3, 3:] @ moment, matrix[:3, 3:])


def _station(seed: int, name: str, position: FloatArray, placing: float) -> FloatArray:
    """Return T_base_station, shape (4, 4): displaced, and with a random orientation."""
    rng = generator(seed, "station", name)
    T = np.eye(4)
    T[:3, 3] = position + placing * rng.standard_normal(3)
    T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    return T


def _draw(slow: float, rate: float) -> Draw:
    """Return the generator of a block of noise of unit size, shape (`BLOCK`, 3)."""
    keep = math.exp(-1.0 / (rate * _AIR_TIME))

    def follow(before: float, drive: float) -> float:
        return keep * before + drive

    def draw(rng: np.random.Generator) -> FloatArray:
        fast, drive = rng.standard_normal((2, BLOCK, 3))
        drive[1:] *= math.sqrt(1.0 - keep**2)
        air = np.transpose([list(accumulate(each, follow)) for each in drive.T.tolist()])
        noise: FloatArray = math.sqrt(1.0 - slow**2) * fast + slow * air
        return noise

    return draw


def averaged_noise(slow: float, time: float, rate: float) -> float:
    """Return the standard deviation of an average over that of a sample.

    A part of the noise is white, the other a first-order process of `_AIR_TIME`; the variance of
    its average is that of an Ornstein-Uhlenbeck process (N. G. van Kampen, "Stochastic Processes
    in Physics and Chemistry", chapter IV).
    """
    ratio = _AIR_TIME / time
    air = 2.0 * ratio * (1.0 - ratio * -math.expm1(-1.0 / ratio))
    return math.sqrt((1.0 - slow**2) / max(time * rate, 1.0) + slow**2 * air)
