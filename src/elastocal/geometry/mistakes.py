"""Blunders, swapped markers and unnamed sessions among positions, from the residuals of a fit."""

from itertools import combinations

import numpy as np

from elastocal.arrays import IndexArray, are_multiples
from elastocal.findings import Finding, Kind, as_count, as_number
from elastocal.geometry.left_out import left_out_findings
from elastocal.geometry.positions import Positions
from elastocal.geometry.problem import GeometryProblem
from elastocal.geometry.sessions import session_findings
from elastocal.geometry.solve import GeometryFit

_SIGMAS = 7.0
"""Distance within which a swapped marker is where another one is expected."""
_MOST_NAMED = 8
_STEPS = (1.0, 0.5, 0.1, 0.05, 0.01)
"""Steps to which angles of joints are rounded, in deg."""
_OF_A_STEP = 1e-5
"""Part of a step by which rounded angles miss its multiples."""
_BY_ROUNDING = 0.5, 2.0
"""Parts of what rounding moves the markers by, between which it is what a fit leaves: postures that
were asked for in whole degrees, and reached, leave less, and errors of the arm more."""


NO_MASSES = Kind(
    "geometry.no-masses",
    "the description of {name} has no masses: its links are taken for bars; what joints and"
    " bearings yield is no more certain than that",
)
SWAPPED = Kind(
    "geometry.markers-swapped",
    "marker {a} and marker {b} are swapped in {rows} (counted from 0: {numbers}); they were"
    " left out",
    shown={"rows": as_count("row")},
)
COPIED = Kind(
    "geometry.copied-rows",
    "{rows} with the joints and markers of others, digit for digit ({numbers}, counted from 0):"
    " were they copied? What is copied counts as measured anew, so that the intervals are too"
    " narrow",
    shown={"rows": as_count("row")},
)


ROUNDED = Kind(
    "geometry.rounded-joints",
    "joints are rounded to {step} deg, which moves the markers by {moved} mm; the fit leaves {left}"
    " mm: export more digits",
    shown={"step": as_number("g"), **dict.fromkeys(("moved", "left"), as_number(".2g", 1e3))},
)


def findings(problem: GeometryProblem, fit: GeometryFit) -> tuple[Finding, ...]:
    """Return the findings about the positions of a fit."""
    notes = [] if problem.robot.has_masses else [NO_MASSES(name=problem.robot.name)]
    notes += [*_copied_rows(problem.data), *_rounded_joints(problem, fit)]
    notes += [*_swapped_markers(problem, fit), *(moved := tuple(session_findings(problem, fit)))]
    # A station or a marker that moved leaves out rows whose markers agree, too.
    return (*notes, *(() if moved else left_out_findings(problem, fit)))


def _copied_rows(data: Positions) -> list[Finding]:
    """Return the rows that are copies of others, whose markers no tracker sees at one place."""
    table = np.column_stack([data.q, data.markers.reshape(len(data), -1)])
    _, first, group = np.unique(
        np.nan_to_num(table, nan=np.inf), axis=0, return_index=True, return_inverse=True
    )
    rows = np.flatnonzero(first[group.ravel()] != np.arange(len(data)))
    return [COPIED(rows=len(rows), numbers=_named(rows))] if len(rows) else []


def _rounded_joints(problem: GeometryProblem, fit: GeometryFit) -> list[Finding]:
    """Return that angles are rounded to a step that explains what the fit leaves."""
    robot, q = problem.robot, problem.data.q
    turns = np.flatnonzero(robot.revolute)
    if not turns.size:
        return []
    degrees = np.degrees(q[:, turns])
    for step in _STEPS:
        if not are_multiples(degrees, step, _OF_A_STEP):
            continue
        # An angle that is rounded is off by the step over the root of 12, whatever the others are.
        off = np.radians(step) / np.sqrt(12.0)
        lever = np.linalg.norm(robot.jacobian(q).translation[..., turns], axis=(1, 2))
        moved = float(off * np.median(lever))
        left = float(np.median(np.linalg.norm(fit.residual[fit.used], axis=1)))
        low, high = _BY_ROUNDING
        explained = low * moved < left < high * moved
        return [ROUNDED(step=step, moved=moved, left=left)] if explained else []
    return []


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


def _named(rows: IndexArray) -> str:
    more = " …" if len(rows) > _MOST_NAMED else ""
    return ", ".join(map(str, rows[:_MOST_NAMED].tolist())) + more
