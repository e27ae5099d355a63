"""One channel of an MCAP file, and the few numbers of the format that both sides need."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

TimeArray = NDArray[np.int64]
"""Times in ns."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
RECORD = struct.Struct("<BQ")
"""Head of every record: opcode, length."""
MESSAGE = struct.Struct("<HIQQ")
"""Head of a message: channel, sequence, log time, publish time."""


@dataclass(frozen=True, eq=False)
class Topic:
    """One channel with all its messages."""

    name: str
    schema_name: str
    schema: str
    """JSON schema of a message."""
    time: TimeArray
    """Log time of each message, shape (message,), in ns."""
    messages: Sequence[bytes]
    """JSON objects, one a time."""

    def schema_record(self, number: int) -> Schema:
        """Return the record that describes the messages."""
        data = self.schema.encode()
        return Schema(id=number, name=self.schema_name, encoding="jsonschema", data=data)

    def channel_record(self, number: int) -> Channel:
        """Return the record that names the channel; its schema has the same number."""
        return Channel(
            id=number, topic=self.name, message_encoding="json", metadata={}, schema_id=number
        )
