"""RTDE of Universal Robots on the controller's side: messages, types of variables, recipes.

Every message is ``uint16 size, uint8 kind`` and a payload, big-endian. Written from the public
description of the interface (protocol versions 1 and 2); in version 1 packages of outputs have no
number of their recipe, and their rate is fixed.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from elastocal.errors import DeviceError

VERSIONS = (1, 2)
"""Versions of the protocol; a client that requests none gets the first."""
_HEADER = struct.Struct(">HB")
_LARGEST = 1 << 16
"""Bytes of one client that wait to be understood, at most."""
_TYPES = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
_OUTPUTS = {
    "DOUBLE": "timestamp speed_scaling target_speed_fraction actual_momentum actual_execution_time"
    " actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0"
    " standard_analog_input1 standard_analog_output0 standard_analog_output1 payload",
    "VECTOR6D": "target_q target_qd target_qdd target_current target_moment actual_q actual_qd"
    " actual_qdd actual_current actual_current_as_torque actual_moment joint_control_output"
    " actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose target_TCP_speed"
    " joint_temperatures actual_joint_voltage ft_raw_wrench payload_inertia tcp_offset",
    "VECTOR3D": "actual_tool_accelerometer payload_cog",
    "INT32": "robot_mode safety_mode safety_status",
    "VECTOR6INT32": "joint_mode",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits",
    "UINT32": "runtime_state robot_status_bits safety_status_bits output_bit_registers0_to_31"
    " output_bit_registers32_to_63",
}
_INPUTS = {
    "UINT32": "speed_slider_mask input_bit_registers0_to_31 input_bit_registers32_to_63",
    "DOUBLE": "speed_slider_fraction standard_analog_output_0 standard_analog_output_1",
    "UINT8": "standard_digital_output_mask configurable_digital_output_mask"
    " standard_digital_output configurable_digital_output standard_analog_output_mask"
    " standard_analog_output_type tool_digital_output_mask tool_digital_output",
    "VECTOR6D": "external_force_torque",
}
_REGISTERS = 48


def _types(named: Mapping[str, str], way: str) -> dict[str, str]:
    types = {name: kind for kind, names in named.items() for name in names.split()}
    for number in range(_REGISTERS):
        types[f"{way}_int_register_{number}"] = "INT32"
        types[f"{way}_double_register_{number}"] = "DOUBLE"
    for number in range(64, 128):
        types[f"{way}_bit_register_{number}"] = "BOOL"
    return types


OUTPUT_TYPES, INPUT_TYPES = _types(_OUTPUTS, "output"), _types(_INPUTS, "input")
Value = float | Sequence[float]


@dataclass(frozen=True)
class Recipe:
    """Variables that travel together, in order."""

    names: tuple[str, ...]
    types: tuple[str, ...]
    """``NOT_FOUND`` for a name that the controller does not know."""

    @classmethod
    def of(cls, names: str, known: Mapping[str, str]) -> "Recipe":
        """Return the recipe of names with commas between them."""
        # Clients end the list with a comma.
        each = tuple(name for name in names.split(",") if name)
        return cls(each, tuple(known.get(name, "NOT_FOUND") for name in each))

    @property
    def complete(self) -> bool:
        """Whether the controller knows every name."""
        return "NOT_FOUND" not in self.types

    @property
    def layout(self) -> struct.Struct:
        """Layout of the values in sequence."""
        return struct.Struct(">" + "".join(_TYPES[kind] for kind in self.types))

    def pack(self, values: Mapping[str, Value]) -> bytes:
        """Return the values of the recipe; 0 for what has none."""
        numbers: list[float | int] = []
        for name, kind in zip(self.names, self.types, strict=True):
            count = int(_TYPES[kind][:-1] or 1)
            given = values.get(name, 0)
            each = [*given] if isinstance(given, Sequence) else [given] * count
            whole = _TYPES[kind][-1] != "d"
            numbers += [int(value) if whole else float(value) for value in each]
        return self.layout.pack(*numbers)

    def unpack(self, payload: bytes) -> dict[str, Value]:
        """Return the values of a package.

        Raises
        ------
        DeviceError
            If it has another size.
        """
        if len(payload) != self.layout.size:
            raise DeviceError(f"an input package of {len(payload)} bytes, not {self.layout.size}")
        numbers, found = [*self.layout.unpack(payload)], dict[str, Value]()
        for name, kind in zip(self.names, self.types, strict=True):
            count = int(_TYPES[kind][:-1] or 1)
            each, numbers = numbers[:count], numbers[count:]
            found[name] = each[0] if count == 1 else each
        return found


def message(kind: str, payload: bytes) -> bytes:
    """Return a message."""
    return _HEADER.pack(_HEADER.size + len(payload), ord(kind)) + payload


def text_message(text: str, version: int, source: str = "elastocal", level: int = 2) -> bytes:
    """Return a text message for display; level 2 is a warning."""
    if version == 1:
        return message("M", bytes([level]) + text.encode())
    parts = [part.encode()[:255] for part in (text, source)]
    return message("M", b"".join(bytes([len(p)]) + p for p in parts) + bytes([level]))


class MessageReader:
    """Cuts the bytes of one client into messages."""

    def __init__(self) -> None:
        self._bytes = b""

    def take(self, data: bytes) -> Iterator[tuple[str, bytes]]:
        """Yield kind and payload of each message that is complete.

        Raises
        ------
        DeviceError
            If a size cannot be, or too much waits.
        """
        self._bytes += data
        if len(self._bytes) > _LARGEST:
            raise DeviceError("more than 64 KB without a message")
        while len(self._bytes) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._bytes)
            if size < _HEADER.size:
                raise DeviceError(f"a message of {size} bytes")
            if len(self._bytes) < size:
                return
            payload, self._bytes = self._bytes[_HEADER.size : size], self._bytes[size:]
            yield chr(kind), payload
