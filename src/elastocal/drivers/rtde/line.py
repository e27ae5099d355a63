"""The line to a controller: its newest sample, and its force sensor."""

import threading
import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import (
    Clock,
    DeviceReading,
    LineCounts,
    SensorStatus,
    WrenchBlock,
    WrenchSample,
    three,
)
from elastocal.drivers.device_clock import DeviceClock
from elastocal.drivers.rtde._ur_rtde import UrReceive
from elastocal.errors import DeviceError, present
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T

_KEPT = 500
"""Samples of the sensor that wait for a reader; older ones are lost."""
_DEAF = 1.0
"""A controller that says nothing new for so long, in s of the wall, is lost."""
_SAFE = (1, 2)
"""Safety modes in which it works: normal, reduced."""
_RUNNING = 7
_SAFETY = {
    3: "protective stop",
    4: "recovery",
    5: "safeguard stop",
    6: "system emergency stop",
    7: "robot emergency stop",
    8: "violation",
    9: "fault",
}
"""Names of the other safety modes."""


@brief_repr
@dataclass(frozen=True, eq=False)
class UrSample:
    """The newest state of a controller."""

    time: float
    """In s of the rig's clock."""
    q: FloatArray
    """Shape (6,), in rad."""
    T_base_tcp: FloatArray
    """Shape (4, 4), in m: the controller's own kinematics."""
    force_base: FloatArray
    """Force on the tool, weight and last zero taken off, shape (3,), in base, in N."""
    fault: str | None
    """Why it does not work."""


class UrLine:
    """Hears a controller in a thread: its newest sample, and every wrench of its sensor."""

    def __init__(self, receive: UrReceive, clock: Clock, rate: float) -> None:
        self._receive, self._clock, self.rate = receive, clock, rate
        self._lock = threading.Lock()
        self._stamps = DeviceClock("rtde")
        self._stamp = float("nan")
        self._wrenches: deque[WrenchSample] = deque(maxlen=_KEPT)
        self._newest: WrenchSample | None = None
        self._sample: UrSample | None = None
        self._heard = time.monotonic()
        self._received = self._skipped = 0
        self._faults: dict[str, None] = {}
        self._lost = ""
        """Why nothing is heard any more; empty while the thread listens."""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._hear, daemon=True)

    def start(self) -> None:
        """Start to receive; return when the first sample has arrived.

        Raises
        ------
        DeviceError
            If none comes.
        """
        self._look()
        self._thread.start()
        self.sample()

    def close(self) -> None:
        """Stop receiving."""
        self._closed.set()
        if self._thread.is_alive():
            self._thread.join(2.0)
        self._receive.disconnect()

    def sample(self) -> UrSample:
        """Return the newest sample.

        Raises
        ------
        DeviceError
            If the controller is lost.
        """
        with self._lock:
            sample, silent = self._sample, time.monotonic() - self._heard
            lost = self._lost
        if lost:
            raise DeviceError(f"rtde: the controller is lost: {lost}")
        if sample is None or silent > _DEAF:
            raise DeviceError(f"rtde: the controller has said nothing for {silent:.1f} s")
        return sample

    def newest(self) -> WrenchSample | None:
        """Return the newest wrench; see `elastocal.cell.WrenchFeed`."""
        with self._lock:
            return self._newest

    def take_wrenches(self) -> list[WrenchSample]:
        """Return the wrenches since the last call."""
        with self._lock:
            taken = list(self._wrenches)
            self._wrenches.clear()
        return taken

    def lines(self) -> tuple[LineCounts, ...]:
        """Return the counts; samples that a newer one overtook were not looked at."""
        counts = LineCounts(
            device="rtde", received=self._received, lost=self._skipped, status=tuple(self._faults)
        )
        return (counts,)

    def readings(self, kinds: Iterable[str]) -> tuple[DeviceReading, ...]:
        """Return the controller's state, a reading for each kind of device.

        Raises
        ------
        DeviceError
            If it is lost.
        """
        sample, wrench = self.sample(), self.newest()
        offset, drift = self._stamps.against_the_pc()
        (counts,) = self.lines()
        whole = DeviceReading(
            kind="",
            device="rtde",
            heard=True,
            problem=sample.fault or "",
            state="" if sample.fault else "running",
            counts=counts,
            offset=offset,
            drift=drift,
        )
        pose = xyzabc_from_T(sample.T_base_tcp)
        arm = replace(whole, kind="arm", position=three(pose[:3]), turn=three(pose[3:]))
        wrench = present(wrench, "wrench")
        force, moment = three(wrench.force), three(wrench.moment)
        sensor = replace(whole, kind="sensor", force=force, moment=moment)
        return tuple(each for each in (arm, sensor) if each.kind in kinds)

    def _count(self, stamp: float, fault: str | None) -> None:
        if self._received:
            self._skipped += max(round((stamp - self._stamp) * self.rate) - 1, 0)
        self._received += 1
        if fault is not None:
            self._faults[fault] = None

    def _hear(self) -> None:
        pause = 0.5 / self.rate
        try:
            while not self._closed.wait(pause):
                self._look()
        except (DeviceError, RuntimeError, OSError, ValueError) as error:
            with self._lock:
                self._lost = " ".join(str(error).split())

    def _look(self) -> None:
        receive, stamp = self._receive, self._receive.getTimestamp()
        if stamp == self._stamp or not receive.isConnected():
            return
        taken = self._stamps.rig_time(stamp, self._clock.now())
        raw = np.array(receive.getFtRawWrench())
        wrench = WrenchSample(taken, raw[:3], raw[3:], SensorStatus.OK)
        q, pose = np.array(receive.getActualQ()), receive.getActualTCPPose()
        force = np.array(receive.getActualTCPForce()[:3])
        if not np.isfinite([*q, *pose, *force]).all():
            raise DeviceError("it sends numbers that are not finite")
        sample = UrSample(
            time=taken,
            q=q,
            T_base_tcp=T_of_pose(pose),
            force_base=force,
            fault=_fault(receive.getRobotMode(), receive.getSafetyMode()),
        )
        with self._lock:
            self._count(stamp, sample.fault)
            self._stamp, self._heard = stamp, time.monotonic()
            self._sample, self._newest = sample, wrench
            self._wrenches.append(wrench)


