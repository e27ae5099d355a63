"""Certify: which springs the data determine.

With forces only and positions only, springs that share an origin add up to one symmetric tensor and
consecutive wrist frames share axes, so some springs are never separately observable, however many
poses are taken. Predictions need only the combinations that are observable; tables must say which
springs are not (docs/explanation/observability.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, Parameter, Spring
from elastocal.identification._least_squares import rank
from elastocal.identification.options import MEDIAN_NORM
from elastocal.identification.problem import Problem, relative_sizes, unit_columns
from elastocal.identification.solve import Factored
from elastocal.identification.spring_sums import Term, sparse_basis
from elastocal.records import record
from elastocal.results import brief_repr

_NOTICEABLE = 1e-2
"""Smaller parts of a combination are not named: the data leave such a spring open by less than a
hundredth of a sensible value. In rich models nearly every spring has a trace in one of them."""
_DUST = 1e-6
"""Part of a sensible value below which a spring counts as rigid."""
_IN_CONE = 1e-6
"""Largest distance of a unit vector from a cone that it counts to."""
_MODEST = 1e-9
"""Distance that each multiplier of the cone's rows counts as: a thousand of them are too far."""
_MOST_STEPS = 100
"""Steps of non-negative least squares by the longer side of their matrix."""
_TWICE = 2.0
"""Standard deviations to either side of a 95 % interval, about."""
_MUCH_MORE = 2.0
"""Times that forces at another tool must load a combination more than at the calibrated one."""
_PROBES, _PROBE_SEED = 60, 0
"""Number and seed of random configurations that determine the attainable rank."""


_CANCELS = 1e-6
"""Share of its parts that a sum may leave over and still count as none."""


@brief_repr
@record()
class FaintParameter:
    """A parameter whose column is below the noise: too weak to see."""

    name: str
    deflection: float
    """Deflection that a sensible value of it makes, root mean square over the readings, in m."""
    noise: float
    """Deflection that the noise of the readings hides, averaged over all poses, in m."""
    reach: float
    """Half-width of the 95 % interval that it would have if all others were known, in its unit."""


@brief_repr
@record()
class Observability:
    """Rank, conditioning, and the springs that are not separately observable."""

    rank: int
    condition: float
    """Condition number of the column-scaled system over the observable directions."""
    observable: tuple[bool, ...]
    """Whether each spring is separately determined."""
    unobservable: tuple[tuple[Term, ...], ...]
    """Combinations of compliances that the data do not see, in a sparse basis, without parts too
    small to matter: adding any multiple of one of them changes no deflection that was measured.
    `attainable_rank` shows whether it changes others."""
    faint: tuple[FaintParameter, ...] = ()
    """Parameters that are too weak to see; not in a group, since only noise hides them."""

    def group_of(self, weights: Mapping[str, float]) -> int | None:
        """Return the number, from 1, of the first combination that leaves a sum of parameters open.

        Parameters
        ----------
        weights : mapping
            Weights of the sum by the names of the parameters.

        Returns
        -------
        int or None
            None: the sum has one value for all that explains the data.
        """
        for number, group in enumerate(self.unobservable, start=1):
            parts = [weights.get(term.spring, 0.0) * term.weight for term in group]
            if abs(sum(parts)) > _CANCELS * sum(map(abs, parts)):
                return number
        return None

    def faint_reach(self, weights: Mapping[str, float]) -> float | None:
        """Return the range that noise leaves to a sum of parameters that are all too weak.

        Parameters
        ----------
        weights : mapping
            Weights of the sum by the names of the parameters.

        Returns
        -------
        float or None
            Half-width of its interval; None: at least one of them is seen.
        """
        reach = {each.name: each.reach for each in self.faint}
        used = [name for name, weight in weights.items() if weight != 0.0]
        if not all(name in reach for name in used):
            return None
        return float(np.linalg.norm([weights[name] * reach[name] for name in used]))

    @property
    def parameters(self) -> int:
        """Number of parameters of all springs."""
        return len(self.observable)

    @property
    def springs(self) -> int:
        """Return `parameters`, by the name that ``check --json`` gives them."""
        return self.parameters


