"""A course cycle by cycle: where the path is, and the deviation before and after correction."""

from dataclasses import dataclass

from elastocal.arrays import FloatArray
from elastocal.compensation.process.loop import Passage


@dataclass(frozen=True, eq=False)
class Trace:
    """One course of one seed, at every cycle, without and with correction."""

    seed: int
    course: str
    time: FloatArray
    """Since the course began, shape (cycle,), in s."""
    position: FloatArray
    """Programmed tool centre point in base, shape (cycle, 3), in m."""
    before: FloatArray
    """Signed deviation without correction, shape (cycle,), in m."""
    after: FloatArray
    """Signed deviation with correction, shape (cycle,), in m."""

    @classmethod
    def of(cls, seed: int, before: Passage, after: Passage) -> "Trace":
        """Return the trace of a course that was run twice."""
        name = before.course.name
        return cls(seed, name, before.time, before.position, before.deviation, after.deviation)
