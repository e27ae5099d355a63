from .correct import Correction as Correction, correct as correct
from .follow import follow as follow, jumps as jumps, nearest_zero_posture as nearest_zero_posture
from .krl import KrlResult as KrlResult, compensate_krl as compensate_krl
from .path_file import (
    Settings as Settings,
    compensate_path as compensate_path,
    programmed as programmed,
)
from .tally import Tally as Tally
