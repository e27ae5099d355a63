"""Programmed paths with their forces: ``PATH.csv`` (spec section 4), read and written in pieces."""

from elastocal.compensation.path.columns import PathColumns, Wrench, find_columns, find_wrenches
from elastocal.compensation.path.errors import PathError, in_file
from elastocal.compensation.path.text import Piece, TextLayout, count_lines, pieces, read_layout
from elastocal.compensation.path.values import PathValues, read_values, turned_to_base

__all__ = [
    "PathColumns",
    "PathError",
    "PathValues",
    "Piece",
    "TextLayout",
    "Wrench",
    "count_lines",
    "find_columns",
    "find_wrenches",
    "in_file",
    "pieces",
    "read_layout",
    "read_values",
    "turned_to_base",
]
