"""From a fitted ladder to the model of an arm, which is its file."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.geometry.arm import MOTION
from elastocal.geometry.joint_functions import joint_functions
from elastocal.geometry.ladder import GeometryLadder
from elastocal.geometry.mistakes import findings
from elastocal.geometry.model import (
    ChainErrors,
    DistanceFigures,
    FixedParameter,
    GeometryModel,
    GeometryParameter,
    GeometryRung,
    HeldOutFigures,
)
from elastocal.geometry.plausibility import require_known_markers
from elastocal.geometry.problem import RUNGS, GeometryProblem, Unknown
from elastocal.identification import interval

_LINE = 1e-2
"""Spread of markers across their line, in m, from which they show a turn."""


def geometry_model(
    problem: GeometryProblem,
    found: GeometryLadder,
    provenance: str,
    markers: FloatArray | None = None,
) -> GeometryModel:
    """Return the model that a ladder has found.

    Parameters
    ----------
    problem : GeometryProblem
        What was fitted.
    found : GeometryLadder
        What was found.
    provenance : str
        What it was made from, in words.
    markers : ndarray, shape (marker, 3), optional
        Where on the tool the markers are known to be, in the tcp, in m: what the positions say
        otherwise is an error of the tcp.

    Raises
    ------
    GeometryError
        If markers are known of another number than were measured.
    """
    robot, data, state = problem.robot, problem.data, found.whole.fit.state
    errors = state.errors.shortest()
    low, high = interval(found.whole.draws)
    free = set(found.whole.fit.free.tolist())
    parameters = tuple(
        GeometryParameter(
            each.name,
            float(found.whole.values[index]),
            each.unit,
            float(low[index]),
            float(high[index]),
            bool(high[index] - low[index] <= 2.0 * each.size) and not _assumed(problem, each),
        )
        for index, each in enumerate(problem.unknowns)
        if index in free and each.rung not in ("registration", RUNGS[-1])
    )
    rungs = tuple(_rungs(found))
    chosen = next(each for each in rungs if each.chosen)
    return GeometryModel(
        robot_urdf=robot.urdf,
        tcp=robot.tip,
        place=errors.place,
        motion=errors.motion,
        bend=errors.bend,
        sag=errors.sag if problem.assumed else None,
        stations=dict(zip(data.stations, state.T_station_base, strict=True)),
        markers=state.markers,
        held_out=HeldOutFigures(rungs[0].held_out, chosen.held_out),
        ladder=rungs,
        parameters=parameters,
        fixed=tuple(FixedParameter(each.name, each.why) for each in found.whole.fit.fixed),
        blunders=tuple(sorted(set(problem.row[~found.errors(found.chosen).counted].tolist()))),
        positions=len(problem),
        provenance=provenance,
        findings=findings(problem, found.whole.fit),
        T_tcp_built=_tcp_as_built(state.markers, markers),
        chain=_chain(found, markers),
        with_blunders=HeldOutFigures(
            *(
                DistanceFigures.of(found.errors(rung).every_distance)
                for rung in ("registration", found.chosen)
            )
        ),
        functions=joint_functions(problem, found),
    )


def _assumed(problem: GeometryProblem, unknown: Unknown) -> bool:
    """Return whether an unknown is no better known than masses that were assumed."""
    return problem.assumed and (unknown.rung == "bearings" or unknown.name.endswith(".sag"))


def _rungs(found: GeometryLadder) -> Iterator[GeometryRung]:
    for each in found.rungs:
        regions = each.region_distance
        yield GeometryRung(
            each.rung,
            each.free,
            DistanceFigures.of(each.distance),
            each.rung == found.chosen,
            None if regions is None else DistanceFigures.of(regions),
        )


def _chain(found: GeometryLadder, known: FloatArray | None) -> ChainErrors:
    """Return the part of the arm that a URDF can express."""
    at = found.chain.fit.state
    return ChainErrors(
        rung=found.chain.rung,
        place=at.errors.place,
        offset=at.errors.motion[:, MOTION.index("offset")],
        markers=at.markers,
        held_out=DistanceFigures.of(found.errors(found.chain.rung).distance),
        T_tcp_built=_tcp_as_built(at.markers, known),
    )


def _tcp_as_built(fitted: FloatArray, known: FloatArray | None) -> FloatArray | None:
    """Return the tcp in which markers are where they are known to be, shape (4, 4), in m."""
    if known is None:
        return None
    require_known_markers(fitted, known)
    there, here, T = fitted.mean(axis=0), known.mean(axis=0), np.eye(4)
    if np.linalg.matrix_rank(known - here, tol=_LINE) > 1:
        # Markers that are not in line say how the tool is turned, too.
        T[:3, :3] = Rotation.align_vectors(fitted - there, known - here)[0].as_matrix()
    T[:3, 3] = there - T[:3, :3] @ here
    return T
