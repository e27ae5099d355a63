"""Recordings of middleware as tables: MCAP with JSON messages, ROS 1 and ROS 2 bags; workbooks.

A topic becomes a table with a column a number: fields by their path (``wrench.force.x``), joints
of a ``JointState`` by their names (``position.joint_a1``), and the column ``time``: the stamp of
the message's header, or when it was recorded where it has none. Of a topic of transforms one frame
is a table: ``/tf:tool0``.

Foreign files that a library reads: in a child process, of bounded time and memory.

A workbook, a bag or a recording is unpacked by code that trusts it: 60 kB may ask for gigabytes,
and what is damaged is raised as anything.
"""

import struct
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from zipfile import BadZipFile

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.summary import Summary
from zstandard import ZstdError

from elastocal.errors import ElastocalError, FileAccessError, LogError, nearest
from elastocal.files import Limit, readable, require_file
from elastocal.logs.table import LogTable
from elastocal.parallel import GuardedError, guarded
from elastocal.records import parse_json

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

_MOST_MEMORY = Limit("ELASTOCAL_MAX_LOG_MB", 500, "MB of memory")
_MOST_SECONDS = Limit("ELASTOCAL_MAX_SECONDS", 8, "s of reading")
_MEMORY_PER_SIZE, _SECONDS_PER_MEGABYTE = 100, 5
"""Further memory and time that reading a regular file may take, relative to its size: a packed
workbook of 1 MB has some 100 000 cells, each a Python object."""
_MEGABYTE = 1_000_000
_BEGINS = {".bag": b"#ROSBAG V", ".mcap": b"\x89MCAP0\r\n", ".db3": b"SQLite format 3\0"}
"""First bytes of files; without this test a library may search gigabytes for the end of a line."""
_DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    AssertionError,
    ArithmeticError,
    RuntimeError,
    SyntaxError,  # what XML that is not well-formed raises
    EOFError,
    MemoryError,
    struct.error,
    zlib.error,
    BadZipFile,
)
"""Exceptions of libraries for damaged files; for a user all of them mean the same."""
_Result = TypeVar("_Result")


def read_bounded(path: Path, what: str, read: Callable[[], _Result]) -> _Result:
    """Return a library's reading of a foreign file, in a child of bounded time and memory.

    Parameters
    ----------
    path : Path
        The file, or the folder of a bag.
    what : str
        What it should be, for the message.
    read : callable
        Reads it.

    Raises
    ------
    LogError
        If it is damaged, or takes more time or memory than a file of its size may.
    ElastocalError
        Any such error that ``read`` raises.
    """
    with readable(path):
        parts = [*path.iterdir()] if path.is_dir() else [path]
        for part in parts:
            require_file(part)
            begin = _BEGINS.get(part.suffix.lower(), b"")
            if begin and part.is_file() and _first(part, len(begin)) != begin:
                raise LogError(f"{part} is no {what}, or damaged: it does not begin like one")
        size = sum(part.stat().st_size for part in parts) / _MEGABYTE
    seconds = _MOST_SECONDS.most + int(_SECONDS_PER_MEGABYTE * size)
    memory = _MOST_MEMORY.most + int(_MEMORY_PER_SIZE * size)
    try:
        found = guarded(partial(_read_or_refuse, read), seconds, memory)
    except GuardedError as error:
        raise LogError(
            f"{path} is no {what}, or damaged: {error} (the variables {_MOST_SECONDS.variable} and"
            f" {_MOST_MEMORY.variable} raise this)"
        ) from error
    if isinstance(found, _Refusal):
        if found.error is not None:
            raise found.error
        raise LogError(f"{path} is no {what}, or damaged: {found.reason}")
    return found


def _first(path: Path, count: int) -> bytes:
    with path.open("rb") as file:
        return file.read(count)


@dataclass(frozen=True)
class _Refusal:
    """Reason why a file was not read: an error of elastocal, or a library's message."""

    error: ElastocalError | None
    reason: str = ""


def _read_or_refuse(read: Callable[[], _Result]) -> _Result | _Refusal:
    try:
        return read()
    except ElastocalError as error:
        return _Refusal(error)
    except _DAMAGE as error:
        return _Refusal(None, " ".join(str(error).split())[:200] or type(error).__name__)


