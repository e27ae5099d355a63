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
from elastocal.identification.contact import (
    ContactColumns,
    ContactVisibility,
    contact_columns,
    is_doubled,
    is_pressed_sideways,
    require_metrology,
    require_seen,
    visibility,
    whitened,
)
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.encoders import EncoderRows, encoder_rows
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
class OpenNumbers:
    """Numbers beside the springs of which something is known: what a fit finds with these."""

    columns: FloatArray
    """Change of a deflection with each number, shape (reading, 3, number), in m per its unit."""
    expected: FloatArray
    """Shape (number,)."""
    sigma: float
    """Standard deviation of each, in its unit."""
    noise: float
    """Standard deviation of one component of a row, in m."""


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
    sag: int = 0
    """1 where the share of the sag that readings show is open; its column follows those of the
    frames (`elastocal.identification.sag_share`)."""
    contact: tuple[str, ...] = ()
    """Compliances of the contact that holds the tool; their columns follow that of the sag
    (`elastocal.identification.contact`)."""
    tip: int = 0
    """Directions in which the place of the tip is open; their columns come last
    (`elastocal.identification.tip_place`)."""
    shared: FloatArray | None = None
    """Errors that readings of one block share, each of unit variance, over the noise of a typical
    row, shape (reading, 3, error); None: there are none."""
    prior_error: FloatArray | None = None
    """Standard deviation of the right-hand side of each row of the prior over its repetitions,
    shape (row,), in m; None: none is drawn."""
    encoders: EncoderRows | None = None
    """What secondary encoders see; None: there are none."""

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.d)

    @property
    def columns(self) -> int:
        """Number of columns: of the parameters of all springs, of frames, sag, contact, and tip."""
        return int(self.O.shape[2])

    @property
    def springs(self) -> slice:
        """The columns of the springs."""
        return slice(0, self.frame_columns.start)

    @property
    def frame_columns(self) -> slice:
        """The columns of free frames."""
        end = self.sag_columns.start
        return slice(end - NUMBERS * len(self.frames), end)

    @property
    def sag_columns(self) -> slice:
        """The column of the share of the sag that readings show."""
        end = self.contact_columns.start
        return slice(end - self.sag, end)

    @property
    def contact_columns(self) -> slice:
        """The columns of the contact."""
        end = self.tip_columns.start
        return slice(end - len(self.contact), end)

    @property
    def tip_columns(self) -> slice:
        """The columns of the place of the tip."""
        return slice(self.columns - self.tip, self.columns)

    @property
    def arm_columns(self) -> IndexArray:
        """The columns of which the deflection of the arm is made: of springs, and of the tip."""
        return np.asarray(np.r_[self.springs, self.tip_columns], dtype=np.intp)

    def weighted(self) -> FloatArray:
        """Return the weighted rows ``[O d]``, whitened by what readings of a block share.

        Shape (reading, 3, parameter + 1). With secondary encoders the tracker's rows are those of
        what these do not see, and their own follow, shape (reading, 3 + encoder, parameter + 1).
        """
        rows = np.concatenate([self.O, self.d[..., None]], axis=2)
        if self.encoders is None:
            return self._whitened(rows * self.weight[..., None], self.weight)
        rest = self._whitened((rows - self.encoders.seen) * self.weight[..., None], self.weight)
        return np.concatenate([rest, self.encoders.weighted()], axis=1)

    def _whitened(self, rows: FloatArray, weight: FloatArray) -> FloatArray:
        if self.shared is None:
            return rows
        return whitened(rows, self.shared * weight[..., None], self.block)

    def scaled(self) -> "ScaledRows":
        """Return the weighted observation blocks with columns of unit norm.

        The column of a spring that no force turns, e.g. of the last joint when the tcp is on its
        axis, is round-off that would pass for information; it becomes zero.
        """
        return unit_columns(self.weighted()[..., :-1], self.size)

    def residuals(self, compliance: FloatArray) -> FloatArray:
        """Return ``O c - d``, unweighted, shape (reading, 3), in m."""
        return np.asarray(self.O @ compliance - self.d)

    def own_errors(
        self,
        error: FloatArray,
        weight: FloatArray | None = None,
        factor: FloatArray | None = None,
    ) -> FloatArray:
        """Return errors of the readings but for what those of a block share.

        What is shared is taken out as a fit with the same factors does. With equal ones a wrong
        reading spoils the errors of its whole block: where one block in two has one, most errors
        are spoilt and no reading stands out from their median.

        Parameters
        ----------
        error : ndarray, shape (reading, 3)
            In m.
        weight : ndarray, shape (reading, 3), optional
            Weight of each component; 1 by default.
        factor : ndarray, shape (reading,), optional
            Weight that a loss gave each reading, at least 0; 1 by default.
        """
        if weight is None:
            weight = np.ones_like(self.weight)
        if factor is None or self.shared is None:
            return self._whitened((error * weight)[..., None], weight)[..., 0]
        # A reading without weight has errors all the same: their limit is that of a small weight.
        root = np.sqrt(np.maximum(factor, np.finfo(float).eps))[:, None]
        return self.own_errors(error, weight * root) / root

    def reweighted(self, factor: FloatArray) -> "Problem":
        """Return the problem with each reading's squared residual multiplied by a factor."""
        encoders = None if self.encoders is None else self.encoders.reweighted(factor)
        return replace(self, weight=self.weight * np.sqrt(factor)[:, None], encoders=encoders)

    def with_springs(self, blocks: FloatArray, d: FloatArray | None = None) -> "Problem":
        """Return the tracker's problem with other columns of the springs; frames stay."""
        behind = self.O[:, :, self.springs.stop :]
        O = np.concatenate([blocks, behind], axis=2)  # noqa: E741 - the paper's name
        return replace(self, O=O, d=self.d if d is None else d, encoders=None)

    def with_contact(self, contact: ContactColumns, scale: float) -> "Problem":
        """Return the problem with the columns of a contact last, and the errors that rows share.

        Parameters
        ----------
        contact : ContactColumns
            Its columns, and what is known of them.
        scale : float
            Sensible size of the first parameter, in its unit.
        """
        count = len(contact.names)
        limits = np.zeros(count), np.full(count, np.inf)
        wider = _with_columns_behind(
            self, contact.columns, limits, contact.size / scale, contact.prior
        )
        error = self._prior_error_with(contact.prior_error)
        return replace(wider, contact=contact.names, shared=contact.shared, prior_error=error)

    def with_sag(self, share: OpenNumbers, scale: float) -> "Problem":
        """Return the problem with the column of the sag last, whose share is open.

        Parameters
        ----------
        share : OpenNumbers
            One number, dimensionless.
        scale : float
            Sensible size of the first parameter, in its unit.
        """
        return replace(self._with_open(share, scale), sag=1)

    def with_tip(self, shift: OpenNumbers, scale: float) -> "Problem":
        """Return the problem with the columns of a tip last, whose place is open.

        Parameters
        ----------
        shift : OpenNumbers
            Along each axis of the tcp, in m.
        scale : float
            Sensible size of the first parameter, in its unit.
        """
        return replace(self._with_open(shift, scale), tip=len(shift.expected))

    def _with_open(self, numbers: OpenNumbers, scale: float) -> "Problem":
        """Return the problem with the columns of numbers last, and the rows of their prior."""
        count = len(numbers.expected)
        free, gain = np.full(count, np.inf), numbers.noise / numbers.sigma
        prior = gain * np.column_stack([np.eye(count), numbers.expected])
        size = np.full(count, numbers.sigma / scale)
        wider = _with_columns_behind(self, numbers.columns, (-free, free), size, prior)
        return replace(wider, prior_error=self._prior_error_with(np.full(count, numbers.noise)))

    def _prior_error_with(self, more: FloatArray) -> FloatArray:
        """Return the errors of the rows of the prior with those of further rows."""
        error = np.zeros(len(self.prior_rows))
        if self.prior_error is not None:
            error[: len(self.prior_error)] = self.prior_error
        return np.concatenate([error, more])

    def of_springs(self) -> "Problem":
        """Return the problem of the springs in what neither a frame nor the contact can explain.

        Weighted rows are projected on the complement of the frames' columns, and of those of a
        contact of which nothing is known: what the springs' fit and their observability rest on. A
        compliance of the contact that is stated, the share of the sag, and the place of a tip take
        from them what their priors leave open.
        """
        if self.springs.stop == self.columns:
            return self
        n, size = self.springs.stop, np.broadcast_to(self.size, self.lower.shape)
        rows = self.weighted().reshape(-1, self.columns + 1)
        U, s, _ = np.linalg.svd(rows[:, self.frame_columns], full_matrices=False)
        Q = U[:, s > RANK_TOLERANCE * s[0]] if s.size else U
        rows = rows - Q @ (Q.T @ rows)
        behind = slice(self.sag_columns.start, self.columns)
        rows = _without_known(rows, behind, self.prior_rows)
        seen = rows[:, [*range(n), -1]].reshape(len(self), -1, n + 1)
        return Problem(
            O=seen[:, :3, :n],
            d=seen[:, :3, n],
            weight=np.ones_like(self.weight),
            block=self.block,
            lower=self.lower[:n],
            upper=self.upper[:n],
            prior_rows=self.prior_rows[:, [*range(n), -1]],
            size=size[:n],
            encoders=None if self.encoders is None else self.encoders.alone(seen[:, 3:]),
        )

    def without_prior(self) -> "Problem":
        """Return the problem of the data alone."""
        return replace(self, prior_rows=self.prior_rows[:0], prior_error=None)

    def take(self, readings: ArrayLike) -> "Problem":
        """Return the problem of some of the readings (a mask or indices)."""
        index = np.asarray(readings)
        return replace(
            self,
            O=self.O[index],
            d=self.d[index],
            weight=self.weight[index],
            block=self.block[index],
            shared=None if self.shared is None else self.shared[index],
            encoders=None if self.encoders is None else self.encoders.take(index),
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
            encoders=None if self.encoders is None else self.encoders.with_columns(columns),
        )


