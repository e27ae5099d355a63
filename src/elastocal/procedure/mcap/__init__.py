"""MCAP files whose messages are JSON: the container of the raw streams.

MCAP (https://mcap.dev/spec, version 0) is what Foxglove and PlotJuggler open. The records of the
package `mcap` are used as they are; only the messages of a chunk are framed here, all at once,
because its writer and its reader take as long again for each sample as the JSON itself.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
