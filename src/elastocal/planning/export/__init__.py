"""Plans for people and controllers: a table for spreadsheets, a program for KUKA robots."""

from elastocal.planning.export.krl import check_name, takes_krl, write_krl
from elastocal.planning.export.table import write_table

__all__ = ["check_name", "takes_krl", "write_krl", "write_table"]
