"""Build: the observation system ``O c = d`` of a dataset (paper Eq. 14-18).

Readings at one pose share the model error there, so they form a block that is resampled and left
out together. A configuration that was measured twice under two labels is still one block; as two
blocks it would be tested against itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, Parameter
from elastocal.errors import IdentificationError
from elastocal.identification._least_squares import RANK_TOLERANCE
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.frames import NUMBERS, FrameColumns, frame_columns
from elastocal.identification.options import FitOptions, Prior, bounds
from elastocal.results import brief_repr

_SAME_CONFIGURATION = 5e-3
"""Distance in joint space (rad, m) below which two poses are the same configuration: more than
the few millimetres that the controller travels under load, far less than the step between
calibration poses."""

MINIMUM_BLOCKS = 3
"""Fewest distinct poses: one to leave out and two to fit, so that the spread is seen."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ScaledRows:
    """Weighted observation blocks whose columns are comparable."""

    rows: FloatArray
    """Columns of unit norm, zero for an unloaded spring, shape (reading, 3, parameter)."""
    scale: FloatArray
    """Divisor of each column, shape (parameter,); the largest for an unloaded spring."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Problem:
    """An inspectable, weighted and bounded least-squares problem.

    ``min || weight * (O c - d) ||`` subject to ``lower <= c <= upper``.
    """

    O: FloatArray  # noqa: E741 - the paper's name
    """Observation blocks, shape (reading, 3, parameter)."""
    d: FloatArray
    """Deflections, shape (reading, 3), in m."""
    weight: FloatArray
    """Weight of each row, shape (reading, 3), dimensionless; 1 is a typical row."""
    block: IndexArray
    """Pose block of each reading, shape (reading,)."""
    lower: FloatArray
    """Shape (parameter,)."""
    upper: FloatArray
    """Shape (parameter,)."""
    prior_rows: FloatArray
    """Rows of the prior, shape (row, parameter + 1), right-hand side last; no rows without one."""
    size: FloatArray | float = 1.0
    """Sensible size of each parameter over that of the first, shape (parameter,): what makes a
    column in m per rad/(N·m) comparable with one in m per m/N."""
    frames: tuple[str, ...] = ()
    """Sessions whose frames are free; their columns follow those of the springs
    (`elastocal.identification.frames`)."""

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.d)

    @property
    def columns(self) -> int:
        """Number of columns: of the parameters of all springs, and of free frames."""
        return int(self.O.shape[2])

    @property
    def springs(self) -> slice:
        """The columns of the springs."""
        return slice(0, self.columns - NUMBERS * len(self.frames))

    def scaled(self) -> "ScaledRows":
        """Return the weighted observation blocks with columns of unit norm.

        The column of a spring that no force turns, e.g. of the last joint when the tcp is on its
        axis, is round-off that would pass for information; it becomes zero.
        """
        return unit_columns(self.O * self.weight[..., None], self.size)

    def residuals(self, compliance: FloatArray) -> FloatArray:
        """Return ``O c - d``, unweighted, shape (reading, 3), in m."""
        return np.asarray(self.O @ compliance - self.d)

    def reweighted(self, factor: FloatArray) -> "Problem":
        """Return the problem with each reading's squared residual multiplied by a factor."""
        return replace(self, weight=self.weight * np.sqrt(factor)[:, None])

    def with_springs(self, blocks: FloatArray, d: FloatArray | None = None) -> "Problem":
        """Return the problem with other columns of the springs; frames stay as they are."""
        behind = self.O[:, :, self.springs.stop :]
        O = np.concatenate([blocks, behind], axis=2)  # noqa: E741 - the paper's name
        return replace(self, O=O, d=self.d if d is None else d)

    def without_frames(self) -> "Problem":
        """Return the problem of the springs in what no frame can explain.

        Weighted rows are projected on the complement of the frames' columns: what the springs'
        fit and their observability rest on.
        """
        if not self.frames:
            return self
        n, size = self.springs.stop, np.broadcast_to(self.size, self.lower.shape)
        rows = (self.O * self.weight[..., None]).reshape(-1, self.columns)
        U, s, _ = np.linalg.svd(rows[:, n:], full_matrices=False)
        Q = U[:, s > RANK_TOLERANCE * s[0]]
        seen = np.column_stack([rows[:, :n], (self.d * self.weight).ravel()])
        seen -= Q @ (Q.T @ seen)
        return Problem(
            O=seen[:, :n].reshape(-1, 3, n),
            d=seen[:, n].reshape(-1, 3),
            weight=np.ones_like(self.weight),
            block=self.block,
            lower=self.lower[:n],
            upper=self.upper[:n],
            prior_rows=self.prior_rows[:, [*range(n), -1]],
            size=size[:n],
        )

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

    def with_columns(self, columns: IndexArray) -> "Problem":
        """Return the problem of some of the parameters."""
        return replace(
            self,
            O=self.O[:, :, columns],
            lower=self.lower[columns],
            upper=self.upper[columns],
            prior_rows=self.prior_rows[:, [*columns, -1]],
            size=np.broadcast_to(self.size, self.lower.shape)[columns],
        )


