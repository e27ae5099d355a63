"""Errors of a model at positions of another table, which its fit has not seen.

What is not of the arm may be new there: a station that was set up again, a marker that was screwed
on again. Where station or campaign differ, those frames and markers are fitted to the other table,
and nothing else is.
"""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import GeometryError
from elastocal.geometry.determined import told_apart
from elastocal.geometry.model import GeometryModel
from elastocal.geometry.positions import Positions
from elastocal.geometry.problem import GeometryProblem, State
from elastocal.geometry.solve import fit, register


def errors_at(model: GeometryModel, known: Positions, other: Positions) -> FloatArray:
    """Return the distances of the markers of another table from where the model expects them.

    Every seen marker counts; blunders only have no say in new frames and markers.

    Parameters
    ----------
    model : GeometryModel
        The geometry.
    known : Positions
        What it was fitted to.
    other : Positions
        The other table.

    Returns
    -------
    ndarray, shape (point,), in m

    Raises
    ------
    GeometryError
        If the other table has another number of markers in a campaign of the first, or too few
        positions for its own frames and markers.
    """
    same = set(zip(known.station.tolist(), known.campaign.tolist(), strict=True))
    there = set(zip(other.station.tolist(), other.campaign.tolist(), strict=True))
    new = {station for station, campaign in there if (station, campaign) not in same}
    new_markers = not set(other.campaign.tolist()) <= set(known.campaign.tolist())
    if not new_markers and other.markers.shape[1] != len(model.markers):
        raise GeometryError(
            f"{other.markers.shape[1]} markers in a campaign of which {len(model.markers)} were"
            " fitted: give the other table a campaign of its own"
        )
    problem = GeometryProblem(model.robot, other)
    start = register(problem)
    frames = [
        start.T_station_base[number] if name in new else model.stations[name]
        for number, name in enumerate(other.stations)
    ]
    markers = start.markers if new_markers else model.markers
    at = State(np.array(frames), markers, model.errors)
    own = _own(problem, new, new_markers=new_markers)
    if len(own):
        told, fixed = told_apart(problem.linearise(at)[1], problem, "registration")
        at = fit(problem, (np.intersect1d(own, told), fixed), at).state
    return np.asarray(np.linalg.norm(problem.residual(at), axis=1))


def _own(problem: GeometryProblem, new: set[str], *, new_markers: bool) -> IndexArray:
    """Return the unknowns that are the other table's own."""
    stations = problem.data.stations
    columns = [np.arange(6 * n, 6 * n + 6) for n, name in enumerate(stations) if name in new]
    if new_markers:
        first = 6 * len(stations)
        columns.append(np.arange(first, first + 3 * problem.data.markers.shape[1]))
    return np.concatenate(columns) if columns else np.array([], dtype=np.intp)