def _fault(robot_mode: int, safety_mode: int) -> str | None:
    if safety_mode not in _SAFE:
        return _SAFETY.get(safety_mode, f"safety mode {safety_mode}")
    return None if robot_mode == _RUNNING else f"robot mode {robot_mode}, not running"


class UrSensor:
    """The controller's own force/torque sensor: see `elastocal.cell.devices.ForceSensor`.

    Raw: weight of the tool and bias in, in the frame of the tool flange.
    """

    def __init__(self, line: UrLine, force_range: Sequence[float]) -> None:
        self._line, self._range = line, np.array(force_range)

    @property
    def rate(self) -> float:
        """Samples a second."""
        return self._line.rate

    def read(self) -> WrenchBlock:
        """Return the samples since the last call."""
        self._line.sample()
        taken = self._line.take_wrenches()
        force = np.array([each.force for each in taken]).reshape(-1, 3)
        saturated = bool(np.any(np.abs(force) > self._range))
        return WrenchBlock(
            time=np.array([each.time for each in taken]),
            force=force,
            moment=np.array([each.moment for each in taken]).reshape(-1, 3),
            force_sigma=float("nan"),
            moment_sigma=float("nan"),
            status=SensorStatus.SATURATED if saturated else SensorStatus.OK,
            source="rtde sensor",
        )


def T_of_pose(pose: Sequence[float]) -> FloatArray:
    """Return the frame of x, y, z in m and a rotation vector in rad, shape (4, 4)."""
    T = np.eye(4)
    T[:3, 3], T[:3, :3] = pose[:3], Rotation.from_rotvec(pose[3:]).as_matrix()
    return T


def pose_of_T(T: FloatArray) -> list[float]:
    """Return x, y, z in m and the rotation vector in rad of a frame."""
    return [*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist()]
