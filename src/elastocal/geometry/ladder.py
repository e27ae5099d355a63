"""Ladder of geometric models, judged at left-out poses.

All rungs and folds share one linearisation: errors of a millimetre and a milliradian make the
problem linear to a micrometre. The normal equations are sums over blocks of consecutive poses, so
that a fold is a sum of some of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.determined import Fixed, told_apart
from elastocal.geometry.left_out import of_the_arm
from elastocal.geometry.problem import (
    CHAIN_RUNGS,
    RUNGS,
    GeometryProblem,
    State,
    prior_weight,
    prior_width,
)
from elastocal.geometry.solve import GeometryFit, fit, noise, register
from elastocal.identification import Overlap, judge_models
from elastocal.progress import Progress
from elastocal.results import brief_repr

FOLDS = 5
_BLOCKS = 100
"""Most blocks of consecutive poses."""
_BLOCKS_THAT_TELL = 20
"""Fewer blocks scatter by chance."""
_NOISE_STEPS = 3
"""Number of fits of a rung for the estimate of its residual noise."""


@brief_repr
@dataclass(frozen=True, eq=False)
class RungErrors:
    """Errors of a rung at poses that it was not fitted to."""

    rung: str
    every: FloatArray
    """Measured minus expected of each position, blunders included, in base, shape (point, 3), m."""
    counted: BoolArray
    """Positions that are no blunders, shape (point,)."""
    free: int
    """Unknowns that the positions determine."""

    @property
    def residual(self) -> FloatArray:
        """That of the positions that are no blunders, shape (position, 3), in m."""
        return self.every[self.counted]

    @property
    def distance(self) -> FloatArray:
        """Its length, shape (position,), in m."""
        return np.asarray(np.linalg.norm(self.residual, axis=1))

    @property
    def every_distance(self) -> FloatArray:
        """The length of every residual, blunders included, shape (point,), in m."""
        return np.asarray(np.linalg.norm(self.every, axis=1))


@brief_repr
@dataclass(frozen=True, eq=False)
class FittedRung:
    """A rung fitted to all positions, and draws of it."""

    rung: str
    fit: GeometryFit
    values: FloatArray
    """Value of each unknown, shape (unknown,); 0 of what is fixed."""
    draws: FloatArray
    """By the noise and the prior, shape (draw, unknown)."""


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryLadder:
    """All rungs, and the one that was chosen."""

    rungs: tuple[RungErrors, ...]
    whole: FittedRung
    """The one that was chosen."""
    chain: FittedRung
    """Best rung with only poses and zeros of joints, fitted separately: what a URDF or a table of
    links can express. A larger fit without its harmonics would be worse than the nominal arm, since
    shifts, zeros and harmonics partly replace one another."""

    @property
    def chosen(self) -> str:
        """Name of the rung that was chosen."""
        return self.whole.rung

    def errors(self, rung: str) -> RungErrors:
        """Return the errors of a rung at poses that were left out."""
        return next(each for each in self.rungs if each.rung == rung)


def climb(
    problem: GeometryProblem, draws: int, rng: np.random.Generator, progress: Progress
) -> GeometryLadder:
    """Return the ladder of some positions.

    Parameters
    ----------
    problem : GeometryProblem
        What is fitted.
    draws : int
        Draws of noise and prior.
    rng : Generator
        For it.
    progress : Progress
        Called with stage, done and total.

    Raises
    ------
    GeometryError
        If there are too few positions, or the fit does not settle.
    """
    progress("geometry", 0, 4)
    start = register(problem)
    progress("geometry", 1, 4)
    nominal = problem.linearise(start)[1]
    # Unknowns are taken rung by rung, so that the richest rung decides for those below it, too.
    apart = told_apart(nominal, problem, RUNGS[-1])
    free = {rung: _up_to(rung, problem, *apart) for rung in RUNGS}
    reference = fit(problem, free["weight"], start)
    progress("geometry", 2, 4)
    block = blocks(problem)
    sums = _Sums(problem, reference, block)
    rungs = [sums.held_out(rung, free[rung][0]) for rung in RUNGS]
    used = reference.used
    fold = block[used] % FOLDS
    if len(np.unique(fold)) < FOLDS:
        raise GeometryError(
            f"the positions are of {len(np.unique(problem.data.pose))} poses: at least"
            f" {FOLDS} are needed, so that some can be left out; measure more poses"
        )
    distances = [each.every_distance[used] for each in rungs]
    errors = np.array([[each[fold == k].mean() for each in distances] for k in range(FOLDS)])
    overlap = Overlap(FOLDS, 0.0, 1.0 / FOLDS)
    judged = judge_models(errors, np.ones(len(rungs), dtype=bool), overlap)
    chosen = RUNGS[judged.near[0]]
    progress("geometry", 3, 4)
    rungs_of_chain = errors[:, : len(CHAIN_RUNGS)].mean(axis=0)
    of_chain = chosen if chosen in CHAIN_RUNGS else CHAIN_RUNGS[int(rungs_of_chain.argmin())]

    def fitted(rung: str) -> FittedRung:
        begin = _without(reference, problem, rung)
        final = fit(problem, free[rung], begin, reference.used)
        values = problem.values(final.state)
        spread = _Sums(problem, final, block).draws(draws, rng)
        return FittedRung(rung, final, values, values + spread)

    whole = fitted(chosen)
    chain = whole if of_chain == chosen else fitted(of_chain)
    progress("geometry", 4, 4)
    return GeometryLadder(tuple(rungs), whole, chain)


def _up_to(
    rung: str, problem: GeometryProblem, free: IndexArray, fixed: Sequence[Fixed]
) -> tuple[IndexArray, list[Fixed]]:
    """Return the free and the fixed unknowns of a rung, by those of the richest."""
    kept = RUNGS[: RUNGS.index(rung) + 1]
    names = {each.name for each in problem.unknowns if each.rung in kept}
    chosen = [index for index in free.tolist() if problem.unknowns[index].name in names]
    return np.array(chosen), [each for each in fixed if each.name in names]


def blocks(problem: GeometryProblem) -> IndexArray:
    """Return the block of each position: consecutive poses, whose rows stay together."""
    _, first, pose = np.unique(problem.data.pose, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))[pose]
    count = int(rank.max()) + 1
    many = min(_BLOCKS, max(count // 2, FOLDS), count)
    return np.asarray(rank * many // count)[problem.row]


def _without(reference: GeometryFit, problem: GeometryProblem, rung: str) -> State:
    """Return a state with what a rung does not have set to zero."""
    values = problem.values(reference.state)
    kept = RUNGS[: RUNGS.index(rung) + 1]
    back = np.array(
        [0.0 if u.rung in kept else -v for u, v in zip(problem.unknowns, values, strict=True)]
    )
    return problem.moved(reference.state, back)


class _Sums:
    """Normal equations of each block of positions about a fit, weighed columns."""

    def __init__(self, problem: GeometryProblem, about: GeometryFit, block: IndexArray) -> None:
        self.problem, self.about = problem, about
        self.size = np.array([u.size for u in problem.unknowns])
        self.values = problem.values(about.state) / self.size
        self.width = prior_width(problem)
        self.block, self.fitted = block, np.repeat(about.used, 3)
        self.count = int(block.max()) + 1
        self.A = (about.J * self.size).reshape(3 * len(block), -1)
        self.b = about.residual.ravel()
        self.counted = about.used | of_the_arm(problem, about)
        p = self.A.shape[1]
        self.G, self.h = np.zeros((self.count, p, p)), np.zeros((self.count, p))
        rows = np.repeat(self.block, 3)
        for k in np.unique(self.block):
            own = (rows == k) & self.fitted
            self.G[k] = self.A[own].T @ self.A[own]
            self.h[k] = self.A[own].T @ self.b[own]

    def held_out(self, rung: str, free: IndexArray) -> RungErrors:
        """Return the errors of a rung at each fold, fitted to the others."""
        frames = np.array([u.rung == "registration" for u in self.problem.unknowns])
        # What the fit has goes back to zero, where the prior of all rungs is.
        back = np.where(frames, 0.0, -self.values)
        b, h = self.b - self.A @ back, self.h - self.G @ back
        residual, ridge = b.reshape(-1, 3), prior_weight(self.problem, self.about.sigma)
        for _ in range(_NOISE_STEPS):
            # The noise relative to which a rung's prior is weighted is the residual of that rung.
            x = _solved(self.G.sum(axis=0), h.sum(axis=0), free, ridge)
            residual = (b - self.A[:, free] @ x).reshape(-1, 3)
            ridge = prior_weight(self.problem, noise(residual[self.about.used]))
        for k in range(FOLDS):
            train = np.arange(self.count) % FOLDS != k
            x = _solved(self.G[train].sum(axis=0), h[train].sum(axis=0), free, ridge)
            out = self.block % FOLDS == k
            rows = np.repeat(out, 3)
            left = b[rows] - self.A[np.ix_(rows, free)] @ x
            residual[out] = left.reshape(-1, 3)
        return RungErrors(rung, residual, self.counted, len(free))

    def draws(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return how far noise and prior take the unknowns from the fit, shape (draw, unknown).

        Each draw is the fit to noise on every coordinate, of the size that is left and with as many
        degrees of freedom (Student's t of few poses), about errors that are drawn from the prior:
        what the positions do not tell is as wide as the prior, not as narrow as their scatter. An
        unknown that blocks of poses scatter more than such noise does (gears, heat: errors of one
        pose after the other are alike) is stretched to that scatter, each block weighed as if it
        had been left out (R. M. Bell, D. F. McCaffrey, Survey Methodology 28(2), 2002).
        """
        free, ridge = self.about.free, prior_weight(self.problem, self.about.sigma)[self.about.free]
        G = self.G.sum(axis=0)[np.ix_(free, free)]
        H_inverse = np.linalg.inv(G + np.diag(ridge))
        freedom = int(self.fitted.sum()) - float(np.trace(H_inverse @ G))
        sigma = float(np.linalg.norm(self.b[self.fitted])) / np.sqrt(max(freedom, 1.0))
        values, vectors = np.linalg.eigh(G)
        root = H_inverse @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        stretch = self._block_scatter(free, H_inverse) / (sigma * np.linalg.norm(root, axis=1))
        noise = rng.normal(size=(count, len(free))) @ root.T * np.maximum(stretch, 1.0)
        chi = np.sqrt(rng.chisquare(max(freedom, 1.0), (count, 1)) / max(freedom, 1.0))
        of_prior = rng.normal(size=(count, len(free))) * self.width[free]
        found = np.zeros((count, len(self.size)))
        found[:, free] = sigma * noise / chi + of_prior @ (ridge[:, None] * H_inverse)
        return np.asarray(found * self.size)

    def _block_scatter(self, free: IndexArray, H_inverse: FloatArray) -> FloatArray:
        """Return by how much blocks of poses move each free unknown, root of their sum of squares.

        0 where there are too few to tell.
        """
        there = np.unique(self.block[self.about.used])
        if len(there) < _BLOCKS_THAT_TELL:
            return np.zeros(len(free))
        one = np.eye(len(free))
        scores = np.array(
            [
                np.linalg.solve(one - self.G[k][np.ix_(free, free)] @ H_inverse, self.h[k][free])
                for k in there
            ]
        )
        return np.asarray(np.linalg.norm(scores @ H_inverse, axis=0))


def _solved(G: FloatArray, h: FloatArray, free: IndexArray, ridge: FloatArray) -> FloatArray:
    own = G[np.ix_(free, free)]
    return np.asarray(np.linalg.solve(own + np.diag(ridge[free]), h[free]))
