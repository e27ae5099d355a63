"""Build: the observation system ``O c = d`` of a dataset (paper Eq. 14-18)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError
from elastocal.identification.least_squares import RANK_TOLERANCE
from elastocal.identification.options import FitOptions, Prior, bounds
from elastocal.identification.poses import pose_blocks


@dataclass(frozen=True, eq=False)
class ScaledRows:
    """Weighted observation blocks whose columns are comparable."""

    rows: FloatArray
    """Columns of unit norm, zero for an unloaded spring, shape (reading, 3, spring)."""
    scale: FloatArray
    """What each column was divided by, shape (spring,); the largest for an unloaded spring."""


@dataclass(frozen=True, eq=False)
class Problem:
    """An inspectable, weighted and bounded least-squares problem.

    ``min || weight * (O c - d) ||`` subject to ``lower <= c <= upper``.
    """

    O: FloatArray  # noqa: E741 - the paper's name
    """Observation blocks, shape (reading, 3, spring)."""
    d: FloatArray
    """Deflections, shape (reading, 3), in m."""
    weight: FloatArray
    """Weight of each row, shape (reading, 3), dimensionless; 1 is a typical row."""
    block: IndexArray
    """Pose block of each reading, shape (reading,)."""
    lower: FloatArray
    """Shape (spring,)."""
    upper: FloatArray
    """Shape (spring,)."""
    prior_rows: FloatArray
    """Rows of the prior, shape (row, spring + 1), right-hand side last; no rows without one."""

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.d)

    @property
    def springs(self) -> int:
        """Number of springs."""
        return int(self.O.shape[2])

    @property
    def scale(self) -> FloatArray:
        """Norm of each weighted column; see `scaled`. Shape (spring,)."""
        return self.scaled().scale

    def scaled(self) -> "ScaledRows":
        """Return the weighted observation blocks with columns of unit norm.

        The column of a spring that no force turns, e.g. of the last joint when the tcp is on its
        axis, is round-off that would pass for information; it becomes zero.
        """
        return unit_columns(self.O * self.weight[..., None])

    def residuals(self, compliance: FloatArray) -> FloatArray:
        """Return ``O c - d``, unweighted, shape (reading, 3), in m."""
        return np.asarray(self.O @ compliance - self.d)

    def reweighted(self, factor: FloatArray) -> "Problem":
        """Return the problem with each reading's squared residual multiplied by a factor."""
        return replace(self, weight=self.weight * np.sqrt(factor)[:, None])

    def without_prior(self) -> "Problem":
        """Return the problem of the data alone."""
        return replace(self, prior_rows=self.prior_rows[:0])

    def take(self, readings: ArrayLike) -> "Problem":
        """Return the problem of some of the readings (a mask or indices)."""
        index = np.asarray(readings)
        return replace(
            self,
            O=self.O[index],
            d=self.d[index],
            weight=self.weight[index],
            block=self.block[index],
        )

    def with_springs(self, springs: IndexArray) -> "Problem":
        """Return the problem of some of the springs, by column."""
        return replace(
            self,
            O=self.O[:, :, springs],
            lower=self.lower[springs],
            upper=self.upper[springs],
            prior_rows=self.prior_rows[:, [*springs, -1]],
        )


def unit_columns(rows: FloatArray) -> ScaledRows:
    """Return observation rows, shape (reading, 3, spring), with columns of unit norm or zero."""
    norms = np.sqrt(np.einsum("rin,rin->n", rows, rows))
    largest = norms.max() or 1.0
    loaded = norms > RANK_TOLERANCE * largest
    gain = np.where(loaded, 1.0 / np.where(loaded, norms, 1.0), 0.0)
    return ScaledRows(rows * gain, np.where(loaded, norms, largest))


def build(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions | None = None,
    marker_offset: ArrayLike | None = None,
) -> Problem:
    """Return the observation system of a set of readings.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        With joints in the robot's order.
    options : FitOptions, optional
        Bounds, weights, prior.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m; see `ElasticModel.observation_blocks`.

    Raises
    ------
    IdentificationError
        If there are too few poses, impossible bounds, or weights without sigmas.
    """
    options = options or FitOptions()
    q, force = readings.joint_position, readings.force
    blocks = model.observation_blocks(q, force, readings.moment, marker_offset)
    lower, upper = bounds(options, len(model.springs))
    return Problem(
        O=blocks,
        d=np.array(readings.deflection),
        weight=_weights(readings, options),
        block=pose_blocks(readings),
        lower=lower,
        upper=upper,
        prior_rows=_prior_rows(options.prior, len(model.springs)),
    )


def _weights(readings: Readings, options: FitOptions) -> FloatArray:
    if options.weights == "none":
        return np.ones((len(readings), 3))
    sigma = readings.marker_sigma
    if sigma is None:
        raise IdentificationError("weights by sigma need marker_sigma in the dataset; it has none")
    if not np.all((sigma > 0.0) & np.isfinite(sigma)):
        raise IdentificationError("weights by sigma need every marker_sigma to be above 0 m")
    return np.asarray(np.median(sigma) / sigma)


def _prior_rows(prior: Prior | None, springs: int) -> FloatArray:
    if prior is None:
        return np.zeros((0, springs + 1))
    mean, sigma = np.asarray(prior.mean, dtype=float), np.asarray(prior.sigma, dtype=float)
    if mean.shape != (springs,) or sigma.shape != (springs,):
        raise IdentificationError(f"prior must have one mean and sigma for {springs} springs")
    if not (np.all(np.isfinite(mean)) and np.all(sigma > 0.0) and 0.0 < prior.noise < np.inf):
        raise IdentificationError("prior needs finite means, and sigmas and noise above 0")
    gain = prior.noise / sigma
    return np.column_stack([np.diag(gain), gain * mean])
