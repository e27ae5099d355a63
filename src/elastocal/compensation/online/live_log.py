"""The log of a live compensation: an MCAP file that a thread writes, so that the loop never waits.

The loop puts a cycle into a queue and goes on. Where the thread cannot follow, because the disk is
slow or full, cycles are dropped and counted: a gap in the log does no harm, a late answer does.
"""

import json
import math
import struct
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import Writer

from elastocal.compensation.online.live import LiveCycle
from elastocal.compensation.online.state import Status
from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import readable, require_file
from elastocal.records import check_schema, parse_json
from elastocal.results import brief_repr

LIVE_LOG_SCHEMA = "elastocal.live-log/1"
_MOST_WAITING = 5000
"""Cycles that wait to be written: 20 s at 4 ms."""
_PAUSE = 0.1
"""Between two looks of the thread, in s."""
_AT_ONCE = 25
"""Cycles that it writes before it lets the loop's thread pass."""
_CHUNK = 256 * 1024
_HEAD = 4096
"""Bytes at the beginning of a file that name its schema."""
_PATIENCE = 30.0
"""Time to wait at the end for queued cycles, in s."""
_AXES, _NUMBER = ("x", "y", "z"), {"type": "number"}


class LiveLog:
    """Writes cycles to a file; `put` is for the loop, all else for its observers.

    Parameters
    ----------
    path : Path
        The file; it is whole after `close`.
    joint_names : sequence of str
        Joints, in the order of every cycle's ``q``.
    facts : mapping of str to str
        Further metadata of the file.
    most : int
        Largest number of queued cycles.
    """

    def __init__(
        self,
        path: Path,
        joint_names: Sequence[str],
        facts: Mapping[str, str],
        most: int = _MOST_WAITING,
    ) -> None:
        self._joints, self._facts, self._most = tuple(joint_names), dict(facts), most
        self._waiting: deque[LiveCycle] = deque()
        self._closed = threading.Event()
        self._file: BinaryIO = path.open("wb")
        self._thread = threading.Thread(target=self._run, name="live log", daemon=True)
        self.written = 0
        """Cycles in the file."""
        self.dropped = 0
        """Cycles that are not."""
        self.failure = ""
        """Why the file cannot be written any more; empty while it can."""

    def start(self) -> None:
        """Write from now on."""
        self._thread.start()

    def put(self, cycle: LiveCycle) -> None:
        """Keep a cycle, or drop it; never waits."""
        if len(self._waiting) >= self._most or self.failure:
            self.dropped += 1
        else:
            self._waiting.append(cycle)

    def close(self) -> None:
        """Write what waits, end the file, and let the thread end."""
        self._closed.set()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE)
        self.dropped += len(self._waiting)

    def _run(self) -> None:
        try:
            with self._file:
                self._write()
        except OSError as error:
            self.failure = error.strerror or str(error)

    def _write(self) -> None:
        writer = Writer(self._file, chunk_size=_CHUNK)
        writer.start(library="elastocal")
        joints = json.dumps(self._joints)
        writer.add_metadata(
            "elastocal", {"schema": LIVE_LOG_SCHEMA, "joints": joints, **self._facts}
        )
        schema = json.dumps(_schema(self._joints)).encode()
        number = writer.register_schema("elastocal.LiveCycle", "jsonschema", schema)
        channel = writer.register_channel("/compensation", "json", number)
        ending = False
        while not (ending and not self._waiting):
            # In small pieces, so that the loop's thread can run in between.
            for _ in range(min(_AT_ONCE, len(self._waiting))):
                cycle = self._waiting.popleft()
                time = max(0, round(1e9 * cycle.time))
                writer.add_message(channel, time, _message(cycle, self._joints), time, self.written)
                self.written += 1
            ending = self._closed.wait(0.0 if ending or len(self._waiting) > _AT_ONCE else _PAUSE)
        writer.finish()  # type: ignore[no-untyped-call]


