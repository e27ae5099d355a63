"""Accuracy of the arm before and after calibration: by axis, and by pose according to ISO 9283.

All errors are at poses left out of the fit. Pose accuracy and repeatability (ISO 9283:1998, 7.2)
refer to the attained positions in several visits of one commanded pose under one load: with ``r``
attained minus commanded, ``AP = |mean r|`` and, with the distances ``l`` of the visits from their
barycentre, ``RP = mean l + 3 std l``.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.problem import GeometryProblem
from elastocal.records import record
from elastocal.results import brief_repr

_SAME_VISIT = 1e-3
"""Joints of two visits of one pose differ by less, in rad or m; so do forces in kN."""


@record()
class ErrorFigures:
    """Errors of a coordinate, or of the distance, in m."""

    bias: float
    """Mean with its sign."""
    mean: float
    """Mean of their sizes."""
    rms: float
    p95: float
    max: float

    @classmethod
    def of(cls, error: FloatArray) -> "ErrorFigures":
        """Return the figures of errors, shape (position,), in m."""
        size = np.abs(error)
        p95 = float(np.percentile(size, 95))
        rms = float(np.sqrt(np.mean(error**2)))
        return cls(float(error.mean()), float(size.mean()), rms, p95, float(size.max()))


@record()
class AxisErrors:
    """Errors along an axis of the base, or of the distance."""

    axis: str
    """``x``, ``y``, ``z`` or ``norm``."""
    registration: ErrorFigures
    """Errors of the nominal arm, its frames and markers fitted."""
    chosen: ErrorFigures


@record()
class PoseAccuracy:
    """A marker at one commanded pose that was visited several times under one load."""

    row: int
    """The first visit, counted from 0."""
    marker: int
    """Counted from 1."""
    station: str
    visits: int
    registration: float
    """AP of the nominal arm, in m."""
    chosen: float
    """AP of the calibrated arm, in m."""
    repeatability: float
    """RP, in m; it is the same for both."""


@record()
class Blunder:
    """A position that was left out of the fit."""

    row: int
    """Counted from 0."""
    marker: int
    """Counted from 1."""
    station: str
    distance: float
    """Distance of the marker from its position by the calibrated arm, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryAccuracy:
    """Errors of all positions that are no blunders, before and after."""

    row: IndexArray
    """Row of the table of each position, shape (position,)."""
    marker: IndexArray
    """Shape (position,)."""
    place: FloatArray
    """Measured position of the marker, in base, shape (position, 3), in m."""
    registration: FloatArray
    """Measured minus expected of the nominal arm, in base, shape (position, 3), in m."""
    chosen: FloatArray
    """Errors of the calibrated arm, of the same shape."""
    axes: tuple[AxisErrors, ...]
    poses: tuple[PoseAccuracy, ...]
    """Poses that were visited at least twice; empty where there are none."""
    blunders: tuple[Blunder, ...]


def accuracy_figures(problem: GeometryProblem, found: GeometryLadder) -> GeometryAccuracy:
    """Return the errors of an arm before and after, at poses that were left out.

    Parameters
    ----------
    problem : GeometryProblem
        What was fitted.
    found : GeometryLadder
        What was found.
    """
    by_rung = {each.rung: each.residual for each in found.rungs}
    before, after = by_rung["registration"], by_rung[found.chosen]
    used = np.flatnonzero(found.errors(found.chosen).counted)
    T = found.whole.fit.state.T_station_base[problem.station[used]]
    place = np.einsum("nji,nj->ni", T[:, :3, :3], problem.measured[used] - T[:, :3, 3])
    parts = [(name, before[:, i], after[:, i]) for i, name in enumerate("xyz")]
    parts.append(("norm", np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)))
    axes = tuple(AxisErrors(n, ErrorFigures.of(b), ErrorFigures.of(a)) for n, b, a in parts)
    row, marker = problem.row[used], problem.marker[used]
    visited = _visits(problem, row, marker)
    poses = tuple(_pose_accuracy(problem, points, row, marker, before, after) for points in visited)
    blunders = tuple(_blunders(problem, found))
    return GeometryAccuracy(row, marker, place, before, after, axes, poses, blunders)


def _visits(problem: GeometryProblem, row: IndexArray, marker: IndexArray) -> Iterator[IndexArray]:
    """Yield where one marker was seen several times at one pose, by one station, in one load."""
    data = problem.data
    stations = {name: number for number, name in enumerate(data.stations)}
    station = np.array([stations[name] for name in data.station.tolist()])
    load = np.column_stack([data.payload, data.payload_centre, 1e-3 * data.force])
    load_of = np.unique(np.round(load / _SAME_VISIT), axis=0, return_inverse=True)[1].ravel()
    key = np.column_stack([data.pose, station, load_of])[row]
    _, group = np.unique(np.column_stack([key, marker]), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    for points in np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1):
        q = data.q[row[points]]
        same = points[np.abs(q - q[0]).max(axis=1) < _SAME_VISIT]
        if len(same) > 1:
            yield same


def _pose_accuracy(
    problem: GeometryProblem,
    points: IndexArray,
    row: IndexArray,
    marker: IndexArray,
    before: FloatArray,
    after: FloatArray,
) -> PoseAccuracy:
    distance = np.linalg.norm(before[points] - before[points].mean(axis=0), axis=1)
    first = int(row[points[0]])
    return PoseAccuracy(
        row=first,
        marker=int(marker[points[0]]) + 1,
        station=str(problem.data.station[first]),
        visits=len(points),
        registration=float(np.linalg.norm(before[points].mean(axis=0))),
        chosen=float(np.linalg.norm(after[points].mean(axis=0))),
        repeatability=float(distance.mean() + 3.0 * distance.std(ddof=1)),
    )


def _blunders(problem: GeometryProblem, found: GeometryLadder) -> Iterator[Blunder]:
    for point in np.flatnonzero(~found.errors(found.chosen).counted).tolist():
        row = int(problem.row[point])
        distance = float(np.linalg.norm(found.whole.fit.residual[point]))
        station = str(problem.data.station[row])
        yield Blunder(row, int(problem.marker[point]) + 1, station, distance)
