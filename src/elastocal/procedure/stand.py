"""Where the arm stands when a run or an attempt is over."""

from dataclasses import dataclass
from enum import Enum


class Stand(Enum):
    """Where the arm stands when a run or an attempt is over."""

    HOME = "at HOME"
    WAY = "on its way between poses, off every surface"
    NEAR = "off the surface, before contact"
    APPROACH = "retracted to the approach pose"
    SURFACE = "AT THE SURFACE: it could not retract and may still press"


@dataclass(frozen=True)
class Left:
    """How an arm was left after a fault."""

    stand: Stand
    why: str = ""
    """Why it could not be brought off the surface; empty when it could or need not."""
