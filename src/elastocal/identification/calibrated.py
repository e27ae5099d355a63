"""The calibrated model: what the compensation and every prediction work with."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, check_vectors
from elastocal.errors import SpringError
from elastocal.identification.observability import Observability
from elastocal.identification.uncertainty import interval
from elastocal.results import brief_repr

_CHUNK = 2000
"""Configurations predicted at a time, so that the draws of a long path fit into memory."""


@brief_repr
@dataclass(frozen=True)
class Prediction:
    """Predicted deflections with 95 % intervals: of the fit, and of what would be measured."""

    deflection: FloatArray
    """Real minus commanded tcp position in base, shape (row, 3), in m."""
    low: FloatArray
    """Lower ends of what another campaign would predict (bootstrap draws), shape (row, 3), in m."""
    high: FloatArray
    """Upper ends of that, shape (row, 3), in m."""
    measured_low: FloatArray
    """Lower ends of what would be measured, shape (row, 3), in m: with what the springs cannot
    express, and the noise of a measurement. NaN where the model does not know its misfit."""
    measured_high: FloatArray
    """Upper ends of that, shape (row, 3), in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class CalibratedModel:
    """An elastic model with identified compliances and their bootstrap draws."""

    model: ElasticModel
    compliance: FloatArray
    """Shape (spring,), in rad/(N·m) or m/N."""
    draws: FloatArray
    """Bootstrap draws, shape (draw, spring)."""
    observability: Observability
    provenance: str = ""
    """Where the data came from."""
    misfit: float = float("nan")
    """Share of a predicted deflection that 95 % of the errors along an axis stayed below at
    left-out poses; NaN: not known. See `HeldOut.misfit`."""

    def __post_init__(self) -> None:
        for name in ("compliance", "draws"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness of each spring, ``1 / c``, infinite where the compliance is zero."""
        return np.divide(
            1.0,
            self.compliance,
            out=np.full_like(self.compliance, np.inf),
            where=self.compliance != 0,
        )

    def interval(self) -> tuple[FloatArray, FloatArray]:
        """Return the 95 % intervals of the compliances, two arrays of shape (spring,)."""
        return interval(self.draws)

    def predict(
        self, q: ArrayLike, force: ArrayLike, moment: ArrayLike | None = None
    ) -> Prediction:
        """Return the deflections at configurations under loads.

        Parameters
        ----------
        q : array_like, shape (row, joint)
            Joint positions in rad or m.
        force : array_like, shape (row, 3)
            Force on the robot at the tcp in base, in N.
        moment : array_like, shape (row, 3), optional
            Moment on the robot about the tcp in base, in N·m.
        """
        q, force = self.model.robot.check_positions(q), check_vectors("force", force)
        moment = None if moment is None else check_vectors("moment", moment)
        for name, array in (("force", force), ("moment", moment)):
            if q.ndim != 2 or (array is not None and array.shape != (len(q), 3)):
                shape = None if array is None else array.shape
                raise SpringError(f"{name} {shape} does not have a row for each of q {q.shape}")
        result = np.empty((3, len(q), 3))
        for start in range(0, len(q), _CHUNK):
            rows = slice(start, start + _CHUNK)
            m = None if moment is None else moment[rows]
            blocks = self.model.observation_blocks(q[rows], force[rows], m)
            result[0, rows] = blocks @ self.compliance
            result[1:, rows] = interval(np.moveaxis(blocks @ self.draws.T, -1, 0))
        deflection, low, high = result
        return Prediction(deflection, low, high, *self._measured(deflection, low, high))

    def _measured(
        self, deflection: FloatArray, low: FloatArray, high: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Widen the intervals of the fit by the misfit, as independent errors add up."""
        error = self.misfit * np.linalg.norm(deflection, axis=1, keepdims=True)
        # The point estimate may lie outside the draws when a spring is at its bound.
        below, above = np.maximum(deflection - low, 0.0), np.maximum(high - deflection, 0.0)
        return deflection - np.hypot(below, error), deflection + np.hypot(above, error)
