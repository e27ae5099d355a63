"""Three-dimensional view of a plan: its cell with candidates, poses and paths."""

from dataclasses import dataclass, replace
from itertools import pairwise

import matplotlib
import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning import PlanResult, PoolData, PoseRecord, collision_scene
from elastocal.planning.surface import Surface
from elastocal.report.plots import style
from elastocal.results import brief_repr
from elastocal.viewer import Dots, Layer, Scene, Strokes, Tags, cell_scene
from elastocal.wording import duration, in_words, millimetres, phrase, readable, sentences

_OFF_SURFACE = 0.004
"""Dots are drawn this far off the surface, as part of its size, so that it does not swallow half
of each."""


@brief_repr
@dataclass(frozen=True, eq=False)
class WeakestMargins:
    """The smallest relative margin of each candidate."""

    share: FloatArray
    """Share of the pool's median margin of that check, shape (candidate,)."""
    check: IndexArray
    """Row of the check in the pool's margins, shape (candidate,)."""
    label: tuple[str, ...]
    """Name of the check and the margin with its unit, for example ``edge 12.3 mm``."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PlanView:
    """A plan in its cell."""

    scene: Scene
    """Posture 0 is HOME, i + 1 is pose i."""
    sight: FloatArray
    """Marker and station of each posture, shape (posture, 2, 3), in m; NaN where none sees."""


def plan_view(cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData) -> PlanView:
    """Return the interactive view of a plan.

    Parameters
    ----------
    cell, surface, plan, pool
        Which belong together; the plan has at least one pose.
    """
    q = np.array([plan.robot.home, *(pose.joints for pose in plan.poses)])
    path = _tool_path(cell, plan)
    scene = cell_scene(cell, surface, collision_scene(cell, surface), q, path)
    sight = _sights(cell, cell.robot.forward(q), plan)
    more = _plan_layers(surface, plan, pool, path)
    if np.isfinite(sight).any():
        more.insert(0, Layer(phrase("Line of sight to the marker"), "--sight", (), name="sight"))
    return PlanView(replace(scene, layers=(*scene.layers, *more)), sight)


def _sights(cell: Cell, T_base_tcp: FloatArray, plan: PlanResult) -> FloatArray:
    marker, found = cell.file.marker, np.full((len(T_base_tcp), 2, 3), np.nan)
    stations = {station.name: station.position_base for station in cell.file.trackers}
    for number, pose in enumerate(plan.poses, start=1):
        if marker is not None and pose.seen_by in stations:
            T = T_base_tcp[number]
            found[number] = T[:3, :3] @ marker.position_tcp + T[:3, 3], stations[pose.seen_by]
    return found


def _plan_layers(
    surface: Surface, plan: PlanResult, pool: PoolData, path: FloatArray
) -> list[Layer]:
    """Return the layers of a plan, which stay as they are whatever posture is shown."""
    lift = _OFF_SURFACE * float(np.linalg.norm(np.ptp(surface.mesh.vertices, axis=0)))
    return [
        _candidates(pool, lift),
        Layer(phrase("Poses, in visiting order"), style.BLUE, (_poses(plan, 5.0 * lift),)),
        Layer(phrase("Approach, along the normal"), "--muted", (_approaches(plan),)),
        Layer(phrase("Path of the tool, from HOME to HOME"), style.TOUR, _tour(path)),
        *_refused(pool),
    ]


def _candidates(pool: PoolData, lift: float) -> Layer:
    found = weakest_margins(pool)
    edge = [readable(float(distance), "m") for distance in pool.boundary_distance]
    hints = tuple(
        phrase(
            "candidate {number}\nnearest to refusal: {margin} ({share} of the pool's median)\n"
            "distance to the edge: {distance}",
            number=number,
            margin=label,
            share=f"{share:.0%}",
            distance=far,
        )
        for number, (label, share, far) in enumerate(
            zip(found.label, found.share, edge, strict=True)
        )
    )
    colours = matplotlib.colormaps[style.SEQUENTIAL](np.clip(found.share, 0.0, 1.0))[:, :3]
    dots = Dots(pool.contact + lift * pool.normal, np.rint(255 * colours).astype(np.intp), hints)
    return Layer(phrase("Candidates ({count})", count=len(pool.contact)), "#7b7b78", (dots,))


def _refused(pool: PoolData) -> list[Layer]:
    """Return the points without a posture, a layer a reason, most frequent first."""
    layers = []
    counts = [int(np.sum(pool.refused_by == k)) for k in range(len(pool.refusal_names))]
    grey = [int(style.REFUSED[k : k + 2], 16) for k in (1, 3, 5)]
    for number in sorted(np.flatnonzero(counts), key=lambda k: -counts[k]):
        name, at = pool.refusal_names[number], pool.sampled[pool.refused_by == number]
        dots = Dots(
            at,
            np.tile(grey, (len(at), 1)),
            (phrase("refused: {check}", check=in_words(name)),) * len(at),
        )
        label = phrase("Refused by {check} ({count})", check=in_words(name), count=counts[number])
        layers.append(Layer(label, style.REFUSED, (dots,), shown=False))
    return layers


def _poses(plan: PlanResult, lift: float) -> Tags:
    return Tags(
        np.array([_above(pose, lift) for pose in plan.poses]),
        tuple(str(pose.id) for pose in plan.poses),
        style.BLUE,
        tuple(_hint(plan, pose) for pose in plan.poses),
        np.array([pose.normal for pose in plan.poses]),
    )


def _hint(plan: PlanResult, pose: PoseRecord) -> str:
    unit = {check.name: check.unit or "" for check in plan.pool.checks}
    way = sum(move.duration for move in plan.moves if move.end == pose.id)
    lines = [
        phrase("pose {pose}", pose=pose.id),
        phrase("x, y, z: {place} mm", place=millimetres(pose.tcp_position)),
        phrase("seen by {station}", station=pose.seen_by)
        if pose.seen_by
        else phrase("not seen by a station"),
        phrase(
            "{way} on the way, {contact} in contact",
            way=duration(way),
            contact=duration(pose.contact_time),
        ),
        phrase("margins:"),
        *(
            sentences((phrase(name), readable(margin, unit.get(name, ""))), ": ")
            for name, margin in pose.margins.items()
        ),
    ]
    return sentences(lines, "\n")


def _approaches(plan: PlanResult) -> Strokes:
    """Return the last part of the path to each pose; near the surface it would cross the number."""
    far = plan.contact.approach_distance
    ends = [(_above(pose, 0.4 * far), _above(pose, 1.0 * far)) for pose in plan.poses]
    return Strokes(np.array(ends), "--muted", 1.5)


def _above(pose: PoseRecord, distance: float) -> FloatArray:
    """Return the point at a distance from the surface, shape (3,), in m."""
    return np.array(pose.tcp_position) + distance * np.array(pose.normal)


def _tour(path: FloatArray) -> tuple[Strokes, Tags]:
    way = Strokes(np.stack([path[:-1], path[1:]], axis=1), style.TOUR, 2.0)
    return way, Tags(
        path[:1], ("HOME",), style.TOUR, (phrase("HOME: where the robot starts and ends"),)
    )


def _tool_path(cell: Cell, plan: PlanResult, steps: int = 12) -> FloatArray:
    """Return the tool centre point along all moves, shape (point, 3), in m.

    Moves are straight in joint space, so that the tool runs along curves.

    Parameters
    ----------
    cell : Cell
        Whose robot moves.
    steps : int
        Points on each straight piece.
    """
    home = np.array(plan.robot.home)
    stops = [home]
    for move in plan.moves:
        end = home if move.end is None else np.array(plan.poses[move.end].approach_joints)
        stops += [*(np.array(via) for via in move.via), end]
    part = np.arange(1, steps + 1)[:, None] / steps
    legs = [a + part * (b - a) for a, b in pairwise(stops)]
    return cell.robot.forward(np.concatenate([home[None], *legs]))[:, :3, 3]


def weakest_margins(pool: PoolData) -> WeakestMargins:
    """Return the smallest relative margin of each candidate of a pool."""
    if not len(pool.check_names):
        count = len(pool.contact)
        return WeakestMargins(np.ones(count), np.zeros(count, dtype=np.intp), ("none",) * count)
    relative = pool.margin / _typical(pool.margin)[:, None]
    check = relative.argmin(axis=0)
    column = np.arange(len(check))
    label = tuple(
        sentences((in_words(pool.check_names[row]), readable(float(margin), pool.check_units[row])))
        for row, margin in zip(check, pool.margin[check, column], strict=True)
    )
    return WeakestMargins(relative[check, column], check, label)


def _typical(margin: FloatArray) -> FloatArray:
    """Return the median of each check's finite margins, 1 where that is no scale."""
    finite = np.where(np.isfinite(margin), np.abs(margin), 0.0)
    median = np.median(finite, axis=1) if margin.shape[1] else np.zeros(len(margin))
    return np.where(median > 0.0, median, 1.0)