_WHAT = "recording"
RECORDINGS = (".mcap", ".bag", ".db3")
_NANOSECONDS = 1e-9
_LONGEST_ARRAY = 64
"""Longer fields are clouds and pictures, which are no logs of numbers."""
_DEEPEST = 8
_Row = tuple[float, Any]
"""Time of recording in s, and the message."""


def is_recording(path: Path) -> bool:
    """Return whether a path is that of a recording: a file of such a name, or a ROS 2 folder."""
    path = Path(path)
    return path.suffix.lower() in RECORDINGS or (path / "metadata.yaml").is_file()


def read_topics(path: Path) -> dict[str, int]:
    """Return the number of messages of each topic that holds some.

    Raises
    ------
    LogError
        If the file is no recording.
    FileAccessError
        If it cannot be read, or rosbags is not installed.
    """
    _require_rosbags(path)
    return read_bounded(path, _WHAT, partial(_topics, path))


def read_workbook(path: Path, sheet: str | None = None) -> LogTable:
    """Return a sheet of an Excel workbook as a table, by default the first.

    Raises
    ------
    LogError
        If it is no workbook, has no such sheet, or the sheet is empty.
    FileAccessError
        If it cannot be read, or openpyxl is not installed.
    """
    try:
        import openpyxl  # noqa: F401 - here, or the child would do it anew
    except ImportError as error:
        raise FileAccessError(
            f"cannot read {path}: Excel needs openpyxl: pip install 'elastocal[logs]'"
        ) from error
    return read_bounded(path, "Excel workbook", partial(_sheet, path, sheet))


def _sheet(path: Path, sheet: str | None) -> LogTable:
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True, data_only=True)
    try:
        if sheet is not None and sheet not in book.sheetnames:
            raise LogError(f"{path}: there is no sheet {sheet!r} ({', '.join(book.sheetnames)})")
        rows = list(book[sheet or book.sheetnames[0]].iter_rows(values_only=True))
    finally:
        book.close()
    return LogTable.from_rows(str(path), rows)


def _topics(path: Path) -> dict[str, int]:
    if _is_json(path):
        with _mcap(path) as reader:
            summary = _summary(path, reader)
            counts = summary.statistics.channel_message_counts if summary.statistics else {}
            return {c.topic: counts.get(c.id, 0) for c in summary.channels.values()}
    with _bag(path) as bag:
        return {name: topic.msgcount for name, topic in bag.topics.items() if topic.msgcount}


def read_recording(path: Path, topic: str | None) -> LogTable:
    """Return a topic of a recording as a table.

    Parameters
    ----------
    path : Path
        The file or folder.
    topic : str or None
        Its topic, of transforms with ``:`` and the frame; None: the only one.

    Raises
    ------
    LogError
        If the file is no recording, there is no such topic, or its messages hold no numbers.
    FileAccessError
        If it cannot be read, or rosbags is not installed.
    """
    _require_rosbags(path)
    return read_bounded(path, _WHAT, partial(_recording, path, topic))


def _recording(path: Path, topic: str | None) -> LogTable:
    known = _topics(path)
    name, _, frame = (topic or "").partition(":")
    if topic is None and len(known) == 1:
        name = next(iter(known))
    if name not in known:
        raise LogError(
            f"{path}: name one of its topics, not {name or 'none'!r}{nearest(name, known)}"
            f" ({', '.join(sorted(known))})"
        )
    messages = _json_messages(path, name) if _is_json(path) else _bag_messages(path, name)
    rows = [
        {"time": _stamp(message) or time, **dict(_numbers(message))}
        for time, whole in messages
        for message in _parts(whole, frame)
    ]
    if not rows:
        raise LogError(
            f"{path}: topic {topic} holds no message" + (f" of {frame}" if frame else "")
        )
    header = tuple(dict.fromkeys(key for row in rows for key in row))
    values = np.array([[row.get(key, np.nan) for key in header] for row in rows])
    return LogTable(f"{path} {topic or name}", header, tuple(values.T))


def _parts(message: Any, frame: str) -> Sequence[Any]:
    """Return the transforms of a frame in a message of transforms, or the message itself."""
    transforms = _field(message, "transforms")
    if transforms is None:
        return (message,)
    return [each for each in transforms if _field(each, "child_frame_id") == frame]


def _field(message: Any, name: str) -> Any:
    return message.get(name) if isinstance(message, Mapping) else getattr(message, name, None)