def _without_known(rows: FloatArray, columns: slice, prior: FloatArray) -> FloatArray:
    """Return rows without what columns explain whose values a prior knows in part.

    A column ``b`` of variance ``v`` adds ``v b b'`` to the covariance of the rows, which are
    whitened by it; without a prior ``v`` is infinite.
    """
    own, rows = range(rows.shape[1])[columns], rows.copy()
    # What is known of one is used first: what is then left of a free one is projected away.
    for column in sorted(own, key=lambda each: not np.any(prior[:, each])):
        b = rows[:, column].copy()
        if not (size := float(np.linalg.norm(b))) > 0.0:
            continue
        gain = float(np.linalg.norm(prior[:, column]))
        less = 1.0 - (gain / float(np.hypot(gain, size)))
        rows -= less * np.outer(b / size, b @ rows / size)
    return rows


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

    Its rows are observation blocks (paper Eq. 15). Where links have masses, they also hold the
    change of the arm's sag between reference and load; see `elastocal.identification.displacement`.

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
        If there are too few poses, impossible bounds, weights without sigmas, campaigns with free
        frames that the readings do not name, readings that no tracker measured and nothing known
        of the contact, or a contact that the springs imitate.
    """
    options = options or FitOptions()
    if options.contact is None:
        require_metrology(readings)
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
        prior_error=None if options.prior is None else _prior_error(options.prior),
        encoders=encoder_rows(model, readings, marker_offset) if options.encoders else None,
    )
    scale = model.parameters[0].scale
    frames = frame_columns(model.robot, readings, options.free_frame, marker_offset)
    if frames.names:
        problem = _with_frames(problem, frames, scale)
    if options.contact is None or readings.contacts is None:
        return problem
    contact = contact_columns(model.robot, readings, problem.block, options.contact)
    problem = problem.with_contact(contact, scale)
    sideways = is_pressed_sideways(model.robot, readings)
    seen = contact_visibility(problem, model)
    require_seen(options.contact, seen, sideways, is_doubled(readings))
    return problem


def contact_visibility(problem: Problem, model: ElasticModel) -> tuple[ContactVisibility, ...]:
    """Return how far the springs of a model imitate each compliance of the contact."""
    return contact_visibility_of(problem, model.parameter_names)


def contact_visibility_of(problem: Problem, names: Sequence[str]) -> tuple[ContactVisibility, ...]:
    """Return how far springs imitate each compliance of the contact, by their parameters' names."""
    rows = problem.weighted().reshape(-1, problem.columns + 1)
    others, own = rows[:, : problem.contact_columns.start], rows[:, problem.contact_columns]
    return visibility(problem.contact, own, names, others)


