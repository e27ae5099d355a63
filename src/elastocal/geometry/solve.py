"""Register, find what the positions do not tell apart, and fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.arm import ArmErrors
from elastocal.geometry.problem import RUNGS, GeometryProblem, State
from elastocal.results import brief_repr
from elastocal.robot import nearest_rotation
from elastocal.wording import phrase

_DEPENDENT = 1e-7
"""Part of a weighed column that is new beside those before it, below which nothing is."""
_STEPS, _ROBUST_STEPS = 40, 5
"""Most steps of a fit, and how many of the first weigh far positions less."""
_LINEAR = 1e-2
"""Move of a marker, in m, from which derivatives are taken anew."""
_DONE = 1e-7
"""Largest move of a marker by a step that ends the iteration, in m."""
_BLUNDER = 7.0
"""Distance in standard deviations of a coordinate from which a position is a blunder."""
_CHI = 1.538
"""Median distance of three coordinates of standard deviation 1."""
_FINEST = 1e-7
"""No tracker is finer, in m."""
PRIOR_WIDTH = 30.0
"""Standard deviation of the prior of an unknown, in its likely sizes."""
_MOST_ROWS = 3000
"""Largest number of positions that decide which unknowns are independent."""


@dataclass(frozen=True)
class Fixed:
    """An unknown that the positions do not tell apart from others."""

    name: str
    why: str


def register(problem: GeometryProblem) -> State:
    """Return stations and markers of the nominal arm: robust, by least absolute distances."""
    data = problem.data
    joints = len(problem.robot.joint_names)
    markers = np.zeros((data.markers.shape[1], 3))
    T_tcp = problem.robot.forward(data.q)[problem.row]
    weight = np.ones(len(problem))
    T = np.broadcast_to(np.eye(4), (len(data.stations), 4, 4)).copy()
    for _ in range(60):
        points = T_tcp[:, :3, 3] + np.einsum(
            "nij,nj->ni", T_tcp[:, :3, :3], markers[problem.marker]
        )
        before = T.copy(), markers.copy()
        for station in range(len(T)):
            own = problem.station == station
            T[station] = _aligned(points[own], problem.measured[own], weight[own])
        R, t = T[problem.station, :3, :3], T[problem.station, :3, 3]
        at_tcp = np.einsum("nji,nj->ni", R, problem.measured - t) - T_tcp[:, :3, 3]
        local = np.einsum("nji,nj->ni", T_tcp[:, :3, :3], at_tcp)
        for marker in range(len(markers)):
            own = problem.marker == marker
            markers[marker] = (weight[own, None] * local[own]).sum(axis=0) / weight[own].sum()
        left = np.linalg.norm(local - markers[problem.marker], axis=1)
        weight = 1.0 / np.maximum(left, max(1e-4, 0.2 * float(np.median(left))))
        if np.abs(T - before[0]).max() < 1e-7 and np.abs(markers - before[1]).max() < 1e-7:
            break
    return State(T, markers, ArmErrors.none(joints))


def _aligned(points: FloatArray, measured: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the transform that brings points onto measured ones (Kabsch)."""
    w = weight / weight.sum()
    a, b = w @ points, w @ measured
    T = np.eye(4)
    T[:3, :3] = nearest_rotation(((measured - b) * w[:, None]).T @ (points - a))
    T[:3, 3] = b - T[:3, :3] @ a
    return T


def told_apart(
    J: FloatArray, problem: GeometryProblem, rung: str
) -> tuple[IndexArray, list[Fixed]]:
    """Return the unknowns of a rung that are determined, and why the others are not.

    Unknowns are taken in the order of the ladder; one whose weighed column is a combination of
    those before is fixed at zero, and named with them. The derivatives are to be those of the
    nominal arm: small errors turn what cannot be told apart into what hardly can.
    """
    rungs = RUNGS[: RUNGS.index(rung) + 1]
    order = [i for r in rungs for i, u in enumerate(problem.unknowns) if u.rung == r]
    size = np.array([u.size for u in problem.unknowns])
    # Positions of every station and marker, evenly; all of them tell no more.
    some = np.unique(np.linspace(0, len(J) - 1, _MOST_ROWS).astype(np.intp))
    flat = J[some].reshape(-1, J.shape[2])[:, order] * size[order]
    R: FloatArray = np.asarray(np.linalg.qr(flat, mode="r"))
    # A column of rounding errors is none.
    scale = 1e-3 * float(np.median(np.linalg.norm(R, axis=0)))
    kept: list[int] = []
    basis = np.zeros((R.shape[0], 0))
    fixed = []
    for column, index in enumerate(order):
        v = R[:, column]
        length = float(np.linalg.norm(v))
        rest = v - basis @ (basis.T @ v)
        rest -= basis @ (basis.T @ rest)
        new = float(np.linalg.norm(rest))
        if new > _DEPENDENT * max(length, scale):
            kept.append(index)
            basis = np.column_stack([basis, rest / new])
        else:
            why = (
                phrase("moves no marker")
                if length <= _DEPENDENT * scale
                else _why(problem, R, order, kept, column)
            )
            fixed.append(Fixed(problem.unknowns[index].name, why))
    return np.array(kept), fixed


