"""What the primary and secondary port of a Universal Robots controller send: states and messages.

Every package is ``int32 size, uint8 type`` and a payload, big-endian; a robot state (16) holds
sub-packages of the same form. Written from public clients (UniversalRobots/
Universal_Robots_Client_Library and SintefManufacturing/python-urx): robot mode, joints, tool,
master board, Cartesian info. Not sent: kinematics, configuration, force mode, additional info.
"""

import struct
from collections.abc import Mapping, Sequence

from elastocal.sim.wire._rtde_protocol import Value

_HEADER = struct.Struct(">iB")
_STATE, _MESSAGE = 16, 20
_TEXT, _VERSION, _EXCEPTION = 0, 3, 10
_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN = 0, 1, 2, 3, 4
_MODE_LAYOUT = struct.Struct(">Q7?BB3dB")
_JOINT_LAYOUT = struct.Struct(">3d4fB")
_TOOL_LAYOUT = struct.Struct(">BBddfBffB")
_BOARD_LAYOUT = struct.Struct(">iiBBddbbdd4fB??IB?B")
_CARTESIAN_LAYOUT = struct.Struct(">12d")
_PROTECTIVE_STOP, _PLAYING = 3, 2
_VOLTS, _CELSIUS = 48.0, 25.0


def robot_state(values: Mapping[str, Value]) -> bytes:
    """Return the state of a controller whose RTDE outputs are given, by name."""
    stopped = values["safety_mode"] == _PROTECTIVE_STOP
    running = values["runtime_state"] == _PLAYING
    mode = _MODE_LAYOUT.pack(
        *(_microseconds(values), True, True, True, False, stopped, running, False),
        *(int(_number(values, "robot_mode")), 0, 1.0, _number(values, "speed_scaling"), 1.0, 0),
    )
    names = ("actual_q", "target_q", "joint_mode")
    joints = b"".join(
        _JOINT_LAYOUT.pack(q, target, 0.0, 0.0, _VOLTS, _CELSIUS, _CELSIUS, int(own))
        for q, target, own in zip(*(_vector(values, name) for name in names), strict=True)
    )
    tool = _TOOL_LAYOUT.pack(0, 0, 0.0, 0.0, _VOLTS, 0, 0.0, _CELSIUS, 253)
    board = _BOARD_LAYOUT.pack(
        *(0, 0, 0, 0, 0.0, 0.0, 0, 0, 0.0, 0.0, _CELSIUS, _VOLTS, 0.0, 0.0),
        *(int(_number(values, "safety_mode")), False, False, 0, 0, False, 0),
    )
    cartesian = _CARTESIAN_LAYOUT.pack(
        *_vector(values, "actual_TCP_pose"), *_vector(values, "tcp_offset")
    )
    kinds = (_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN)
    parts = zip(kinds, (mode, joints, tool, board, cartesian), strict=True)
    return _package(_STATE, b"".join(_package(kind, part) for kind, part in parts))


def version_message(values: Mapping[str, Value], version: Sequence[int]) -> bytes:
    """Return the message that greets a client: the version of PolyScope."""
    name, (major, minor, bugfix, build) = b"URControl", version
    text = struct.pack(">B", len(name)) + name
    text += struct.pack(">BBii", major, minor, bugfix, build) + b"10-12-2021, 00:00:00"
    return _message(values, _VERSION, text)


def shown_text(values: Mapping[str, Value], text: str) -> bytes:
    """Return what a program shows by ``textmsg``."""
    return _message(values, _TEXT, text.encode("latin-1", "replace"))


def exception_message(values: Mapping[str, Value], text: str) -> bytes:
    """Return why a script was refused, as an exception in its first line."""
    return _message(
        values, _EXCEPTION, struct.pack(">ii", 1, 1) + text.encode("latin-1", "replace")
    )


def _package(kind: int, payload: bytes) -> bytes:
    return _HEADER.pack(_HEADER.size + len(payload), kind) + payload


def _message(values: Mapping[str, Value], kind: int, payload: bytes) -> bytes:
    # 254 says that the message comes from the controller itself.
    return _package(_MESSAGE, struct.pack(">QBB", _microseconds(values), 254, kind) + payload)


def _microseconds(values: Mapping[str, Value]) -> int:
    return int(1e6 * _number(values, "timestamp"))


def _number(values: Mapping[str, Value], name: str) -> float:
    value = values[name]
    return value if isinstance(value, int | float) else value[0]


def _vector(values: Mapping[str, Value], name: str) -> Sequence[float]:
    value = values[name]
    return value if isinstance(value, Sequence) else (value,)
