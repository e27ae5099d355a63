"""Positions that a fit leaves out: blunders of the tracker, or the arm itself.

A beam that is broken moves one marker; an arm that stands elsewhere moves all markers of its tool
by one rigid motion. Such positions are the arm's errors, and its figures count them.
"""

from collections.abc import Iterator
from itertools import combinations, pairwise

import numpy as np
from scipy.special import bdtrc

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.findings import Finding, Kind, as_count, as_number
from elastocal.geometry.arm import arm_length
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.solve import GeometryFit

_SIGMAS = 5.0
"""Error of a distance between two markers of a row, in its standard deviations, up to which they
agree."""
_ARM_ERROR = 2e-3
"""Largest error of an arm over its length: farther rows are those of other joints or of another
pose, however their markers agree."""
_FEWEST, _MOST = 5, 0.5
"""Rows, and part of all rows, of which a cluster is looked for."""
_WITHIN = 0.8
"""Part of the rows left out that a cluster holds at least."""
_CHANCE = 1e-6
"""Probability of so many by chance, below which a cluster is named."""
_DENSE = 0.4
"""Part of the rows in the range of a cluster that were left out, at least."""

OF_THE_ARM = Kind(
    "geometry.left-out-of-the-arm",
    "{rows} miss by up to {most} mm and their markers agree: it is the arm and no blunder; they"
    " were not fitted and count in every figure",
    shown={"rows": as_count("row"), "most": as_number(".3g", 1e3)},
)
CLUSTER = Kind(
    "geometry.left-out-cluster",
    "{inside} of the {rows} left out lie where {coordinate} is {low} to {high} {unit}, where"
    " {there} were measured: is an axis coupled there, or does the arm touch something?",
    shown={
        "rows": as_count("row"),
        "there": as_count("row"),
        "low": as_number(".3g"),
        "high": as_number(".3g"),
    },
)


def of_the_arm(problem: GeometryProblem, fit: GeometryFit) -> BoolArray:
    """Return which positions are left out for an error of the arm, shape (point,).

    Those of rows with two markers at least, all left out, whose distances from one another are as
    on the tool.
    """
    found = np.zeros(len(problem), dtype=bool)
    largest = _ARM_ERROR * arm_length(problem.robot)
    allowed = _SIGMAS * np.sqrt(2.0) * fit.sigma
    for row in np.unique(problem.row[~fit.used]).tolist():
        points = np.flatnonzero(problem.row == row)
        if len(points) < 2 or fit.used[points].any():
            continue
        far = float(np.linalg.norm(fit.residual[points], axis=1).max())
        if far <= largest and _distance_error(problem, fit, points) <= allowed:
            found[points] = True
    return found


def _distance_error(problem: GeometryProblem, fit: GeometryFit, points: IndexArray) -> float:
    """Return the largest error of a distance between markers of a row, in m."""
    seen, tool = problem.measured[points], fit.state.markers[problem.marker[points]]
    errors = [
        abs(np.linalg.norm(seen[a] - seen[b]) - np.linalg.norm(tool[a] - tool[b]))
        for a, b in combinations(range(len(points)), 2)
    ]
    return float(max(errors))


def left_out_findings(problem: GeometryProblem, fit: GeometryFit) -> Iterator[Finding]:
    """Yield what a person should know of the positions left out."""
    own = of_the_arm(problem, fit)
    if own.any():
        most = float(np.linalg.norm(fit.residual[own], axis=1).max())
        yield OF_THE_ARM(rows=len(np.unique(problem.row[own])), most=most)
    rows = np.unique(problem.row[~fit.used])
    if _FEWEST <= len(rows) <= _MOST * len(problem.data):
        yield from _cluster(problem, rows)


def _cluster(problem: GeometryProblem, rows: IndexArray) -> Iterator[Finding]:
    """Yield the range of a joint, or of a sum of two that follow, that holds most rows left out."""
    robot, q = problem.robot, problem.data.q
    coordinates = dict(zip(robot.joint_names, q.T, strict=True))
    kinds = dict(zip(robot.joint_names, robot.revolute, strict=True))
    for one, other in pairwise(robot.joint_names):
        if kinds[one] and kinds[other]:
            coordinates[f"{one} + {other}"] = coordinates[one] + coordinates[other]
    best, chance = None, _CHANCE / len(coordinates)
    for name, values in coordinates.items():
        low, high, inside, there = _narrowest(values, rows)
        probability = float(bdtrc(inside - 1, len(rows), there / len(values)))
        if inside >= _DENSE * there and probability < chance:
            best, chance = (name, low, high, inside, there), probability
    if best is not None:
        name, low, high, inside, there = best
        turns = kinds[name.split(" + ")[0]]
        scale, unit = (np.degrees(1.0), "deg") if turns else (1e3, "mm")
        yield CLUSTER(
            inside=inside, rows=len(rows), coordinate=name, low=float(scale * low),
            high=float(scale * high), unit=unit, there=there,
        )  # fmt: skip


def _narrowest(values: FloatArray, rows: IndexArray) -> tuple[float, float, int, int]:
    """Return the range with fewest rows in all of those that hold most of some rows.

    With how many of these and how many in all it holds.
    """
    own, every = np.sort(values[rows]), np.sort(values)
    many = int(np.ceil(_WITHIN * len(own)))
    low, high = own[: len(own) - many + 1], own[many - 1 :]
    there = np.searchsorted(every, high, "right") - np.searchsorted(every, low, "left")
    best = int(there.argmin())
    return float(low[best]), float(high[best]), many, int(there[best])
