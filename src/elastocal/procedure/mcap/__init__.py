"""MCAP files whose messages are JSON: the container of the raw streams.

MCAP (https://mcap.dev/spec, version 0) is what Foxglove and PlotJuggler open. The records of the
package `mcap` are used as they are; only the messages of a chunk are framed here, all at once,
because its writer and its reader take as long again for each sample as the JSON itself.
"""

from elastocal.procedure.mcap.reader import Contents, read_mcap
from elastocal.procedure.mcap.topic import Topic
from elastocal.procedure.mcap.writer import write_mcap

__all__ = ["Contents", "Topic", "read_mcap", "write_mcap"]
