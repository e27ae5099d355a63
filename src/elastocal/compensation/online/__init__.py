"""Online compensation: readings in, corrections out, one pure step a cycle (paper Fig. 5)."""

from elastocal.compensation.online.compensator import Compensator
from elastocal.compensation.online.design import Design, design
from elastocal.compensation.online.rkorr import rkorr
from elastocal.compensation.online.state import Correction, Reading, State, Status

__all__ = ["Compensator", "Correction", "Design", "Reading", "State", "Status", "design", "rkorr"]
