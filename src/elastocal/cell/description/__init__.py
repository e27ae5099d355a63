"""The description of a cell: the YAML file that an engineer writes, and what it says."""

from elastocal.cell.description.cell import Cell, load_cell
from elastocal.cell.description.file import SCHEMA, CellFile
from elastocal.cell.description.loads import DIRECTIONS

__all__ = ["DIRECTIONS", "SCHEMA", "Cell", "CellFile", "load_cell"]
