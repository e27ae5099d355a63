"""KRL: the plan as a program for a KUKA controller, ``.src`` and ``.dat``."""

from elastocal.planning.export.krl.program import write_krl

__all__ = ["write_krl"]
