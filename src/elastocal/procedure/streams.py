"""Raw streams of one pose attempt, read as arrays."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from elastocal.arrays import BoolArray, FloatArray
from elastocal.cell.devices import SensorStatus
from elastocal.errors import SchemaError
from elastocal.procedure.mcap import Messages, read_mcap
from elastocal.procedure.pose_recorder import NANOSECONDS, RECORD, SCHEMA, Mark, PoseRecorder
from elastocal.procedure.stream_messages import ARM, MARKER, MARKS, WRENCH
from elastocal.records import check_schema

__all__ = [
    "ArmStream",
    "Mark",
    "PointStream",
    "PoseRecorder",
    "Streams",
    "WrenchStream",
    "read_streams",
]

EDGE = 1e-6
"""Times that differ by less are equal, in s: clocks of floating point, logs of nanoseconds."""

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class ArmStream:
    """States of the arm, as the controller says them."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    q: FloatArray
    """Joint positions, shape (sample, joint), in rad or m."""
    T_base_tcp: FloatArray
    """Tool frame, shape (sample, 4, 4), in m."""


@dataclass(frozen=True, eq=False)
class WrenchStream:
    """Raw wrenches, in the sensor's frame, bias and tool weight still in."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    force: FloatArray
    """Shape (sample, 3), in N."""
    moment: FloatArray
    """About the sensor's origin, shape (sample, 3), in N·m."""
    force_sigma: FloatArray
    """Of one sample and axis by the maker, shape (sample,), in N; NaN where not known."""
    ok: BoolArray
    """Whether the sensor called the sample good, shape (sample,)."""


@dataclass(frozen=True, eq=False)
class PointStream:
    """Marker positions in the frame of the station that measured them."""

    time: FloatArray
    """Shape (sample,), in s of the clock."""
    position: FloatArray
    """Shape (sample, 3), in m."""
    sigma: FloatArray
    """Of one sample by the maker, shape (sample, 3), in m; NaN where not known."""
    station: NDArray[np.str_]
    """Station of each sample, shape (sample,)."""


@dataclass(frozen=True, eq=False)
class Streams:
    """Everything that the devices said during one pose attempt; the arrays are read-only."""

    joint_names: tuple[str, ...]
    arm: ArmStream
    wrench: WrenchStream
    points: PointStream
    marks: tuple[Mark, ...]


def read_streams(path: Path, spans: Sequence[tuple[float, float]] | None = None) -> Streams:
    """Return the raw streams of a pose attempt.

    Parameters
    ----------
    path : Path
        A file that `PoseRecorder.save` wrote.
    spans : sequence of (float, float), optional
        Starts and ends in s of the clock, to read nothing else: most of the time at a pose goes
        by between its windows. Default: everything.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    SchemaError
        If it is no such file, cut off or damaged.
    """
    contents = read_mcap(path)
    note = contents.metadata.get(RECORD, {})
    check_schema(note.get("schema"), SCHEMA, str(path))
    joints = _joints(path, note)

    def topic(name: str, make: Callable[[FloatArray, list[Any]], Result]) -> Result:
        try:
            return make(*_said(contents.topics.get(name, Messages()), spans))
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            reason = f"{type(error).__name__} {' '.join(str(error).split())}"
            message = f"{path}: {name} holds a message that is not ours: {reason}"
            raise SchemaError(message) from error

    return Streams(
        joints,
        topic(ARM, lambda time, said: _arm_stream(time, said, joints)),
        topic(WRENCH, _wrench_stream),
        topic(MARKER, _point_stream),
        topic(MARKS, _marks),
    )


def _joints(path: Path, note: Mapping[str, str]) -> tuple[str, ...]:
    try:
        return tuple(map(str, json.loads(note["joints"])))
    except (ValueError, TypeError, KeyError) as error:
        raise SchemaError(f"{path}: its metadata do not name the joints of the arm") from error


def _said(
    messages: Messages, spans: Sequence[tuple[float, float]] | None
) -> tuple[FloatArray, list[Any]]:
    """Return times in s and parsed messages of a topic."""
    time, data = np.array(messages.time, dtype=float) / NANOSECONDS, messages.data
    if spans is not None:
        inside = np.zeros(len(time), dtype=bool)
        for start, end in spans:
            inside |= (time >= start - EDGE) & (time <= end + EDGE)
        time, data = time[inside], [data[row] for row in np.flatnonzero(inside).tolist()]
    said: list[Any] = json.loads(b"[" + b",".join(data) + b"]")
    return time, said


def _arm_stream(time: FloatArray, said: list[Any], joints: tuple[str, ...]) -> ArmStream:
    T = np.zeros((len(said), 4, 4))
    T[:, 3, 3] = 1.0
    T[:, :3, 3] = _columns(said, "position", "xyz")
    if said:
        quaternions = _columns(said, "orientation", "xyzw")
        T[:, :3, :3] = Rotation.from_quat(quaternions).as_matrix()
    return ArmStream(_frozen(time), _frozen(_columns(said, "q", joints)), _frozen(T))


def _wrench_stream(time: FloatArray, said: list[Any]) -> WrenchStream:
    ok = np.array([message["status"] == SensorStatus.OK.value for message in said], dtype=bool)
    ok.setflags(write=False)
    return WrenchStream(
        _frozen(time),
        _frozen(_columns(said, "force", "xyz")),
        _frozen(_columns(said, "moment", "xyz")),
        _frozen(np.array([message["force_sigma"] for message in said], dtype=float)),
        ok,
    )


def _point_stream(time: FloatArray, said: list[Any]) -> PointStream:
    station = np.array([message["station"] for message in said], dtype=np.str_)
    station.setflags(write=False)
    return PointStream(
        _frozen(time),
        _frozen(_columns(said, "position", "xyz")),
        _frozen(_columns(said, "sigma", "xyz")),
        station,
    )


def _marks(time: FloatArray, said: list[Any]) -> tuple[Mark, ...]:
    texts = (str(message["text"]) for message in said)
    return tuple(Mark(*mark) for mark in zip(time.tolist(), texts, strict=True))


def _columns(said: list[Any], key: str, names: Sequence[str]) -> FloatArray:
    """Return the numbers under a key, shape (message, name); null becomes NaN."""
    if not said or not names:
        return np.empty((len(said), len(names)))
    pick = itemgetter(*names)
    return np.array([pick(message[key]) for message in said], dtype=float).reshape(len(said), -1)


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
