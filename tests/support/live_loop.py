"""The loop of `live` as the corrector of a simulated process."""

import numpy as np

from elastocal.cell import PathCycle
from elastocal.compensation.online import Compensator
from elastocal.compensation.online.live import LiveLoop, LiveSample
from elastocal.compensation.process.loop import CycleInput


class LiveCorrector:
    """A `LiveLoop` that is called cycle by cycle, with the readings of the cycle."""

    def __init__(self, compensator: Compensator) -> None:
        self._compensator = compensator
        self.start()

    def start(self) -> None:
        self._samples: list[LiveSample] = []
        self._loop = LiveLoop(self._compensator, lambda: self._samples)
        self._begins = True

    def correct(self, cycle: CycleInput) -> np.ndarray:
        self._samples = [
            LiveSample(time, tuple(raw[:3]), tuple(raw[3:]), ok=True)
            for time, raw in zip(cycle.time.tolist(), cycle.raw.tolist(), strict=True)
        ]
        time = self._samples[-1].time
        shift = self._loop.correction(PathCycle(time, cycle.q.tolist(), self._begins))
        self._begins = False
        return np.array(shift)

    def zero_encoders(self) -> None:
        """Learn nothing: `live` reads no links."""

    def begin_course(self, q: np.ndarray, deviation: np.ndarray) -> None:  # noqa: ARG002
        beyond = deviation - self._loop.last.deflection
        self._loop.begin_course(tuple(beyond.tolist()))
