"""Certify: which springs the data determine.

With forces only and positions only, springs that share an origin add up to one symmetric tensor and
consecutive wrist frames share axes, so some springs are never separately observable, however many
poses are taken. Others are told apart in theory, but by less than noise hides: few loads that are
nearly parallel. Predictions need only the combinations that are observable; tables must say which
springs are not (docs/explanation/observability.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls
from scipy.sparse.csgraph import connected_components

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic import ElasticModel, Parameter, Spring
from elastocal.identification._least_squares import rank
from elastocal.identification.options import MEDIAN_NORM
from elastocal.identification.problem import Problem, relative_sizes, unit_columns
from elastocal.identification.solve import Factored
from elastocal.identification.spring_sums import (
    MOST_TERMS,
    Term,
    complement,
    eliminated,
    sparse_basis,
    sum_weights,
)
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
_MUCH_OPEN = 0.5
"""The same of combinations that noise hides, over the largest part."""
_TOLD = 0.5
"""Standard deviation of a spring over its likely size, or over its value, up to which the readings
tell it."""
_WIDE = 10.0
"""Likely sizes up to which a spring may be in a fit without a prior, if none is larger."""
_LINKED = 0.1
"""Correlation above which springs are hidden together."""
_SMALL_PART = 0.02
"""Smaller parts of a hidden combination are not named, in likely sizes."""
_EXCHANGED = 0.1
"""The same of what known springs take of one that is hidden beside them."""


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
    hidden: tuple[tuple[Term, ...], ...] = ()
    """Combinations that noise hides: along them the readings say less than the likely size of a
    spring does. Their numbers follow those of `unobservable`."""
    reach: tuple[float, ...] = ()
    """Half-width of the 95 % interval of each parameter by noise alone, in its unit, since draws of
    one at a bound agree with one another. Empty in older files."""

    def group_of(self, weights: Mapping[str, float]) -> int | None:
        """Return the number, from 1, of the first combination that leaves a sum of parameters open.

        Combinations that noise hides are estimates themselves, so that they count only if they
        leave half of the sum's largest part open.

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
        for number, group in enumerate(self.hidden, start=len(self.unobservable) + 1):
            parts = [weights.get(term.spring, 0.0) * term.weight for term in group]
            if abs(sum(parts)) > _MUCH_OPEN * max(map(abs, parts)):
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

    def reach_of(self, weights: FloatArray, own: slice) -> float:
        """Return the half-width of the 95 % interval of a sum of a spring's parameters, by noise.

        Parameters
        ----------
        weights : ndarray, shape (parameter of the spring,)
            Weights of the sum.
        own : slice
            Which of all parameters they are.
        """
        return float(np.linalg.norm(weights * self.reach[own])) if self.reach else 0.0

    def seen_beside(self, parameters: Sequence[Parameter]) -> tuple[tuple[Term, ...], ...]:
        """Return what the readings do tell of springs that are in a combination: sums of them.

        A sum is told if no combination changes it. Those that are too long to read, or add
        up numbers of different units, are left out.

        Parameters
        ----------
        parameters : sequence of Parameter
            In column order.
        """
        names = [each.name for each in parameters]
        joints = list(dict.fromkeys(each.joint for each in parameters))
        found = list[tuple[Term, ...]]()
        open_ = sum_weights((*self.unobservable, *self.hidden), names)
        together = (open_ != 0.0).astype(float) @ (open_ != 0.0).T.astype(float)
        _, label = connected_components(together > 0.0)
        for number in dict.fromkeys(label.tolist()):
            rows = open_[label == number]
            own = np.flatnonzero(np.any(rows != 0.0, axis=0)).tolist()
            if len({parameters[i].unit for i in own}) > 1:
                continue
            basis = sparse_basis(
                complement(rows[:, own]), [joints.index(parameters[i].joint) for i in own]
            )
            for vector in basis:
                members = np.flatnonzero(np.abs(vector) > _NOTICEABLE).tolist()
                if len(members) <= MOST_TERMS:
                    terms = ((names[own[m]], _three_digits(float(vector[m]))) for m in members)
                    found.append(tuple(Term(*term) for term in terms))
        return tuple(found)

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


def likely_sizes(problem: Problem, parameters: Sequence[Parameter]) -> FloatArray:
    """Return how large the parameters of this class of arm are, shape (parameter,), in their units.

    One number, common to all springs in sensible sizes, is what any readings determine: it is about
    1 for an arm of some tonnes, and 100 for one that a person can lift.

    Parameters
    ----------
    problem : Problem
        Problem of the springs, without frames.
    parameters : sequence of Parameter
        In column order.
    """
    scale = np.array([parameter.scale for parameter in parameters])
    positive = np.array([parameter.lower >= 0.0 for parameter in parameters])
    together = (problem.O @ np.where(positive, scale, 0.0) * problem.weight).ravel()
    square = float(together @ together)
    softness = float(together @ (problem.d * problem.weight).ravel()) / square if square else 0.0
    return np.asarray(scale * (softness if softness > 0.0 else 1.0))


