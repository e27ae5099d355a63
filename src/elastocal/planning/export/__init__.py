"""Plans for people and controllers: a table for spreadsheets, a program for KUKA robots."""

from elastocal.planning.export.krl import write_krl
from elastocal.planning.export.table import write_table

__all__ = ["write_krl", "write_table"]
