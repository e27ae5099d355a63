"""KRL in and out: points of a ``.src``/``.dat`` pair corrected, all other bytes as they were."""

from elastocal.compensation.offline.krl.compensate import KrlResult, compensate_krl

__all__ = ["KrlResult", "compensate_krl"]