def observability(
    system: Factored,
    springs: Sequence[Spring],
    problem: Problem | None = None,
    compliance: FloatArray | None = None,
) -> Observability:
    """Return the observability of a factored system.

    Parameters
    ----------
    system : Factored
        From `solve.factor`.
    springs : sequence of Spring
        In column order.
    problem, compliance : Problem, ndarray of shape (parameter,), optional
        What was fitted, and the estimate: combinations that its bounds fix are in no group, since
        the fit is unique. By default bounds are ignored.
    """
    parameters = [parameter for spring in springs for parameter in spring.parameters]
    determined = rank(system.s)
    # Which weights count as zero is judged in multiples of sensible sizes: they have no unit. The
    # system was solved in x = scale c, so a combination of x is one of c over the scale.
    size = relative_sizes(parameters)
    unseen = np.linalg.qr(system.Vt[determined:].T / (system.scale * size)[:, None])[0]
    if problem is not None and compliance is not None:
        scale = parameters[0].scale * size
        room = (compliance - problem.lower) / scale, (problem.upper - compliance) / scale
        unseen = left_open(unseen, *room)
    groups = _readable(unseen, parameters)
    condition = system.s[0] / system.s[determined - 1] if determined else np.inf
    mixed = {term.spring for group in groups for term in group}
    observable = tuple(parameter.name not in mixed for parameter in parameters)
    return Observability(determined, float(condition), observable, groups)


def find_faint(
    seen: Observability,
    problem: Problem,
    compliance: FloatArray,
    parameters: Sequence[Parameter],
) -> Observability:
    """Return the observability with the parameters that are too weak to see.

    A column is below the noise when a sensible value would make a deflection that twice the noise
    hides, averaged over the poses: even with all others known, the interval would be wider than
    that value to either side. A sensible value is the largest of `Parameter.scale`, the median size
    of the fitted ones of its unit, and what was fitted for itself. Readings at one pose share their
    errors, so poses count.

    Parameters
    ----------
    seen : Observability
        Observability of the data.
    problem : Problem
        What was fitted.
    compliance : ndarray, shape (parameter,)
        The estimate.
    parameters : sequence of Parameter
        In column order.
    """
    poses = len(np.unique(problem.block))
    residual = np.linalg.norm(problem.residuals(compliance), axis=1)
    noise = _TWICE * float(np.median(residual)) / MEDIAN_NORM / np.sqrt(poses)
    columns = np.sqrt(np.mean(np.square(problem.O).sum(axis=1), axis=0))
    mixed = {term.spring for group in seen.unobservable for term in group}
    faint = []
    for index, parameter in enumerate(parameters):
        alike = [
            abs(c)
            for c, other in zip(compliance.tolist(), parameters, strict=True)
            if other.unit == parameter.unit and abs(c) > _DUST * other.scale
        ]
        usual = float(np.median(alike)) if alike else 0.0
        size = max(parameter.scale, usual, abs(float(compliance[index])))
        deflection = size * float(columns[index])
        if parameter.name not in mixed and 0.0 < deflection < noise:
            reach = noise / float(columns[index])
            faint.append(FaintParameter(parameter.name, deflection, noise, reach))
    names = {each.name for each in faint}
    observable = tuple(
        known and parameter.name not in names
        for known, parameter in zip(seen.observable, parameters, strict=True)
    )
    return replace(seen, observable=observable, faint=tuple(faint))


def attainable_rank(model: ElasticModel, marker_offset: ArrayLike | None = None) -> int:
    """Return the rank that any number of poses and forces would reach.

    Below it, poses or load cases are missing and predictions elsewhere are not covered; at it,
    unobservable combinations have no effect on a deflection under a force.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    """
    n = len(model.parameters)
    blocks = _probe_blocks(model, marker_offset)
    rows = unit_columns(blocks, relative_sizes(model.parameters)).rows
    s = np.linalg.svd(rows.reshape(-1, n), compute_uv=False)
    return rank(np.asarray(s, dtype=float))


def _probe_blocks(model: ElasticModel, marker_offset: ArrayLike | None = None) -> FloatArray:
    """Return observation blocks of forces at many configurations, shape (row, 3, parameter)."""
    limits = model.robot.limits
    lower, upper = np.maximum(limits.lower, -np.pi), np.minimum(limits.upper, np.pi)
    # Random configurations are generic: enough of them reach the largest rank of any set.
    rng = np.random.default_rng(_PROBE_SEED)
    q = rng.uniform(lower, upper, (_PROBES, len(lower)))
    blocks = model.observation_blocks(q[:, None], np.eye(3), marker_offset=marker_offset)
    return blocks.reshape(-1, 3, len(model.parameters))


