"""Blunders and moved stations among positions, found from the residuals of a fit."""

from itertools import combinations

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.findings import Finding, Kind, as_count, as_number
from elastocal.geometry.left_out import left_out_findings
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.solve import GeometryFit

_NEAR = 0.02
"""Positions farther away, in m, are broken beams and do not show the position of a station."""
_LEAST_ROWS = 6
"""Positions before and after a move of a station."""
_STRONG = 40.0
"""Value of F from which a station is said to have moved: the best of all splits is far lower
where none has."""
_SHIFT = 2.0
"""Shift in standard deviations of a coordinate below which it is not reported."""
_SIGMAS = 7.0
"""Distance within which a swapped marker is where another one is expected."""
_MOST_NAMED = 8


NO_MASSES = Kind(
    "geometry.no-masses",
    "the description of {name} has no masses: what the arm yields to its own weight is"
    " not told from its geometry",
)
SWAPPED = Kind(
    "geometry.markers-swapped",
    "marker {a} and marker {b} are swapped in {rows} (counted from 0: {numbers}); they were"
    " left out",
    shown={"rows": as_count("row")},
)
MOVED = Kind(
    "geometry.station-moved",
    "station {name} seems to have moved by {shift} mm before row {row} (counted"
    " from 0): give the rows from there on a name of their own in the column"
    " 'station'",
    shown={"name": repr, "shift": as_number(".2g", 1e3)},
)


def findings(problem: GeometryProblem, fit: GeometryFit) -> tuple[Finding, ...]:
    """Return the findings about the positions of a fit."""
    notes = [] if problem.robot.has_masses else [NO_MASSES(name=problem.robot.name)]
    notes += [*_swapped_markers(problem, fit), *(moved := _moved_stations(problem, fit))]
    # A station that moved leaves out rows whose markers agree, too.
    return (*notes, *(() if moved else left_out_findings(problem, fit)))


def _swapped_markers(problem: GeometryProblem, fit: GeometryFit) -> list[Finding]:
    """Return the markers that were exchanged, by rows whose positions were left out."""
    at, sigma, seen = fit.state, fit.sigma, problem.data.seen
    measured = np.full((*seen.shape, 3), np.nan)
    expected = measured.copy()
    R, t = at.T_station_base[problem.station, :3, :3], at.T_station_base[problem.station, :3, 3]
    in_base = np.einsum("nji,nj->ni", R, problem.measured - t)
    measured[problem.row, problem.marker] = in_base
    expected[problem.row, problem.marker] = in_base - fit.residual
    notes: list[Finding] = []
    for a, b in combinations(range(seen.shape[1]), 2):
        apart = [
            np.linalg.norm(measured[:, one] - expected[:, other], axis=1)
            for one, other in ((a, b), (b, a), (a, a))
        ]
        swapped = (apart[0] < _SIGMAS * sigma) & (apart[1] < _SIGMAS * sigma)
        rows = np.flatnonzero(swapped & (apart[2] > _SIGMAS * sigma))
        if len(rows):
            notes.append(SWAPPED(a=a + 1, b=b + 1, rows=len(rows), numbers=_named(rows)))
    return notes


def _moved_stations(problem: GeometryProblem, fit: GeometryFit) -> list[Finding]:
    """Return the stations that moved at some row.

    The residuals are explained by one rigid motion of the station, or by two with the best split
    between them; F compares the two (E. S. Page, "A test for a change in a parameter occurring at
    an unknown point", Biometrika 42, 1955).
    """
    notes: list[Finding] = []
    for index, name in enumerate(problem.data.stations):
        own = (problem.station == index) & (np.linalg.norm(fit.residual, axis=1) < _NEAR)
        points = np.flatnonzero(own)
        if len(points) < 2 * _LEAST_ROWS:
            continue
        split, F, shift = _best_split(problem, fit, points)
        if F > _STRONG and shift > _SHIFT * fit.sigma:
            row = int(problem.row[points[split]])
            notes.append(MOVED(name=name, shift=float(shift), row=row))
    return notes


def _best_split(
    problem: GeometryProblem, fit: GeometryFit, points: IndexArray
) -> tuple[int, float, float]:
    """Return the best split of a station's positions, F, and the shift between the parts, in m."""
    columns = slice(6 * problem.station[points[0]], 6 * problem.station[points[0]] + 6)
    A, r = fit.derivatives.dense[points, :, columns], fit.residual[points]
    G = np.cumsum(np.einsum("nki,nkj->nij", A, A), axis=0)
    h = np.cumsum(np.einsum("nki,nk->ni", A, r), axis=0)
    total = float((r**2).sum())
    last = np.arange(_LEAST_ROWS - 1, len(points) - _LEAST_ROWS)
    # A row's markers were seen at once.
    last = last[problem.row[points[last]] != problem.row[points[last + 1]]]
    if not len(last):
        return 0, 0.0, 0.0
    before, after = _solved(G[last], h[last]), _solved(G[-1] - G[last], h[-1] - h[last])
    explained = (before * h[last]).sum(axis=1) + (after * (h[-1] - h[last])).sum(axis=1)
    alone = float(_solved(G[-1:], h[-1:])[0] @ h[-1])
    best = int(explained.argmax())
    freedom = 3 * len(points) - 12
    left = max(total - float(explained[best]), np.finfo(float).tiny)
    F = (float(explained[best]) - alone) / 6.0 / (left / freedom)
    moved = np.einsum("nki,i->nk", A, after[best] - before[best])
    return int(last[best]) + 1, F, float(np.sqrt((moved**2).sum(axis=1).mean()))


def _solved(G: FloatArray, h: FloatArray) -> FloatArray:
    """Return solutions of small systems that few positions may leave open, shape (split, 6)."""
    return np.asarray(np.einsum("nij,nj->ni", np.linalg.pinv(G, hermitian=True, rcond=1e-9), h))


def _named(rows: IndexArray) -> str:
    more = " …" if len(rows) > _MOST_NAMED else ""
    return ", ".join(map(str, rows[:_MOST_NAMED].tolist())) + more