def _why(
    problem: GeometryProblem, R: FloatArray, order: Sequence[int], kept: Sequence[int], column: int
) -> str:
    """Return with which unknowns a column moves the markers alike."""
    v = R[:, column]
    places = [order.index(i) for i in kept]
    share = np.linalg.lstsq(R[:, places], v)[0]
    big = np.argsort(np.abs(share))[::-1]
    names = [
        problem.unknowns[kept[i]].name for i in big if abs(share[i]) > 0.05 * abs(share[big[0]])
    ]
    alike = names[0]
    for name in names[1:4]:
        alike = phrase("{first} with {second}", first=alike, second=name)
    return phrase("as {names} and others" if len(names) > 4 else "as {names}", names=alike)


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryFit:
    """A fit of one rung."""

    state: State
    residual: FloatArray
    """Shape (point, 3), in m."""
    J: FloatArray
    """Derivatives there, shape (point, 3, unknown)."""
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
    J: FloatArray | None = None,
) -> GeometryFit:
    """Return the fit of a rung by least squares, blunders left out.

    Derivatives are taken anew only when markers have moved by a centimetre: until then they change
    by some thousandths, and so does what is left after each step.

    Parameters
    ----------
    problem : GeometryProblem
        What is fitted.
    chosen : tuple
        What is free and what is fixed, by `told_apart`.
    start : State
        From `register`, or of another rung.
    used : ndarray of bool, shape (point,), optional
        Positions to use; by default the first steps weigh by Huber's loss, and what is then more
        than 6 standard deviations away is left out, again after each step.
    J : ndarray, shape (point, 3, unknown), optional
        Derivatives near the start, where they are known.

    Raises
    ------
    GeometryError
        If there are fewer positions than unknowns, or the fit does not settle.
    """
    at, (free, fixed) = start, chosen
    if 3 * len(problem) < len(free) + 3:
        raise GeometryError(
            f"{len(problem)} positions of markers cannot tell {len(free)} unknowns: measure more"
            " poses"
        )
    r, J = problem.linearise(at) if J is None else (problem.residual(at), J)
    size, gone = np.array([each.size for each in problem.unknowns])[free], 0.0
    columns = J[:, :, free] * size
    keep = np.ones(len(problem), dtype=bool) if used is None else used
    for step in range(_STEPS):
        distance = np.linalg.norm(r, axis=1)
        sigma = max(float(np.median(distance[keep])) / _CHI, _FINEST)
        robust = used is None and step < _ROBUST_STEPS
        weight = np.minimum(1.0, 2.0 * sigma / np.maximum(distance, _FINEST)) if robust else 1.0
        now = distance < _BLUNDER * sigma if used is None and step >= _ROBUST_STEPS else keep
        ridge = (sigma / PRIOR_WIDTH) ** 2
        pull = ridge * problem.values(at)[free] / size
        scaled = _step(columns, r, np.where(now, weight, 0.0), ridge, pull)
        same, keep = bool((now == keep).all()), now
        x = np.zeros(len(problem.unknowns))
        x[free] = size * scaled
        at = problem.moved(at, x)
        step_length = float(np.abs(columns @ scaled).max())
        gone += step_length
        if gone > _LINEAR:
            (r, J), gone = problem.linearise(at), 0.0
            columns = J[:, :, free] * size
        else:
            r = problem.residual(at)
        if step >= (0 if used is not None else _ROBUST_STEPS) and same and step_length < _DONE:
            return GeometryFit(at, r, J, free, tuple(fixed), keep, sigma)
    raise GeometryError(
        f"the fit does not settle: after {_STEPS} steps the markers still move by"
        f" {1e3 * step_length:.3g} mm; are joints, units or frames mistaken?"
    )


def _step(
    columns: FloatArray, r: FloatArray, weight: FloatArray, ridge: float, pull: FloatArray
) -> FloatArray:
    """Return the least-squares step of weighed points, shape (column,).

    The prior pulls errors of the arm to zero: as a mere damping of the step, directions that the
    positions hardly tell would creep for hundreds of steps.
    """
    root = np.sqrt(weight)
    A = (columns * root[:, None, None]).reshape(-1, columns.shape[2])
    G = A.T @ A
    G[np.diag_indices_from(G)] += ridge
    return np.asarray(np.linalg.solve(G, A.T @ (r * root[:, None]).ravel() - pull))