def find_hidden(
    seen: Observability,
    problem: Problem,
    compliance: FloatArray,
    parameters: Sequence[Parameter],
    sizes: FloatArray,
    held: bool = False,
) -> Observability:
    """Return the observability with the combinations that noise hides.

    A spring is known if its standard deviation is at most half of its likely size, or of its value:
    the readings then say three times as much as the likely size does. That of a fit with a normal
    prior is the posterior's (A. Gelman and others, *Bayesian Data Analysis*, 2013, section 14.8).
    Readings at one pose share their errors, so poses count. Bounds are not looked at: one that
    holds a spring at zero gives its share to those beside it. A spring that is hidden only beside
    known ones is in a combination with them, and they stay known.

    Parameters
    ----------
    seen : Observability
        Observability of the data, with faint parameters.
    problem : Problem
        What was fitted; its prior is not looked at.
    compliance : ndarray, shape (parameter,)
        The estimate.
    parameters : sequence of Parameter
        In column order.
    sizes : ndarray, shape (parameter,)
        Likely sizes of the parameters, in their units.
    held : bool
        Whether a prior of these sizes is part of the fit.
    """
    Vt, information = _information(problem, compliance, sizes)
    known, usual = np.array(seen.observable), np.maximum(1.0, np.abs(compliance) / sizes)
    # Without a prior a spring may be what no arm's is, and those beside it what is then left.
    width = 1.0 if held else max(_WIDE, float(usual.max()))
    spread = 1.0 / (information + 1.0 / width**2)
    variance = np.square(Vt.T) @ spread
    unsure = known & (variance > np.square(_TOLD * usual))
    seen = replace(seen, reach=tuple((_TWICE * sizes * np.sqrt(variance)).tolist()))
    members = np.flatnonzero(unsure)
    if not len(members):
        return seen
    # Whether the readings would tell a spring if all others were known.
    alone = 1.0 / (np.square(Vt.T) @ information + 1.0 / width**2)
    shown = alone <= np.square(_TOLD * usual)
    left = Vt[spread > _TOLD**2][:, members].T
    hidden, faint = list[tuple[Term, ...]](), list[FaintParameter]()
    for component in _linked(left):
        own = members[component]
        for vector in _combinations(left[component]):
            parts = [(i, vector[j]) for j, i in enumerate(own) if abs(vector[j]) > _SMALL_PART]
            if len(parts) == 1 and shown[parts[0][0]]:
                parts = _exchanged(parts[0][0], Vt, spread)
            if len(parts) == 1:
                faint.append(_faint(parts[0][0], problem, parameters, sizes, variance))
                continue
            weights = np.array([part * sizes[i] for i, part in parts])
            weights /= weights[np.abs(weights).argmax()]
            names = [parameters[i].name for i, _ in parts]
            hidden.append(tuple(map(Term, names, map(_three_digits, weights.tolist()))))
    return replace(
        seen,
        observable=tuple((known & ~unsure).tolist()),
        faint=(*seen.faint, *faint),
        hidden=tuple(hidden),
    )


def _information(
    problem: Problem, compliance: FloatArray, sizes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return directions in likely sizes, a row each, and what the readings tell of each.

    The information is that of a normal prior where it is 1. Directions that no reading changes are
    left out: `observability` judges them.
    """
    residual = problem.residuals(compliance) * problem.weight
    noise = float(np.median(np.linalg.norm(residual, axis=1))) / MEDIAN_NORM
    # Readings without any noise tell what they tell, but not infinitely well.
    noise = max(noise, np.finfo(float).eps * float(np.abs(problem.d).max()))
    poses = len(np.unique(problem.block))
    scaled = problem.scaled()
    unit = scaled.rows.reshape(-1, len(sizes))
    determined = rank(np.asarray(np.linalg.svd(unit, compute_uv=False), dtype=float))
    s, Vt = np.linalg.svd(unit * scaled.scale * sizes, full_matrices=False)[1:]
    return Vt[:determined], np.square(s[:determined] / noise) * poses / len(problem)


def _linked(left: FloatArray) -> list[IndexArray]:
    """Return the springs that directions, shape (spring, k), mix with one another."""
    together = left @ left.T
    size = np.sqrt(np.diag(together))
    count, label = connected_components(np.abs(together) > _LINKED * np.outer(size, size))
    return [np.flatnonzero(label == number) for number in range(count)]


def _combinations(left: FloatArray) -> FloatArray:
    """Return a basis of directions, shape (spring, k), each led by a spring of its own.

    Shape (combination, spring); the largest part of each is 1.
    """
    U, s, _ = np.linalg.svd(left, full_matrices=False)
    basis = U[:, s > _TOLD] if np.any(s > _TOLD) else U[:, :1]
    return np.array(list(eliminated(basis)))


def _exchanged(index: int, Vt: FloatArray, spread: FloatArray) -> list[tuple[int, float]]:
    """Return by how much the others change with a spring that noise moves by its likely size."""
    moved = Vt.T @ (spread * Vt[:, index])
    moved /= moved[index]
    most = np.argsort(-np.abs(moved), kind="stable")[:MOST_TERMS].tolist()
    return [(index, 1.0)] + [
        (i, float(moved[i])) for i in most if i != index and abs(moved[i]) > _EXCHANGED
    ]


def _three_digits(weight: float) -> float:
    """Return a weight of what is estimated itself."""
    return float(f"{weight:.3g}")


def _faint(
    index: int,
    problem: Problem,
    parameters: Sequence[Parameter],
    sizes: FloatArray,
    variance: FloatArray,
) -> FaintParameter:
    """Return a parameter whose own column is below the noise."""
    reach = _TWICE * float(sizes[index] * np.sqrt(variance[index]))
    column = float(np.sqrt(np.mean(np.square(problem.O[:, :, index]).sum(axis=1))))
    size = float(sizes[index])
    return FaintParameter(parameters[index].name, size * column, reach * column, reach)


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
