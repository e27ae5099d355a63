"""What every check of a calibration pose offers.

A check is one small class with two verbs' worth of interface: a name with a unit, and the margin
of many candidates at once. Positive is fine. A check that lacks the numbers to judge says so; it
neither passes nor refuses in silence.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.planning.postures import Postures


class Check(Protocol):
    """One condition that a calibration pose has to meet."""

    @property
    def name(self) -> str:
        """Name in reports and plan files, e.g. ``joint_limits``."""

    @property
    def unit(self) -> str:
        """Unit of the margin."""

    @property
    def advice(self) -> str:
        """What a user can move when this check refuses most candidates."""

    def margin(self, postures: Postures) -> FloatArray:
        """Return how far each posture is from being refused, shape (pose,); positive is fine."""


@dataclass(frozen=True, eq=False)
class Verdicts:
    """The margins of many postures under many checks."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    advice: tuple[str, ...]
    margin: FloatArray
    """Shape (check, pose), each in its check's unit."""

    @property
    def passed(self) -> BoolArray:
        """Whether each posture passes every check, shape (pose,). NaN does not pass."""
        return np.asarray(np.all(self.margin > 0.0, axis=0))

    @property
    def refused(self) -> dict[str, int]:
        """How many postures each check refuses."""
        return {
            name: int(np.count_nonzero(~(margin > 0.0)))
            for name, margin in zip(self.names, self.margin, strict=True)
        }

    @property
    def bottleneck(self) -> str | None:
        """The check that alone refuses the most postures; None when every posture passes.

        Postures refused by a single check count first, since they would pass without it.
        """
        fails = ~(self.margin > 0.0)
        if not np.any(fails):
            return None
        alone = (fails & (fails.sum(axis=0) == 1)).sum(axis=1)
        counts = alone if np.any(alone) else fails.sum(axis=1)
        return self.names[int(counts.argmax())]


def verdicts(checks: Sequence[Check], postures: Postures) -> Verdicts:
    """Return the margins of postures under all checks."""
    margins = [np.asarray(check.margin(postures), dtype=float) for check in checks]
    return Verdicts(
        tuple(check.name for check in checks),
        tuple(check.unit for check in checks),
        tuple(check.advice for check in checks),
        np.array(margins).reshape(len(checks), len(postures)),
    )