def _stamp(message: Any) -> float | None:
    """Return the time in the header of a message in s; None if it has none."""
    stamp = _field(_field(message, "header"), "stamp")
    if stamp is None:
        return None
    seconds = _field(stamp, "sec") or _field(stamp, "secs") or 0
    rest = _field(stamp, "nanosec") or _field(stamp, "nsec") or _field(stamp, "nsecs") or 0
    return float(seconds) + _NANOSECONDS * float(rest) or None


def _numbers(message: Any, path: str = "", depth: int = 0) -> Iterator[tuple[str, float]]:
    """Yield path and value of each number in a message."""
    if isinstance(message, bool | int | float | np.number):
        yield path, float(message)
    elif message is None:
        yield path, np.nan
    elif depth < _DEEPEST and not isinstance(message, str | bytes):
        for name, value in _fields(message):
            yield from _numbers(value, f"{path}.{name}" if path else name, depth + 1)


def _fields(message: Any) -> Iterator[tuple[str, Any]]:
    """Yield name and value of each field; of arrays by joint name where the message names them."""
    if isinstance(message, Mapping):
        yield from ((str(name), value) for name, value in message.items())
        return
    if isinstance(message, list | tuple | np.ndarray):
        if len(message) <= _LONGEST_ARRAY:
            yield from ((str(index), value) for index, value in enumerate(message))
        return
    names = getattr(message, "name", None)
    joints = names if isinstance(names, list) else None
    for name in getattr(message, "__dataclass_fields__", ()):
        value = getattr(message, name)
        if name not in ("header", "name") and not name.startswith("__"):
            named = joints is not None and isinstance(value, np.ndarray)
            yield name, dict(zip(joints or (), value, strict=False)) if named else value


def _is_json(path: Path) -> bool:
    """Return whether a recording is an MCAP file with JSON messages."""
    if Path(path).suffix.lower() != ".mcap":
        return False
    with _mcap(path) as reader:
        channels = _summary(path, reader).channels.values()
        return all(channel.message_encoding == "json" for channel in channels)


def _summary(path: Path, reader: McapReader) -> Summary:
    summary = reader.get_summary()
    if summary is None:
        raise LogError(f"{path} has no summary: the recording was cut off (`mcap recover`)")
    return summary


def _json_messages(path: Path, topic: str) -> Iterator[_Row]:
    with _mcap(path) as reader:
        for _, _, message in reader.iter_messages(topics=[topic]):
            yield message.log_time * _NANOSECONDS, parse_json(message.data, "a message")


def _bag_messages(path: Path, topic: str) -> Iterator[_Row]:
    with _bag(path) as bag:
        wanted = [each for each in bag.connections if each.topic == topic]
        for connection, time, data in bag.messages(connections=wanted):
            yield time * _NANOSECONDS, bag.deserialize(data, connection.msgtype)


@contextmanager
def _mcap(path: Path) -> Iterator[McapReader]:
    """Yield the reader of an MCAP file; what goes wrong meanwhile is one of our errors."""
    try:
        with Path(path).open("rb") as file:
            yield make_reader(file, validate_crcs=True)
    except (McapError, ZstdError) as error:
        raise _damaged(path, error) from error


def _require_rosbags(path: Path) -> None:
    """Refuse a bag if rosbags is not installed; import it here, so that no child repeats it."""
    if Path(path).suffix.lower() == ".mcap":
        return  # most of them need none
    try:
        import rosbags.highlevel  # noqa: F401
    except ImportError as error:
        raise _absent(path) from error


def _absent(path: Path) -> FileAccessError:
    return FileAccessError(
        f"cannot read {path}: ROS bags need rosbags: pip install 'elastocal[logs]'"
    )


@contextmanager
def _bag(path: Path) -> Iterator["AnyReader"]:
    """Yield the reader of a ROS bag; what goes wrong meanwhile is one of our errors."""
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag1 import ReaderError as BagOneError
        from rosbags.rosbag2 import ReaderError as BagTwoError
        from rosbags.serde import SerdeError
        from rosbags.typesys import Stores, TypesysError, get_typestore
    except ImportError as error:
        raise _absent(path) from error
    # The database uses apsw, in older versions sqlite3; only rosbags imports them.
    databases = (sys.modules[name].Error for name in ("apsw", "sqlite3") if name in sys.modules)
    damage = (AnyReaderError, BagOneError, BagTwoError, SerdeError, TypesysError, *databases)
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as bag:
            yield bag
    except damage as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: BaseException) -> LogError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return LogError(f"{path} is no {_WHAT}, or damaged: {reason}")
