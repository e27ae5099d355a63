"""Offline correction of a programmed path: the commanded pose whose loaded tcp is the programmed.

See `correct` for the equation, `compensate_path` for CSV files, `compensate_krl` for KUKA programs.
"""

from elastocal.compensation.offline.correct import Correction, correct
from elastocal.compensation.offline.follow import follow, nearest_zero_posture
from elastocal.compensation.offline.krl import KrlResult, compensate_krl
from elastocal.compensation.offline.path_file import Settings, compensate_path
from elastocal.compensation.offline.tally import Tally

__all__ = [
    "Correction",
    "KrlResult",
    "Settings",
    "Tally",
    "compensate_krl",
    "compensate_path",
    "correct",
    "follow",
    "nearest_zero_posture",
]