@brief_repr
@dataclass(frozen=True)
class LiveLogFacts:
    """Metadata of a log, read without its cycles."""

    cell: str
    robot: str
    started: str
    joints: tuple[str, ...]
    cycles: int
    seconds: float
    """Time from its first cycle to its last."""


def is_live_log(path: Path) -> bool:
    """Return whether a file begins as a log of a live compensation."""
    with readable(path), path.open("rb") as file:
        return LIVE_LOG_SCHEMA.partition("/")[0].encode() in file.read(_HEAD)


def read_live_log_facts(path: Path) -> LiveLogFacts:
    """Return the facts that a log states of itself.

    Raises
    ------
    SchemaError
        If its version is unknown, or it is truncated or damaged.
    FileAccessError
        If it cannot be read.
    """
    require_file(path)
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            found = next((each.metadata for each in reader.iter_metadata()), {})
            summary = reader.get_summary()
            joints = parse_json(found.get("joints", "[]"), "its list of joints")
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    except (
        McapError,
        ValueError,
        LookupError,
        OverflowError,
        RecursionError,
        struct.error,
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(f"{path} is a damaged MCAP file: {reason}") from error
    check_schema(found.get("schema"), LIVE_LOG_SCHEMA, str(path))
    if summary is None or summary.statistics is None:
        raise SchemaError(f"{path} is cut off: it has no summary")
    counts = summary.statistics
    return LiveLogFacts(
        cell=found.get("cell", ""),
        robot=found.get("robot", ""),
        started=found.get("started", ""),
        joints=tuple(map(str, joints if isinstance(joints, list) else [])),
        cycles=counts.message_count,
        seconds=1e-9 * (counts.message_end_time - counts.message_start_time),
    )


def _message(cycle: LiveCycle, joints: Sequence[str]) -> bytes:
    sample = cycle.sample
    raw = (math.nan,) * 6 if sample is None else (*sample.force, *sample.moment)
    flags = [flag.name.lower() for flag in Status if flag.name and cycle.status & flag.value]
    data: dict[str, object] = {
        "q": _named(joints, cycle.q),
        "force": _named(_AXES, raw[:3]),
        "moment": _named(_AXES, raw[3:]),
        "sample_time": None if sample is None else sample.time,
        "force_tcp": _named(_AXES, cycle.wrench[:3]),
        "moment_tcp": _named(_AXES, cycle.wrench[3:]),
        "deflection": _named(_AXES, cycle.deflection),
        "half_width": _finite(cycle.half_width),
        "correction": _named(_AXES, cycle.correction),
        "status": cycle.status,
        "flags": " ".join(flags),
    }
    return json.dumps(data, separators=(",", ":")).encode()


def _named(names: Sequence[str], values: Sequence[float]) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in zip(names, values, strict=True)}


def _finite(value: float) -> float | None:
    # Ten digits: finer than any sensor, and half the file.
    return float(f"{value:.10g}") if math.isfinite(value) else None


def _schema(joints: Sequence[str]) -> dict[str, object]:
    def vector(description: str, names: Sequence[str] = _AXES) -> dict[str, object]:
        properties = dict.fromkeys(names, _NUMBER)
        return {"type": "object", "description": description, "properties": properties}

    def number(description: str) -> dict[str, object]:
        return {**_NUMBER, "description": description}

    return {
        "type": "object",
        "properties": {
            "q": vector("joint positions of the controller, in rad (m if prismatic)", joints),
            "force": vector("raw, sensor frame, in N"),
            "moment": vector("raw, sensor frame, about its origin, in N m"),
            "sample_time": number("when the wrench was measured, in s of the clock"),
            "force_tcp": vector("conditioned, on the robot, tcp frame, in N"),
            "moment_tcp": vector("conditioned, on the robot, tcp frame, in N m"),
            "deflection": vector("predicted, base, in m"),
            "half_width": number("half the 95 % interval of the deflection, in m"),
            "correction": vector("answered, in the axes of the settings, in m"),
            "status": number("flags of the correction; elastocal.compensation.online.Status"),
            "flags": {"type": "string", "description": "the same in words"},
        },
    }
