"""Unknowns that some positions determine, and the combinations of the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.geometry.derivatives import Derivatives
from elastocal.geometry.problem import RUNGS, GeometryProblem
from elastocal.wording import phrase

_RESOLVED = 3e-7
"""Movement of the markers, root mean square in m, that an error of likely size must cause
independently of those before it. A tenth of what a tracker resolves: rounded angles of a drawing
(1.571 for a quarter turn) make two errors differ by some tenths of a micrometre that are alike on
the arm."""
_MOST_ROWS = 3000
"""Largest number of positions that decide which unknowns are independent."""


@dataclass(frozen=True)
class Fixed:
    """An unknown that the positions do not determine separately."""

    name: str
    why: str


def told_apart(
    derivatives: Derivatives, problem: GeometryProblem, rung: str
) -> tuple[IndexArray, list[Fixed]]:
    """Return the unknowns of a rung that are determined, and why the others are not.

    Higher orders of functions of the joints are no question here: their prior decides what they
    are where positions do not.

    Unknowns are taken in the order of the ladder; one whose effect at its likely size equals,
    within the resolution, that of a combination of those before is fixed at zero, and named with
    them. The derivatives must be those of the nominal arm: small errors make exact dependences
    inexact.
    """
    rungs = RUNGS[: RUNGS.index(rung) + 1]
    dense, J = problem.unknowns[: problem.dense], derivatives.dense
    order = [i for r in rungs for i, u in enumerate(dense) if u.rung == r]
    size = np.array([u.size for u in problem.unknowns])
    # An even selection of the positions of every station and marker; all of them show no more.
    some = np.unique(np.linspace(0, len(J) - 1, _MOST_ROWS).astype(np.intp))
    flat = J[some].reshape(-1, J.shape[2])[:, order] * size[order]
    R: FloatArray = np.asarray(np.linalg.qr(flat, mode="r")) / np.sqrt(len(some))
    kept: list[int] = []
    basis = np.zeros((R.shape[0], 0))
    fixed = []
    for column, index in enumerate(order):
        v = R[:, column]
        rest = v - basis @ (basis.T @ v)
        rest -= basis @ (basis.T @ rest)
        new = float(np.linalg.norm(rest))
        if new > _RESOLVED:
            kept.append(index)
            basis = np.column_stack([basis, rest / new])
        else:
            why = (
                phrase("moves no marker")
                if float(np.linalg.norm(v)) <= _RESOLVED
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
    alike = " + ".join(names[:4])
    return phrase("as {names} and others" if len(names) > 4 else "as {names}", names=alike)
