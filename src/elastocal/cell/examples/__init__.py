"""Example cells that ``elastocal init`` writes: a commented cell file and its mesh."""

from elastocal.cell.examples.writing import EXAMPLES, write_example

__all__ = ["EXAMPLES", "write_example"]
