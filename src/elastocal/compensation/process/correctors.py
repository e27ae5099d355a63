"""Correctors of a path: the online compensator, or one that knows the deflection but is late."""

from collections import deque
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.online import Compensator, Reading
from elastocal.errors import CompensationError


class Corrector(Protocol):
    """Corrects the commanded position every cycle."""

    def start(self) -> None:
        """Forget what was."""
        ...

    def correct(
        self, time: FloatArray, q: FloatArray, raw: FloatArray, deflection: FloatArray
    ) -> FloatArray:
        """Return the correction in base, shape (3,), in m.

        Parameters
        ----------
        time : ndarray, shape (reading,)
            Of the readings of the cycle, in s.
        q : ndarray, shape (joint,)
            Measured joints, in rad or m.
        raw : ndarray, shape (reading, 6)
            What the sensor says.
        deflection : ndarray, shape (3,)
            The truth, for a corrector that may know it.
        """
        ...


class ModelCorrector:
    """`elastocal.compensation.online.Compensator` with its state."""

    def __init__(self, compensator: Compensator) -> None:
        """Take a compensator that corrects in base.

        Raises
        ------
        CompensationError
            If it corrects in another frame.
        """
        frame = compensator.design.settings.frame
        if frame != "base":
            raise CompensationError(f"frame of the compensator is {frame!r}: here it must be base")
        self._compensator = compensator
        self._state = compensator.start()

    def start(self) -> None:
        """Forget what was."""
        self._state = self._compensator.start()

    def correct(
        self,
        time: FloatArray,
        q: FloatArray,
        raw: FloatArray,
        deflection: FloatArray,  # noqa: ARG002 (it measures, it does not know)
    ) -> FloatArray:
        """Return the correction; see `Corrector.correct`."""
        state, joints = self._state, q.tolist()
        for t, values in zip(time.tolist(), raw.tolist(), strict=True):
            state = self._compensator.condition(state, Reading(t, joints, values[:3], values[3:]))
        self._state, answer = self._compensator.correct(state, joints)
        return np.array(answer.correction)


class PerfectCorrector:
    """Knows the deflection exactly, and says so late: what a perfect model would reach."""

    def __init__(self, cycles: int) -> None:
        """Be late by so many cycles."""
        self._cycles = cycles
        self._line: deque[FloatArray] = deque()
        self.start()

    def start(self) -> None:
        """Forget what was."""
        self._line = deque(np.zeros(3) for _ in range(self._cycles))

    def correct(
        self,
        time: FloatArray,  # noqa: ARG002
        q: FloatArray,  # noqa: ARG002
        raw: FloatArray,  # noqa: ARG002 (it knows, it does not measure)
        deflection: FloatArray,
    ) -> FloatArray:
        """Return the correction; see `Corrector.correct`."""
        self._line.append(-deflection)
        return self._line.popleft()