def _with_frames(problem: Problem, frames: FrameColumns, scale: float) -> Problem:
    """Return a problem of springs with the columns of free frames behind them."""
    free = np.full(len(frames), np.inf)
    prior = np.column_stack([frames.prior, np.zeros(len(frames))])
    wider = _with_columns_behind(problem, frames.columns, (-free, free), frames.size / scale, prior)
    return replace(wider, frames=frames.names)


def _with_columns_behind(
    problem: Problem,
    columns: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    size: FloatArray,
    prior: FloatArray,
) -> Problem:
    """Return a problem with further columns behind its own, and the rows of their prior."""
    before, n = problem.prior_rows, problem.columns
    rows = np.zeros((len(before) + len(prior), n + columns.shape[2] + 1))
    rows[: len(before), :n], rows[: len(before), -1] = before[:, :-1], before[:, -1]
    rows[len(before) :, n:] = prior
    return replace(
        problem,
        O=np.concatenate([problem.O, columns], axis=2),
        lower=np.concatenate([problem.lower, limits[0]]),
        upper=np.concatenate([problem.upper, limits[1]]),
        prior_rows=rows,
        size=np.concatenate([np.atleast_1d(problem.size), size]),
        encoders=None if problem.encoders is None else problem.encoders.widened(columns.shape[2]),
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


def _prior_error(prior: Prior) -> FloatArray:
    """Return the standard deviation of the right-hand side of each row of a prior, in m."""
    return np.full(np.size(prior.mean), prior.noise)


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
