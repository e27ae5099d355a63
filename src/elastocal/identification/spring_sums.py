"""Sums of springs that a reader can take in: a sparse basis of a subspace, and its text.

Combinations are written in a readable basis of the null space: few springs a vector, springs of
near joints together. Every vector of a subspace with the fewest possible non-zeros vanishes on
``k - 1`` independent coordinates (``k`` the dimension), so the sparsest vectors are found by trying
those sets of coordinates; the greedy choice among them, sparsest first, is optimal because linear
independence is a matroid (Coleman and Pothen, "The null space problem I", SIAM J. Alg. Disc.
Meth. 7, 1986).
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import comb

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.records import record

_ZERO = 1e-6
"""Components below this part of the largest count as zero."""
_MOST_SETS = 20_000
"""Largest number of coordinate sets to try; beyond it elimination gives a sparse enough basis."""
_SAME = 1e-4
"""Singular value, over the largest, below which combinations count as the same."""
MOST_TERMS = 6
"""Most springs of a combination that is written out."""


@record()
class Term:
    """One spring (or parameter of one) in an unobservable combination."""

    spring: str
    weight: float


def sparse_basis(null_space: FloatArray, joints: Sequence[int]) -> FloatArray:
    """Return a sparse basis of the column space of ``null_space``.

    Parameters
    ----------
    null_space : ndarray, shape (spring, k)
        Orthonormal columns.
    joints : sequence of int
        Joint number of each spring; among equally sparse vectors those that touch fewer
        joints come first, so that a reader sees neighbours.

    Returns
    -------
    ndarray, shape (k, spring)
        A vector a row; largest component 1 in size, positive at the first joint it touches.
    """
    n, k = null_space.shape
    if k == 0:
        return np.zeros((0, n))
    involved = np.flatnonzero(np.abs(null_space).max(axis=1) > _ZERO)
    if comb(len(involved), k - 1) > _MOST_SETS:
        candidates = list(eliminated(null_space))
    else:
        candidates = list(_circuits(null_space, involved))
    candidates.sort(key=lambda vector: _complexity(vector, joints))
    return np.array([_oriented(vector, joints) for vector in _independent(candidates, k)])


def _circuits(null_space: FloatArray, involved: IndexArray) -> Iterator[FloatArray]:
    """Yield the vectors that vanish on each set of ``k - 1`` coordinates."""
    k = null_space.shape[1]
    sets = np.array(list(combinations(involved, k - 1)), dtype=np.intp).reshape(
        comb(len(involved), k - 1), k - 1
    )
    _, s, Vt = np.linalg.svd(null_space[sets], full_matrices=True)
    # Independent rows leave one vector; dependent ones leave a plane, whose sparsest vectors other
    # sets give.
    unique = s[:, -1] > _ZERO if k > 1 else np.ones(len(sets), dtype=bool)
    seen: set[tuple[float, ...]] = set()
    for coefficients in Vt[unique, -1]:
        vector = _normalised(null_space @ coefficients)
        # Many sets give the same vector.
        key = tuple(np.round(vector, 4))
        if key not in seen:
            seen.add(key)
            yield vector


def eliminated(null_space: FloatArray) -> Iterator[FloatArray]:
    """Yield the basis whose vectors are 1 at one of ``k`` springs and 0 at the others.

    The springs are taken in the order of their part in the null space outside the vectors of those
    before, the first of equal ones. The projector is the same for every basis, so that rounding
    does not influence the choice.
    """
    projector, pivots = null_space @ null_space.T, list[int]()
    for _ in range(null_space.shape[1]):
        left = np.diag(projector)
        pivot = int(np.flatnonzero(left > left.max() - _ZERO)[0])
        pivots.append(pivot)
        projector = projector - np.outer(projector[:, pivot], projector[pivot]) / left[pivot]
    yield from map(_normalised, np.linalg.solve(null_space[pivots].T, null_space.T))


def _normalised(vector: FloatArray) -> FloatArray:
    vector = vector / np.abs(vector).max()
    vector[np.abs(vector) <= _ZERO] = 0.0
    # Geometry makes most coefficients whole or half numbers; rounding errors would make them
    # unreadable.
    rounded = np.round(vector * 2.0) / 2.0
    vector = np.where(np.abs(vector - rounded) < _ZERO, rounded, vector)
    return np.asarray(vector * np.sign(vector[np.flatnonzero(vector)[0]]))


def _oriented(vector: FloatArray, joints: Sequence[int]) -> FloatArray:
    first = min(map(int, np.flatnonzero(vector)), key=lambda i: (joints[i], i))
    return np.asarray(vector * np.sign(vector[first]))


def _complexity(vector: FloatArray, joints: Sequence[int]) -> tuple[int, int, tuple[int, ...]]:
    support = [int(i) for i in np.flatnonzero(vector)]
    return len(support), len({joints[i] for i in support}), tuple(support)


def _independent(candidates: Sequence[FloatArray], k: int) -> list[FloatArray]:
    """Take candidates in order as long as each adds a dimension."""
    chosen: list[FloatArray] = []
    for vector in candidates:
        trial = np.array([*chosen, vector])
        scaled = trial / np.linalg.norm(trial, axis=1, keepdims=True)
        if np.linalg.svd(scaled, compute_uv=False)[-1] > _ZERO:
            chosen.append(vector)
        if len(chosen) == k:
            break
    return chosen


def sum_weights(sums: Sequence[Sequence[Term]], names: Sequence[str]) -> FloatArray:
    """Return the weights of sums over named numbers, shape (sum, number)."""
    table = np.zeros((len(sums), len(names)))
    for row, terms in zip(table, sums, strict=True):
        for term in terms:
            row[list(names).index(term.spring)] = term.weight
    return table


def complement(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what is orthogonal to some rows, shape (n, k)."""
    if not rows.shape[1]:
        return np.zeros((0, 0))
    _, s, Vt = np.linalg.svd(rows, full_matrices=True)
    determined = int(np.sum(s > _SAME * s[0]))
    return np.asarray(Vt[determined:].T, dtype=float)


def describe(group: Sequence[Term]) -> str:
    """Return an unobservable combination in words.

    >>> describe([Term("a4.y", 1.0), Term("a4.z", 1.0), Term("a5.axial", -1.0)])
    '(a4.y + a4.z) - a5.axial'
    >>> describe([Term("a4.y", 0.9998), Term("a5.x", -0.014)])
    'a4.y - 0.014 a5.x'
    """
    sides = (
        [_written(term) for term in group if term.weight > 0],
        [_written(term) for term in group if term.weight < 0],
    )
    written = [f"({' + '.join(side)})" if len(side) > 1 else side[0] for side in sides if side]
    return " - ".join(written)


def sum_text(terms: Sequence[Term]) -> str:
    """Return a sum in words.

    >>> sum_text([Term("a4.axial", 1.0), Term("a5.x", 1.0)])
    'a4.axial + a5.x'
    """
    text = describe(terms)
    bare = len(terms) > 1 and all(term.weight > 0.0 for term in terms)
    return text[1:-1] if bare else text


def describe_briefly(group: Sequence[Term]) -> str:
    """Return an unobservable combination for a line of text, a long one by its size."""
    return describe(group) if len(group) <= MOST_TERMS else f"{len(group)} springs mixed"


def _written(term: Term) -> str:
    size = f"{abs(term.weight):.3g}"
    return term.spring if size == "1" else f"{size} {term.spring}"
