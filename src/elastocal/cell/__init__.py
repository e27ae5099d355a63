"""The cell: its description; the procedure and the devices that carry it out."""

from elastocal.cell.description import Cell, CellFile, load_cell
from elastocal.cell.fingerprint import fingerprint

__all__ = ["Cell", "CellFile", "fingerprint", "load_cell"]
