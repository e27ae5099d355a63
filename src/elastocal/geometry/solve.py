"""Register, and fit by least squares until a step no longer matters beside the noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.arm import ArmErrors
from elastocal.geometry.derivatives import Derivatives
from elastocal.geometry.determined import Fixed
from elastocal.geometry.problem import GeometryProblem, State, prior_weight
from elastocal.results import brief_repr
from elastocal.robot import nearest_rotation

_STEPS, _ROBUST_STEPS = 60, 5
"""Most steps of a fit, and how many of the first weigh far positions less."""
_ALIGNED = 60
"""Most steps of a registration."""
_RETURNS = 20
"""Steps after which a position that was left out once stays out, so that the set settles."""
_DONE = 1e-6
"""Decrease of the sum of squares, in variances of a coordinate, that a step must promise to be
taken: a smaller one moves every unknown by less than a thousandth of its standard deviation."""
_TRIES = 12
"""Most times that a step is shortened."""
_ROUNDING = 1e-9
"""Part of the sum of squares that is lost in rounding."""
_FAIR = 1e-4
"""Part of the promised decrease from which a step is taken."""
_BLUNDER = 7.0
"""Distance in standard deviations of a coordinate from which a position is a blunder."""
_CHI = 1.538
"""Median distance of three coordinates of standard deviation 1."""
_FINEST = 1e-7
"""No tracker is finer, in m."""


def register(problem: GeometryProblem, steps: int = _ALIGNED) -> State:
    """Return stations and markers of the nominal arm: robust, by least absolute distances.

    Parameters
    ----------
    problem : GeometryProblem
        Positions of an arm.
    steps : int
        Most steps; positions that belong to the arm settle in a few.
    """
    data = problem.data
    markers = np.zeros((data.markers.shape[1], 3))
    T_tcp = problem.robot.forward(data.q)[problem.row]
    R_tcp, tcp = T_tcp[:, :3, :3], T_tcp[:, :3, 3]
    of_station = [np.flatnonzero(problem.station == each) for each in range(len(data.stations))]
    of_marker = [np.flatnonzero(problem.marker == each) for each in range(len(markers))]
    weight = np.ones(len(problem))
    T = np.broadcast_to(np.eye(4), (len(data.stations), 4, 4)).copy()
    for _ in range(steps):
        points = tcp + (R_tcp @ markers[problem.marker, :, None])[..., 0]
        before = T, markers
        T = _aligned(points, problem.measured, weight, of_station)
        R, t = T[problem.station, :3, :3], T[problem.station, :3, 3]
        at_tcp = ((problem.measured - t)[:, None] @ R)[:, 0] - tcp
        local = (at_tcp[:, None] @ R_tcp)[:, 0]
        markers = np.array([weight[own] @ local[own] / weight[own].sum() for own in of_marker])
        left = np.linalg.norm(local - markers[problem.marker], axis=1)
        weight = 1.0 / np.maximum(left, max(1e-4, 0.2 * float(np.median(left))))
        if np.abs(T - before[0]).max() < 1e-7 and np.abs(markers - before[1]).max() < 1e-7:
            break
    return State(T, markers, ArmErrors.none(len(problem.robot.joint_names)))


def _aligned(
    points: FloatArray, measured: FloatArray, weight: FloatArray, stations: Sequence[IndexArray]
) -> FloatArray:
    """Return the transform of each station that brings points onto measured ones (Kabsch)."""
    a, b = np.empty((len(stations), 3)), np.empty((len(stations), 3))
    M = np.empty((len(stations), 3, 3))
    for number, own in enumerate(stations):
        w = weight[own] / weight[own].sum()
        a[number], b[number] = w @ points[own], w @ measured[own]
        M[number] = ((measured[own] - b[number]) * w[:, None]).T @ (points[own] - a[number])
    T = np.tile(np.eye(4), (len(stations), 1, 1))
    T[:, :3, :3] = nearest_rotation(M)
    T[:, :3, 3] = b - (T[:, :3, :3] @ a[..., None])[..., 0]
    return T


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryFit:
    """A fit of one rung."""

    state: State
    residual: FloatArray
    """Shape (point, 3), in m."""
    derivatives: Derivatives
    """Derivatives there."""
    free: IndexArray
    """Unknowns that were fitted."""
    fixed: tuple[Fixed, ...]
    used: BoolArray
    """Positions that are no blunders, shape (point,)."""
    sigma: float
    """Robust standard deviation of a coordinate, in m."""


def fit(
    problem: GeometryProblem,
    chosen: tuple[IndexArray, Sequence[Fixed]],
    start: State,
    used: BoolArray | None = None,
) -> GeometryFit:
    """Return the fit of a rung by least squares, blunders left out.

    Steps are Levenberg's and Marquardt's (D. W. Marquardt, SIAM Journal on Applied Mathematics
    11(2), 1963), with new derivatives at each but the first: near-dependent unknowns are separated
    by differences of derivatives that a step of a millimetre changes completely. A step is taken
    only if it lowers the sum of squares, and the fit ends when the best step would lower it by less
    than noise does by chance (`_DONE`).

    Parameters
    ----------
    problem : GeometryProblem
        Fitted problem.
    chosen : tuple
        Free and fixed unknowns, by `told_apart`.
    start : State
        From `register`, or of another rung.
    used : ndarray of bool, shape (point,), optional
        Positions to use; by default the first steps use Huber's loss, and positions more than 7
        standard deviations away are then left out, again after each step.

    Raises
    ------
    GeometryError
        If there are fewer positions than unknowns, or the fit does not settle.
    """
    at, (free, fixed) = start, chosen
    told = int((free < problem.dense).sum())
    # Functions of the joints have priors that are stronger than few positions.
    if 3 * len(problem) < told + 3:
        raise GeometryError(
            f"{len(problem)} positions of markers cannot tell {told} unknowns: measure more poses"
        )
    first_plain = 0 if used is not None else _ROBUST_STEPS
    (r, J), damping, freedom = problem.linearise(at), 0.0, float(told)
    # What is far off before any error of the arm is fitted cannot bend these errors to itself.
    keep = np.linalg.norm(r, axis=1) < _BLUNDER * noise(r) if used is None else used
    for step in range(_STEPS):
        robust, returns = step < first_plain, step <= _RETURNS
        weight, now, sigma = _weights(r, freedom, keep, used, robust=robust, returns=returns)
        same, keep = bool((now == keep).all()), now
        squares = _Squares(problem, free, weight, sigma)
        found = squares.lowered(at, r, J, damping)
        at, r, damping, freedom = found.state, found.residual, found.damping, found.freedom
        if not robust and same and found.promised <= _DONE * sigma**2:
            return GeometryFit(at, r, J, free, tuple(fixed), keep, sigma)
        # Weights of the first steps are rough anyway.
        if step + 1 >= first_plain:
            J = problem.linearise(at)[1]
    names = [problem.unknowns[free[i]].name for i in found.most_moved]
    raise GeometryError(
        f"the fit does not settle: after {_STEPS} steps {', '.join(names)} still change together"
        " by more than the noise"
    )


def noise(residual: FloatArray, freedom: float = 0.0) -> float:
    """Return the robust standard deviation of a coordinate that was measured, in m.

    Parameters
    ----------
    residual : ndarray, shape (point, 3)
        What a fit leaves, in m.
    freedom : float
        Number of unknowns that the fit took from the residuals.
    """
    size = float(np.median(np.linalg.norm(residual, axis=1))) / _CHI
    count = residual.size
    widened = size * float(np.sqrt(count / max(count - freedom, 0.1 * count)))
    return max(widened, _FINEST)


def freedom_of(G: FloatArray, prior: FloatArray) -> float:
    """Return how many unknowns positions determine beside a prior: the trace of the hat matrix.

    (G. Wahba, "Spline Models for Observational Data", 1990, section 4.3.)

    Parameters
    ----------
    G : ndarray, shape (unknown, unknown)
        Normal matrix with the prior.
    prior : ndarray, shape (unknown,)
        Weight of it.
    """
    return float(len(prior) - prior @ np.diag(np.linalg.inv(G)))


def _weights(
    r: FloatArray,
    freedom: float,
    keep: BoolArray,
    used: BoolArray | None,
    *,
    robust: bool,
    returns: bool,
) -> tuple[FloatArray, BoolArray, float]:
    """Return the weight of each position, which are no blunders, and the noise of a coordinate."""
    distance, sigma = np.linalg.norm(r, axis=1), noise(r[keep], freedom)
    if robust:
        return keep * np.minimum(1.0, 2.0 * sigma / np.maximum(distance, _FINEST)), keep, sigma
    if used is not None:
        return used.astype(float), used, sigma
    now = distance < _BLUNDER * sigma
    if not returns:
        now &= keep
    return now.astype(float), now, sigma


@dataclass(frozen=True, eq=False)
class _Step:
    """A step that was taken, or the same state where none lowers the sum."""

    state: State
    residual: FloatArray
    damping: float
    """For the next one."""
    promised: float
    """Decrease of the sum that a step without damping promised, in m²; 0 where only rounding is
    left."""
    freedom: float
    """Unknowns that the positions determine beside the prior."""
    most_moved: IndexArray
    """The free unknowns that it would have moved most, in their likely sizes, the first four."""


class _Squares:
    """A sum of weighed squares with the prior of the arm's errors, and steps that lower it.

    The prior pulls errors of the arm to zero; frames and markers have none.
    """

    def __init__(
        self, problem: GeometryProblem, free: IndexArray, weight: FloatArray, sigma: float
    ) -> None:
        self.problem, self.free, self.weight = problem, free, weight
        self.sizes = np.array([each.size for each in problem.unknowns])
        self.size = self.sizes[free]
        self.prior = prior_weight(problem, sigma)[free]

    def _sum(self, at: State, r: FloatArray) -> float:
        pulled = self.problem.values(at)[self.free] / self.size
        return float(self.weight @ (r**2).sum(axis=1) + self.prior @ pulled**2)

    def lowered(self, at: State, r: FloatArray, J: Derivatives, damping: float) -> _Step:
        """Return a step that lowers the sum, by derivatives near the state."""
        G, h = J.normal(r, self.weight, self.sizes, self.free)
        h -= self.prior * self.problem.values(at)[self.free] / self.size
        G[np.diag_indices_from(G)] += self.prior
        now, diagonal = self._sum(at, r), np.diag(G) + np.finfo(float).tiny
        whole, freedom = np.linalg.solve(G, h), freedom_of(G, self.prior)
        best, most = float(whole @ h), np.argsort(np.abs(whole))[::-1][:4]
        for _ in range(_TRIES):
            x = whole if not damping else np.linalg.solve(G + np.diag(damping * diagonal), h)
            promised = float(2.0 * x @ h - x @ G @ x)
            move = np.zeros(len(self.problem.unknowns))
            move[self.free] = self.size * x
            there = self.problem.moved(at, move)
            left = self.problem.residual(there)
            fall = now - self._sum(there, left)
            if fall > _FAIR * promised:
                calm = damping / 10.0 if fall > 0.5 * promised else damping
                return _Step(there, left, calm if calm > _DONE else 0.0, best, freedom, most)
            damping = max(10.0 * damping, 1e-4)
        return _Step(at, r, 0.0, best if best > _ROUNDING * now else 0.0, freedom, most)