def unit_columns(rows: FloatArray, size: FloatArray | float = 1.0) -> ScaledRows:
    """Return observation rows with columns of unit norm, or zero for an unloaded spring.

    Parameters
    ----------
    rows : ndarray, shape (reading, 3, parameter)
        In m per unit of each parameter.
    size : ndarray, shape (parameter,), optional
        Sensible relative size of each parameter; see `relative_sizes`.
    """
    gain, scale = column_scaling(np.sqrt(np.einsum("rin,rin->n", rows, rows)), size)
    return ScaledRows(rows * gain, scale)


def column_scaling(
    norms: FloatArray, size: FloatArray | float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return the columns' factors, zero for an unloaded spring, and `ScaledRows.scale`.

    Parameters
    ----------
    norms : ndarray, shape (..., parameter)
        Norm of each column, in m per unit of each parameter.
    size : ndarray, shape (parameter,), optional
        See `unit_columns`.
    """
    # The deflections that sensible values make have one unit, the norms may have several.
    visible = norms * size
    largest = visible.max(axis=-1, keepdims=True)
    loaded = visible > RANK_TOLERANCE * largest
    gain = np.where(loaded, 1.0 / np.where(loaded, norms, 1.0), 0.0)
    return gain, np.where(loaded, norms, np.where(largest > 0.0, largest, 1.0) / size)


def relative_sizes(parameters: Sequence[Parameter]) -> FloatArray:
    """Return the sensible size of each parameter over that of the first, shape (parameter,)."""
    sizes = np.array([parameter.scale for parameter in parameters])
    return np.asarray(sizes / sizes[0])


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
        If there are too few poses, impossible bounds, weights without sigmas, or campaigns with
        free frames that the readings do not name.
    """
    options = options or FitOptions()
    natural = [parameter.lower for parameter in model.parameters]
    lower, upper = bounds(options, len(natural), natural)
    problem = Problem(
        O=displacement_blocks(model, readings, marker_offset),
        d=np.array(readings.deflection),
        weight=_weights(readings, options),
        block=pose_blocks(readings),
        lower=lower,
        upper=upper,
        prior_rows=_prior_rows(options.prior, len(model.parameters)),
        size=relative_sizes(model.parameters),
    )
    frames = frame_columns(model.robot, readings, options.free_frame, marker_offset)
    if not frames.names:
        return problem
    return _with_frames(problem, frames, model.parameters[0].scale)


def _with_frames(problem: Problem, frames: FrameColumns, scale: float) -> Problem:
    """Return a problem of springs with the columns of free frames behind them."""
    count, free = len(frames), np.full(len(frames), np.inf)
    before = problem.prior_rows
    prior = np.zeros((len(before) + count, problem.columns + count + 1))
    prior[: len(before), : problem.columns], prior[: len(before), -1] = (
        before[:, :-1],
        before[:, -1],
    )
    prior[len(before) :, problem.columns : -1] = frames.prior
    return replace(
        problem,
        O=np.concatenate([problem.O, frames.columns], axis=2),
        lower=np.concatenate([problem.lower, -free]),
        upper=np.concatenate([problem.upper, free]),
        prior_rows=prior,
        size=np.concatenate([np.atleast_1d(problem.size), frames.size / scale]),
        frames=frames.names,
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
    rows = np.eye(springs) if prior.rows is None else np.asarray(prior.rows, dtype=float)
    if mean.shape != sigma.shape or mean.ndim != 1 or rows.shape != (mean.size, springs):
        raise IdentificationError(f"prior must have one mean and sigma for {springs} parameters")
    if not (np.all(np.isfinite(mean)) and np.all(sigma > 0.0) and 0.0 < prior.noise < np.inf):
        raise IdentificationError("prior needs finite means, and sigmas and noise above 0")
    gain = prior.noise / sigma
    return np.column_stack([gain[:, None] * rows, gain * mean])


def pose_blocks(readings: Readings) -> IndexArray:
    """Return the block number of each reading, shape (reading,).

    Raises
    ------
    IdentificationError
        If there are fewer than `MINIMUM_BLOCKS` distinct configurations.
    """
    labels, pose = np.unique(readings.pose, return_inverse=True)
    counts = np.bincount(pose)
    centres = np.stack(
        [np.bincount(pose, column) / counts for column in readings.joint_position.T], axis=1
    )
    pairs = cKDTree(centres).query_pairs(_SAME_CONFIGURATION, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(labels),) * 2)
    count, component = connected_components(graph, directed=False)
    if count < MINIMUM_BLOCKS:
        raise IdentificationError(
            f"the data hold {count} distinct joint configuration{'s' if count > 1 else ''}"
            f" ({len(labels)} pose labels): at least {MINIMUM_BLOCKS} are needed"
        )
    return np.asarray(component[pose], dtype=np.intp)


def same_configuration(readings: Readings, blocks: IndexArray) -> list[tuple[int, ...]]:
    """Return the groups of pose labels that are one configuration."""
    groups = (np.unique(readings.pose[blocks == block]) for block in np.unique(blocks))
    return [tuple(int(label) for label in group) for group in groups if len(group) > 1]
