"""Example cells that ``elastocal init`` writes: a commented cell file and its mesh."""

from elastocal.cell.examples.writing import EXAMPLES, check_like, write_example

__all__ = ["EXAMPLES", "check_like", "write_example"]
