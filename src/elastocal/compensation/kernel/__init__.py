"""The elastic model as straight-line arithmetic: the one source of the Python and the C step."""

from elastocal.compensation.kernel.compiled import compiled
from elastocal.compensation.kernel.statics import (
    Routine,
    deflection,
    observation_block,
    orientation,
)

__all__ = ["Routine", "compiled", "deflection", "observation_block", "orientation"]