def unseen_groups(
    model: ElasticModel, seen: Observability, calibrated: ElasticModel
) -> tuple[tuple[Term, ...], ...]:
    """Return the unobservable combinations that forces at another tool's tcp load.

    E.g. the last joint, with a tcp beside its axis; not what the calibrated tool loads as much.

    Parameters
    ----------
    model : ElasticModel
        Robot with another tool, and the springs.
    seen : Observability
        Observability of the calibration.
    calibrated : ElasticModel
        Robot with the calibrated tool, and the springs.
    """
    names = list(model.parameter_names)
    size = relative_sizes(model.parameters)
    blocks, before = _probe_blocks(model), _probe_blocks(calibrated)
    largest = float((np.linalg.norm(blocks, axis=(0, 1)) * size).max())
    found = []
    for group in seen.unobservable:
        vector = np.zeros(len(names))
        for term in group:
            vector[names.index(term.spring)] = term.weight
        vector /= np.abs(vector / size).max()
        known = _MUCH_MORE * float(np.linalg.norm(before @ vector))
        if float(np.linalg.norm(blocks @ vector)) > known + _CANCELS * largest:
            found.append(group)
    return tuple(found)


def left_open(null_space: FloatArray, below: FloatArray, above: FloatArray) -> FloatArray:
    """Return the directions of a null space that bounds leave open, shape (parameter, k).

    A direction is open if no spring at a bound is driven beyond it. The springs that no open
    direction moves away from their bounds are held, and what moves them is no direction that the
    readings leave open.

    Parameters
    ----------
    null_space : ndarray, shape (parameter, k)
        Orthonormal columns, in sensible sizes.
    below, above : ndarray, shape (parameter,)
        Distance of the estimate to its bounds, in sensible sizes.
    """
    # A trace of a spring holds nothing: it has far to go.
    matters = np.linalg.norm(null_space, axis=1) > _NOTICEABLE
    at = [matters & (room < _NOTICEABLE) for room in (below, above)]
    inward = np.vstack([null_space[at[0]], -null_space[at[1]]])
    if not inward.size:
        return null_space
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    held = inward[[_is_held(inward, row) for row in range(len(inward))]]
    if not len(held):
        return null_space
    _, s, Vt = np.linalg.svd(held, full_matrices=True)
    return np.asarray(null_space @ Vt[rank(s) :].T)


def _is_held(inward: FloatArray, row: int) -> bool:
    """Return whether every direction that moves one spring inward drives another outward.

    By Farkas' lemma (S. Boyd, L. Vandenberghe, *Convex Optimization*, 2004, section 5.8.3) that is
    so where the opposite of its row is in the cone of the others, which non-negative least squares
    decide. A linear programme for all rows at once ends without an answer where rows nearly depend
    on one another, and takes four times as long.

    Parameters
    ----------
    inward : ndarray, shape (row, k)
        How each spring at a bound moves away from it, unit vectors.
    row : int
        The spring.
    """
    others = np.delete(inward, row, axis=0)
    if not len(others):
        return False
    # Rows that are opposite but for rounding reach any direction by multipliers of 1e12.
    modest = np.vstack([others.T, _MODEST * np.eye(len(others))])
    opposite = np.concatenate([-inward[row], np.zeros(len(others))])
    try:
        _, distance = nnls(modest, opposite, maxiter=_MOST_STEPS * max(inward.shape))
    except RuntimeError:  # its steps go in circles: the spring counts as open, so as not known
        return False
    return bool(distance < _IN_CONE)


def _readable(unseen: FloatArray, parameters: Sequence[Parameter]) -> tuple[tuple[Term, ...], ...]:
    """Return, by name, the compliances that orthonormal directions in sensible sizes contain."""
    joints = list(dict.fromkeys(parameter.joint for parameter in parameters))
    basis = sparse_basis(unseen, [joints.index(each.joint) for each in parameters])
    basis = np.where(np.abs(basis) < _NOTICEABLE, 0.0, basis) * relative_sizes(parameters)
    return tuple(
        tuple(Term(parameters[i].name, float(vector[i])) for i in map(int, np.flatnonzero(vector)))
        for vector in basis
    )
