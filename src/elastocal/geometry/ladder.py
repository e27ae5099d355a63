"""Ladder of geometric models, judged at left-out poses and in left-out regions of joint space.

All rungs and folds share one linearisation: errors of a millimetre and a milliradian make the
problem linear to a micrometre. The normal equations are sums over blocks of consecutive poses, so
that a fold is a sum of some of them.

The last rung, functions of the joints, is rich enough to learn from the neighbours of a pose
whatever is wrong there. It is tried where the residuals show such functions, and taken where it
also predicts regions of joint space that it has not seen: only functions of single joints do. It
has no scales of joints that turn: what is measured over one turn must hold a turn further on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.errors import GeometryError, present
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
from elastocal.geometry.solve import GeometryFit, fit, freedom_of, noise, register
from elastocal.identification import Overlap, judge_models, paired_difference
from elastocal.progress import Progress
from elastocal.results import brief_repr
from elastocal.wording import counted

FOLDS = 5
_BLOCKS = 100
"""Most blocks of consecutive poses."""
_BLOCKS_THAT_TELL = 20
"""Fewer blocks scatter by chance."""
_NOISE_STEPS = 3
"""Number of fits of a rung for the estimate of its residual noise."""
_FUNCTIONS = RUNGS[-1]
_REGIONS = 8
"""Regions of joint space, each left out in turn."""
_SURE, _GAIN = 2.0, 0.05
"""Standard errors, and part of the error, by which functions of the joints must be better in
left-out regions."""
_SIGNS, _STRANGE = 30, 3.5
"""Random signs that show what residuals without functions do, and standard deviations of it from
which functions are tried."""


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
    regions: FloatArray | None = None
    """As `every`, the region of joint space of each left out; None where functions of the joints
    were not tried."""

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

    @property
    def region_distance(self) -> FloatArray | None:
        """The length in left-out regions, of no blunders, shape (position,), in m."""
        regions = self.regions
        return None if regions is None else np.linalg.norm(regions[self.counted], axis=1)


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
    """All rungs that were tried, and the one that was chosen."""

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
    block, used = blocks(problem), reference.used
    sums = _Sums(problem, reference, block)
    rungs = [sums.held_out(rung, free[rung][0]) for rung in RUNGS[:-1]]
    fold = block % FOLDS
    if len(np.unique(fold[used])) < FOLDS:
        raise GeometryError(
            f"the positions are of {counted(len(np.unique(problem.data.pose)), 'pose')}: at least"
            f" {FOLDS} are needed, so that some can be left out; measure more poses"
        )
    errors = _errors([each.every for each in rungs], fold, used)
    overlap = Overlap(FOLDS, 0.0, 1.0 / FOLDS)
    judged = judge_models(errors, np.ones(len(rungs), dtype=bool), overlap)
    chosen = RUNGS[judged.near[0]]
    rungs_of_chain = errors[:, : len(CHAIN_RUNGS)].mean(axis=0)
    of_chain = chosen if chosen in CHAIN_RUNGS else CHAIN_RUNGS[int(rungs_of_chain.argmin())]
    if _shows_functions(problem, reference, sums.fitted(free["harmonics"][0])[1], rng):
        rungs = _with_functions(problem, reference, rungs, {r: free[r][0] for r in RUNGS})
        if _predicts_regions(problem, rungs, RUNGS.index(chosen), used):
            chosen = _FUNCTIONS
    progress("geometry", 3, 4)

    def fitted(rung: str) -> FittedRung:
        begin = _without(reference, problem, rung)
        final = fit(problem, free[rung], begin, reference.used)
        values = problem.values(final.state)
        # As many blocks as their scatter needs: normal matrices of functions are large.
        few = block * _BLOCKS_THAT_TELL // (int(block.max()) + 1)
        functions = rung == _FUNCTIONS
        sums = _Sums(problem, final, few if functions else block, functions=functions)
        spread = sums.draws(draws, rng)
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
    if rung == _FUNCTIONS:
        chosen = [index for index in chosen if index not in problem.turn_scales]
        chosen += range(problem.dense, len(problem.unknowns))
    return np.array(chosen), [each for each in fixed if each.name in names]


def _errors(every: Sequence[FloatArray], part: IndexArray, used: BoolArray) -> FloatArray:
    """Return the mean error in each part of the positions, shape (part, model), in m."""
    distances = np.linalg.norm(np.array(every), axis=2)[:, used]
    parts = part[used]
    return np.array([distances[:, parts == k].mean(axis=1) for k in np.unique(parts)])


def _shows_functions(
    problem: GeometryProblem, fitted: GeometryFit, residual: FloatArray, rng: np.random.Generator
) -> bool:
    """Return whether residuals speak for functions of some joint.

    The score of the variance of its series, against the same with a random sign for each row (C. R.
    Rao, Proceedings of the Cambridge Philosophical Society 44, 1948; R. Davidson, E. Flachaire,
    Journal of Econometrics 146, 2008): far cheaper than the fit of the rung.
    """
    joints = fitted.derivatives.joints
    if not joints or len(np.unique(problem.data.pose)) < _BLOCKS_THAT_TELL:
        return False
    size = np.array([each.size for each in problem.unknowns])[problem.dense :]
    # A stream of its own, so that the draws are those of before.
    signs = rng.spawn(1)[0].choice([-1.0, 1.0], (_SIGNS, len(problem.data)))
    signs[0] = 1.0
    left = np.where(fitted.used[:, None], residual, 0.0)
    scores = fitted.derivatives.series_scores(left, signs)
    energy = ((scores * size) ** 2).reshape(_SIGNS, joints, -1).sum(axis=2)
    chance = energy[1:]
    return bool((energy[0] > chance.mean(axis=0) + _STRANGE * chance.std(axis=0)).any())


def _with_functions(
    problem: GeometryProblem,
    reference: GeometryFit,
    rungs: Sequence[RungErrors],
    free: dict[str, IndexArray],
) -> list[RungErrors]:
    """Return the rungs with functions of the joints, and the errors of all in left-out regions."""
    poses = _Sums(problem, reference, blocks(problem) % FOLDS, functions=True)
    found = [*rungs, poses.held_out(_FUNCTIONS, free[_FUNCTIONS])]
    regions = _Sums(problem, reference, joint_regions(problem), functions=True)
    return [
        replace(each, regions=regions.held_out(each.rung, free[each.rung], _REGIONS).every)
        for each in found
    ]


def _predicts_regions(
    problem: GeometryProblem, rungs: Sequence[RungErrors], chosen: int, used: BoolArray
) -> bool:
    """Return whether functions of the joints are better than all else in regions not seen.

    And better than the chosen rung at left-out poses.
    """
    mean = [each.every_distance[used].mean() for each in (rungs[-1], rungs[chosen])]
    regions = [present(each.regions, "regions") for each in rungs]
    errors = _errors(regions, joint_regions(problem), used)
    best = int(errors[:, :-1].mean(axis=0).argmin())
    overlap = Overlap(len(errors), 0.0, 1.0 / len(errors))
    gain = paired_difference(errors[:, [-1]], errors[:, [best]], overlap)
    least = _GAIN * errors[:, best].mean()
    return bool(
        mean[0] < mean[1] and gain.mean[0] < -max(_SURE * float(gain.standard_error[0]), least)
    )


def joint_regions(problem: GeometryProblem) -> IndexArray:
    """Return the region of joint space of each position: halves of halves of the widest joints.

    Rows of one pose stay together.
    """
    _, first, pose = np.unique(problem.data.pose, return_index=True, return_inverse=True)
    q, parts = problem.data.q[first], [np.arange(len(first))]
    while len(parts) < _REGIONS:
        halves = []
        for part in parts:
            low, high = np.percentile(q[part], [5.0, 95.0], axis=0)
            order = part[np.argsort(q[part, int((high - low).argmax())], kind="stable")]
            halves += np.array_split(order, 2)
        parts = halves
    region = np.empty(len(first), dtype=np.intp)
    for number, part in enumerate(parts):
        region[part] = number
    return region[pose][problem.row]


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

    def __init__(
        self,
        problem: GeometryProblem,
        about: GeometryFit,
        block: IndexArray,
        *,
        functions: bool = False,
    ) -> None:
        self.problem, self.about, self.block = problem, about, block
        self.size = np.array([u.size for u in problem.unknowns])
        self.values = problem.values(about.state) / self.size
        self.width = prior_width(problem)
        self.count = int(block.max()) + 1
        self.counted = about.used | of_the_arm(problem, about)
        p = len(self.size) if functions else problem.dense
        self.G, self.h = np.zeros((self.count, p, p)), np.zeros((self.count, p))
        for k in np.unique(block):
            own = np.flatnonzero((block == k) & about.used)
            self.G[k], self.h[k] = self._normal(about.residual, own)

    def _normal(self, residual: FloatArray, points: IndexArray) -> tuple[FloatArray, FloatArray]:
        one, every = np.ones(len(self.block)), np.arange(self.G.shape[1])
        return self.about.derivatives.normal(residual, one, self.size, every, points)

    @property
    def _back(self) -> FloatArray:
        """The step of what the fit has back to zero, where the prior of all rungs is, in sizes."""
        frames = np.array([u.rung == "registration" for u in self.problem.unknowns])
        return np.where(frames, 0.0, -self.values)

    def fitted(self, free: IndexArray) -> tuple[FloatArray, FloatArray]:
        """Return the weight of the prior in a fit to all positions, and what that leaves."""
        G, sigma = self.G.sum(axis=0), self.about.sigma
        h = self.h.sum(axis=0) - G @ self._back[: len(G)]
        residual = start = self._left(self._back)
        for _ in range(_NOISE_STEPS):
            # The noise relative to which a rung's prior is weighted is the residual of that rung.
            ridge = prior_weight(self.problem, sigma)
            residual = start - self._moved(self._solved(G, h, free, ridge))
            H = G[np.ix_(free, free)] + np.diag(ridge[free])
            sigma = noise(residual[self.about.used], freedom_of(H, ridge[free]))
        return prior_weight(self.problem, sigma), residual

    def held_out(self, rung: str, free: IndexArray, folds: int = FOLDS) -> RungErrors:
        """Return the errors of a rung at each fold, fitted to the others."""
        ridge, start = self.fitted(free)[0], self._left(self._back)
        h = self.h - self.G @ self._back[: self.G.shape[1]]
        residual = np.empty_like(start)
        for k in range(folds):
            train = np.arange(self.count) % folds != k
            x = self._solved(self.G[train].sum(axis=0), h[train].sum(axis=0), free, ridge)
            out = np.flatnonzero(self.block % folds == k)
            residual[out] = start[out] - self._moved(x, out)
        return RungErrors(rung, residual, self.counted, len(free))

    def _left(self, x: FloatArray) -> FloatArray:
        """Return the residuals after a step, shape (point, 3), in m."""
        return np.asarray(self.about.residual - self._moved(x))

    def _moved(self, x: FloatArray, points: IndexArray | slice = slice(None)) -> FloatArray:
        return self.about.derivatives.times(self.size * x, points)

    def _solved(
        self, G: FloatArray, h: FloatArray, free: IndexArray, ridge: FloatArray
    ) -> FloatArray:
        """Return the step that normal equations ask for, in sizes, shape (unknown,)."""
        x = np.zeros(len(self.size))
        x[free] = np.linalg.solve(G[np.ix_(free, free)] + np.diag(ridge[free]), h[free])
        return x

    def draws(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return how far noise and prior take the unknowns from the fit, shape (draw, unknown).

        Each draw is the fit to noise on every coordinate, of the size that is left and with as many
        degrees of freedom (Student's t of few poses), about errors that are drawn from the prior:
        what the positions do not tell is as wide as the prior, not as narrow as their scatter. An
        unknown that blocks of poses scatter more than such noise does (gears, heat: errors of one
        pose after the other are alike) is stretched to that scatter (`_block_scatter`).
        """
        free, ridge = self.about.free, prior_weight(self.problem, self.about.sigma)[self.about.free]
        G = self.G.sum(axis=0)[np.ix_(free, free)]
        H_inverse = np.linalg.inv(G + np.diag(ridge))
        residual = self.about.residual[self.about.used]
        freedom = residual.size - float(np.trace(H_inverse @ G))
        sigma = float(np.linalg.norm(residual)) / np.sqrt(max(freedom, 1.0))
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

        What is left of a block is too small, for it was fitted, and as if it had been left out too
        large; the mean of their products is that of the noise (P. Kline, R. Saggio, M. Solvsten,
        Econometrica 88(5), 2020). 0 where there are too few blocks to tell.
        """
        there = np.unique(self.block[self.about.used])
        if len(there) < _BLOCKS_THAT_TELL:
            return np.zeros(len(free))
        one = np.eye(len(free))
        square = np.zeros(len(free))
        for k in there:
            score = self.h[k][free]
            alone = np.linalg.solve(one - self.G[k][np.ix_(free, free)] @ H_inverse, score)
            square += (H_inverse @ score) * (H_inverse @ alone)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))
