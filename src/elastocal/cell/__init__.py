"""The cell: its description; the procedure and the devices that carry it out."""

from elastocal.cell.description import Cell, CellFile, load_cell

__all__ = ["Cell", "CellFile", "load_cell"]
