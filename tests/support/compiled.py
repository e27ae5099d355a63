"""Exported C as the corrector of a simulated process: the closed loop runs through the target."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np

from elastocal.compensation.online import Compensator
from elastocal.compensation.process.loop import CycleInput
from support.exported import GCC, STRICT, written

_STATE = 1 << 16
"""Bytes that are given to the state, whose size only the compiler knows: more than any has."""


class CompiledCorrector:
    """The C of a compensator's design, compiled and called cycle by cycle."""

    def __init__(self, compensator: Compensator, folder: Path) -> None:
        library = written(folder, compensator.design) / "model.so"
        flags = ("-O2", "-fPIC", "-shared")
        source = folder / "elastocal_model.c"
        subprocess.run([GCC, *STRICT, *flags, source, "-o", library, "-lm"], check=True)
        self._c = ctypes.CDLL(str(library))
        self._joints = compensator.design.joints
        triple, joints = 3 * ctypes.c_double, self._joints * ctypes.c_double

        self._encoders = len(compensator.design.settings.encoders.joints)
        links = (
            (("links", self._encoders * ctypes.c_double), ("linked", ctypes.c_int))
            if self._encoders
            else ()
        )

        class Reading(ctypes.Structure):
            _fields_ = (
                ("time", ctypes.c_double), ("q", joints), ("force", triple), ("moment", triple),
                ("ok", ctypes.c_int), *links,
            )  # fmt: skip

        class Correction(ctypes.Structure):
            _fields_ = (
                ("correction", triple), ("deflection", triple),
                ("half_width", ctypes.c_double), ("status", ctypes.c_uint),
            )  # fmt: skip

        self._reading, self._told = Reading, Correction()
        self._state = (ctypes.c_double * (_STATE // 8))()
        assert self._c.elastocal_selftest() == 0
        self.start()

    def start(self) -> None:
        self._c.elastocal_start(self._state)

    def correct(self, cycle: CycleInput) -> np.ndarray:
        for t, raw in zip(cycle.time.tolist(), cycle.raw.tolist(), strict=True):
            reading = self._reading(t, self._of(cycle.q), tuple(raw[:3]), tuple(raw[3:]), 1)
            self._c.elastocal_condition(self._state, ctypes.byref(reading))
        answer = ctypes.byref(self._told)
        if cycle.links is None:
            self._c.elastocal_correct(self._state, self._of(cycle.q), answer)
        else:
            links = (self._encoders * ctypes.c_double)(*cycle.links.tolist())
            self._c.elastocal_correct_with_links(self._state, self._of(cycle.q), links, answer)
        return np.array(self._told.correction)

    @property
    def told(self) -> tuple[float, ...]:
        """Correction, deflection, half width and status of the last cycle."""
        return (
            *self._told.correction,
            *self._told.deflection,
            self._told.half_width,
            self._told.status,
        )

    def zero_encoders(self) -> None:
        self._c.elastocal_zero_encoders(self._state)

    def begin_course(self, q: np.ndarray, deviation: np.ndarray) -> None:
        shown = (3 * ctypes.c_double)(*deviation.tolist())
        self._c.elastocal_begin_course(self._state, self._of(q), shown)

    def _of(self, q: np.ndarray) -> ctypes.Array:
        return (self._joints * ctypes.c_double)(*q.tolist())
