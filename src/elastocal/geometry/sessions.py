"""Sessions of a table of positions: stations that were set up anew, markers screwed on again.

A column ``session`` names them; each has its own frame of every station and its own places of the
markers on the tool. Sessions that nobody named are found from the residuals of a fit, in the order
of the rows, and the fit is done anew with those found until no further one shows.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.findings import Finding, Kind, as_number
from elastocal.geometry.determined import told_apart
from elastocal.geometry.positions import Positions
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.solve import GeometryFit, fit, register
from elastocal.results import brief_repr

_NEAR, _FAR = 0.02, 5.0
"""Positions farther away, in m, and farther than so many medians, are broken beams and do not show
where a station is."""
_CLIPPED = 7.0
"""Standard deviations from which a residual counts no more."""
_LEAST_ROWS = 6
"""Positions before and after a change."""
_STRONG = 40.0
"""Value of F from which a change is named: the best of all splits is far lower where there is
none."""
_LIKELY = 8.0
"""Value of F from which a change is tried, since others that are not made yet count as noise."""
_SHIFT = 2.0
"""Shift in standard deviations of a coordinate below which it is not reported."""
_MOST_CHANGES = 8
"""More changes are a drift."""
_TOGETHER = 3
"""Rows within which a station and markers changed at once."""
_FROM = " from row "
"""Stands between the name of a station and the row from which it is elsewhere."""

MOVED = Kind(
    "geometry.station-moved",
    "station {name} seems to have moved by {shift} mm before row {row} (counted"
    " from 0): give the rows from there on a name of their own in the column"
    " 'station'",
    shown={"name": repr, "shift": as_number(".2g", 1e3)},
)
MARKERS_MOVED = Kind(
    "geometry.markers-moved",
    "the markers seem to sit {shift} mm elsewhere on the tool from row {row} on (counted from 0):"
    " give the rows from there on a name of their own in the column 'session'",
    shown={"shift": as_number(".2g", 1e3)},
)
NEW_SESSION = Kind(
    "geometry.new-session",
    "a new session seems to begin at row {row} (counted from 0), with station {name} {shift} mm and"
    " the markers {by} mm elsewhere: give the rows from there on a name of their own in the column"
    " 'session'",
    shown={"name": repr, "shift": as_number(".2g", 1e3), "by": as_number(".2g", 1e3)},
)


@brief_repr
@dataclass(frozen=True)
class Change:
    """A row from which a station or the markers are elsewhere."""

    row: int
    station: str | None
    """Name of the station, as it is after the changes before; None: the markers."""
    F: float
    """Of the residuals with one place or two (E. S. Page, Biometrika 42, 1955)."""
    shift: float
    """By the residuals, in m."""


def in_sessions(data: Positions, session: NDArray[np.str_]) -> Positions:
    """Return positions with frames and markers of each session for themselves.

    Parameters
    ----------
    data : Positions
        The positions.
    session : ndarray of str, shape (row,)
        Name of the session of each row; one name for all changes nothing.
    """
    names = list(dict.fromkeys(session.tolist()))
    if len(names) < 2:
        return data
    number = np.array([names.index(name) for name in session.tolist()])
    each = zip(data.station.tolist(), session.tolist(), strict=True)
    station = np.array([f"{station}, {name}" for station, name in each])
    return replace(data, station=station, markers=_own_markers(data.markers, number))


def _own_markers(markers: FloatArray, session: IndexArray) -> FloatArray:
    """Return the markers of each session in columns of its own, NaN in the rows of the others."""
    rows, count = markers.shape[:2]
    own = np.full((rows, int(session.max()) + 1, count, 3), np.nan)
    own[np.arange(rows), session] = markers
    flat = own.reshape(rows, -1, 3)
    return np.asarray(flat[:, np.isfinite(flat).all(axis=2).any(axis=0)])


def session_findings(problem: GeometryProblem, found: GeometryFit) -> Iterator[Finding]:
    """Yield the changes of stations and markers that nobody named, in the order of the rows.

    Parameters
    ----------
    problem : GeometryProblem
        The positions.
    found : GeometryFit
        Their fit.
    """
    changes = find_changes(problem, found)
    of_markers = [each for each in changes if each.station is None]
    for each in sorted(changes, key=lambda change: (change.row, change.station is None)):
        with_it = [m for m in of_markers if abs(m.row - each.row) <= _TOGETHER]
        if each.station is None:
            if not any(abs(s.row - each.row) <= _TOGETHER for s in changes if s.station):
                yield MARKERS_MOVED(row=each.row, shift=each.shift)
        elif with_it:
            yield NEW_SESSION(
                row=each.row, name=_as_named(each.station), shift=each.shift, by=with_it[0].shift
            )
        else:
            yield MOVED(name=_as_named(each.station), shift=each.shift, row=each.row)


def _as_named(station: str) -> str:
    """Return the name that the table has for a station."""
    return station.partition(_FROM)[0]


def find_changes(problem: GeometryProblem, found: GeometryFit) -> list[Change]:
    """Return the rows from which stations or markers are elsewhere, the plainest first.

    The residuals are explained by one place of a station (of the markers), or by two with the best
    split between them. Each change is made in the table before the next one is looked for, since
    what was not known of it is in all errors of the arm.
    """
    return _undone(problem, found)[0]


def undo_changes(problem: GeometryProblem) -> tuple[list[int], Positions]:
    """Return the rows from which stations or markers are elsewhere, and positions that say so.

    Parameters
    ----------
    problem : GeometryProblem
        The positions.
    """
    try:
        changes, undone = _undone(problem, _refitted(problem))
    except GeometryError:  # too few positions, or no arm at all
        return [], problem.data
    rows = sorted({each.row for each in changes})
    return [r for n, r in enumerate(rows) if not n or r > rows[n - 1] + _TOGETHER], undone


def _undone(problem: GeometryProblem, found: GeometryFit) -> tuple[list[Change], Positions]:
    changes: list[Change] = []
    undone = [problem.data]
    for _ in range(_MOST_CHANGES):
        candidates = list(_candidates(problem, found))
        likely = [c for c in candidates if c.F > _LIKELY and c.shift > _SHIFT * found.sigma]
        if not likely:
            break
        changes.append(max(likely, key=lambda each: each.F))
        undone.append(_changed(problem.data, changes[-1]))
        problem = GeometryProblem(problem.robot, undone[-1])
        try:
            found = _refitted(problem)
        except GeometryError:  # too few positions for so many frames
            break
    # What only a later one needs is kept with it.
    sure = max((n for n, each in enumerate(changes, 1) if each.F > _STRONG), default=0)
    return changes[:sure], undone[sure]


def _candidates(problem: GeometryProblem, found: GeometryFit) -> Iterator[Change]:
    """Yield the best change of each station, and of the markers that were seen together."""
    stations, distance = problem.data.stations, np.linalg.norm(found.residual, axis=1)
    near = distance < max(_NEAR, _FAR * float(np.median(distance)))
    for index, name in enumerate(stations):
        points = np.flatnonzero((problem.station == index) & near)
        yield from _best_change(problem, found, points, np.arange(6 * index, 6 * index + 6), name)
    first, seen = 6 * len(stations), problem.data.seen
    _, alike = np.unique(_sessions_of(seen), return_inverse=True)
    for group in range(int(alike.max()) + 1):
        markers = np.flatnonzero(seen[alike == group].any(axis=0))
        columns = (first + 3 * markers[:, None] + np.arange(3)).ravel()
        points = np.flatnonzero((alike[problem.row] == group) & near)
        yield from _best_change(problem, found, points, columns, None)


def _sessions_of(seen: NDArray[np.bool_]) -> IndexArray:
    """Return a label of each row: rows that share a marker, by any others, are of one session."""
    label = np.arange(seen.shape[1])
    for row in np.unique(seen, axis=0):
        together = np.flatnonzero(row)
        if len(together):
            label[np.isin(label, label[together])] = label[together].min()
    first = np.argmax(seen, axis=1)
    return np.asarray(label[first])


def _changed(data: Positions, change: Change) -> Positions:
    """Return positions with a change made."""
    later = np.arange(len(data)) >= change.row
    if change.station is not None:
        own = later & (data.station == change.station)
        new = f"{_as_named(change.station)}{_FROM}{change.row}"
        return replace(data, station=np.where(own, new, data.station.astype(object)).astype(str))
    return replace(data, markers=_own_markers(data.markers, later.astype(np.intp)))


def _refitted(problem: GeometryProblem) -> GeometryFit:
    start = register(problem)
    return fit(problem, told_apart(problem.linearise(start)[1], problem, "weight"), start)


def _best_change(
    problem: GeometryProblem,
    found: GeometryFit,
    points: IndexArray,
    columns: IndexArray,
    station: str | None,
) -> Iterator[Change]:
    """Yield the change at the best split of some positions, where there are enough."""
    if len(points) < 2 * _LEAST_ROWS:
        return
    A, whole = found.derivatives.dense[points][:, :, columns], found.residual[points]
    # Single broken beams make no session, but a session may lie as far away as they do.
    size = np.linalg.norm(whole, axis=1, keepdims=True)
    r = whole * np.minimum(1.0, _CLIPPED * found.sigma / np.maximum(size, np.finfo(float).tiny))
    G = np.cumsum(np.einsum("nki,nkj->nij", A, A), axis=0)
    h = np.cumsum(np.einsum("nki,nk->ni", A, r), axis=0)
    last = np.arange(_LEAST_ROWS - 1, len(points) - _LEAST_ROWS)
    # A row's markers were seen at once.
    last = last[problem.row[points[last]] != problem.row[points[last + 1]]]
    if not len(last):
        return
    before, after = _solved(G[last], h[last]), _solved(G[-1] - G[last], h[-1] - h[last])
    explained = (before * h[last]).sum(axis=1) + (after * (h[-1] - h[last])).sum(axis=1)
    alone = float(_solved(G[-1:], h[-1:])[0] @ h[-1])
    best = int(explained.argmax())
    freedom = 3 * len(points) - 2 * len(columns)
    if freedom <= 0:
        return
    left = max(float((r**2).sum()) - float(explained[best]), np.finfo(float).tiny)
    F = (float(explained[best]) - alone) / len(columns) / (left / freedom)
    h = np.cumsum(np.einsum("nki,nk->ni", A, whole), axis=0)
    at = last[best : best + 1]
    step = _solved(G[-1] - G[at], h[-1] - h[at])[0] - _solved(G[at], h[at])[0]
    moved = np.einsum("nki,i->nk", A, step)
    shift = float(np.sqrt((moved**2).sum(axis=1).mean()))
    yield Change(int(problem.row[points[int(last[best]) + 1]]), station, F, shift)


def _solved(G: FloatArray, h: FloatArray) -> FloatArray:
    """Return solutions of small systems that few positions may leave open, shape (split, k)."""
    return np.asarray(np.einsum("nij,nj->ni", np.linalg.pinv(G, hermitian=True, rcond=1e-9), h))
