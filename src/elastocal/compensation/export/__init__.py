"""C99 for a real-time target: the model as constants, and the steps of the compensator."""

from elastocal.compensation.export.writer import c_files, write_c

__all__ = ["c_files", "write_c"]
