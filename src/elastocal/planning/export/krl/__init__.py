"""KRL: the plan as a program for a KUKA controller, ``.src`` and ``.dat``."""

from elastocal.planning.export.krl.names import check_name
from elastocal.planning.export.krl.program import write_krl
from elastocal.planning.export.krl.targets import takes_krl

__all__ = ["check_name", "takes_krl", "write_krl"]
