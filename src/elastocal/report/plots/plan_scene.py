"""The interactive view of a plan: a Plotly figure whose frames are the postures of the robot.

It holds what moves (robot, line of sight), the layers that stay, and cameras that look at the
work, at the tooling and at the whole cell. Traces of one layer go on and off together.
"""

from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning import PlanResult, PoolData, PoseRecord
from elastocal.planning.surface import Surface
from elastocal.report.plots import style
from elastocal.report.plots._solids import (
    MOST_OF_FIXTURE,
    MOST_OF_TOOLING,
    MOVING_COLOURS,
    MovingParts,
    Solid,
    coarsened,
    fixture_solids,
    joined,
    moving_parts,
    scatter,
    segments,
    solid_trace,
)
from elastocal.report.plots._views import Bounds, bounds_of, cameras_of, light_over
from elastocal.results import brief_repr
from elastocal.wording import duration, millimetres, readable

_LABEL = {"textposition": "top center", "textfont": {"size": 13, "color": style.INK}}
_Json = dict[str, object]
"""A part of a figure as plotly.js reads it."""
_OFF_SURFACE = 0.004
"""Dots are drawn this far off the surface, as part of its size, so that it does not swallow half
of each."""


@brief_repr
@dataclass(frozen=True, eq=False)
class WeakestMargins:
    """The smallest relative margin of each candidate."""

    share: FloatArray
    """As part of the pool's median margin of that check, shape (candidate,)."""
    check: IndexArray
    """Row of the check in the pool's margins, shape (candidate,)."""
    label: tuple[str, ...]
    """Name of the check and the margin with its unit, for example ``edge 12.3 mm``."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Layer:
    """Traces with one switch."""

    label: str
    colour: str
    """Colour of the switch's swatch."""
    traces: tuple[Any, ...]
    """Plotly traces, at least one."""
    shown: bool = True
    """Whether the layer is on when the page opens."""
    note: str = ""
    """A remark for readers on how it is drawn."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PlanView:
    """A figure, its layers and its camera places."""

    figure: Any
    """Plotly figure; frame 0 is HOME, frame i + 1 is pose i."""
    layers: tuple[Layer, ...]
    """Traces of the figure that go on and off together, in its order."""
    cameras: dict[str, _Json]
    """Plotly cameras by name; the first is the initial one."""


def plan_view(cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData) -> PlanView:
    """Return the interactive view of a plan.

    Parameters
    ----------
    cell, surface, plan, pool
        Which belong together; the plan has at least one pose.
    """
    moving = moving_parts(cell, surface, plan, light_over(cell, surface))
    layers = (*_moving_layers(moving), *_still_layers(cell, surface, plan, pool, moving.light))
    traces = [trace.update(visible=layer.shown) for layer in layers for trace in layer.traces]
    reach = [*(robot.vertices for robot in moving.robot), _tool_path(cell, plan)]
    bounds = bounds_of(cell, surface, np.concatenate(reach))
    cameras = cameras_of(cell, surface, moving.robot[1].vertices, bounds)
    layout = _layout(bounds, next(iter(cameras.values())))
    return PlanView(go.Figure(traces, layout, moving.frames()), layers, cameras)


def _layout(bounds: Bounds, camera: _Json) -> _Json:
    axes = {
        f"{name}axis": {
            "title": {"text": f"{name} of base in m"}, "range": [float(low), float(high)],
            "backgroundcolor": "#f7f7f5", "gridcolor": "#dcdcdc", "showbackground": True,
            "zeroline": False, "showspikes": False, "dtick": 1.0,
        }
        for name, low, high in zip("xyz", bounds.low, bounds.high, strict=True)
    }  # fmt: skip
    # Plotly's aspect mode "data" would follow the whole floor; this is the same, of what is shown.
    scene = {"aspectmode": "manual", "aspectratio": bounds.sides, "camera": camera, **axes}
    return {
        "scene": scene,
        "margin": {"l": 0, "r": 0, "t": 0, "b": 62},
        "showlegend": False,
        "paper_bgcolor": style.PAPER,
        "font": {"family": "system-ui, sans-serif", "color": style.INK},
        "hoverlabel": {"align": "left", "bgcolor": style.PAPER, "font": {"color": style.INK}},
        "template": "none",
    }


def _moving_layers(moving: MovingParts) -> list[Layer]:
    """Return the layers that differ between postures, as they are at the first pose."""
    robot = solid_trace(moving.robot[1], moving.light, "robot", MOVING_COLOURS, moving.on_tool)
    layers = [Layer("Robot and tool", style.ARM, (robot,), note=moving.note)]
    if moving.sight:
        line = scatter(
            moving.sight[1], "lines+markers", "line of sight",
            line={"color": style.SIGHT, "width": 5}, marker={"color": style.SIGHT, "size": 4},
        )  # fmt: skip
        layers.append(Layer("Line of sight to the marker", style.SIGHT, (line,)))
    return layers


def _still_layers(
    cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData, towards_light: FloatArray
) -> list[Layer]:
    """Return the layers that stay as they are whatever posture is shown.

    Parameters
    ----------
    cell, surface, plan, pool
        Which belong together.
    towards_light : ndarray, shape (3,)
        Unit vector.
    """
    lift = _OFF_SURFACE * float(np.linalg.norm(np.ptp(surface.mesh.vertices, axis=0)))
    return [
        _tooling(surface, towards_light),
        *_fixtures(cell, surface, towards_light),
        _candidates(pool, lift),
        Layer("Poses, in visiting order", style.BLUE, (_poses(plan, 5.0 * lift),)),
        Layer("Approach, along the normal", style.MUTED, (_approaches(plan),)),
        Layer("Way of the tool from HOME to HOME", style.TOUR, _tour(cell, plan)),
        *_trackers(cell),
        *_refused(pool),
    ]


def _tooling(surface: Surface, towards_light: FloatArray) -> Layer:
    """Return the surface and the lines at which its smooth patches end."""
    mesh = surface.mesh
    drawn = coarsened(Solid(mesh.vertices, mesh.faces), MOST_OF_TOOLING)
    face, corner = np.divmod(surface.border_half_edges, 3)
    ends = np.stack([mesh.faces[face, (corner + step) % 3] for step in (0, 1)], axis=1)
    lines = drawn.solid.vertices[drawn.edges(ends)]
    edges = scatter(
        segments(lines), "lines", "edges", line={"color": style.MUTED, "width": 2}
    )  # fmt: skip
    tooling = solid_trace(drawn.solid, towards_light, "tooling", (style.TOOLING,))
    traces = (tooling, edges) if len(lines) else (tooling,)
    return Layer("Tooling", style.TOOLING, traces, note=drawn.note("The tooling"))


def _fixtures(cell: Cell, surface: Surface, towards_light: FloatArray) -> list[Layer]:
    """Return the layer of the fixtures, if there are any."""
    drawn = {
        name: coarsened(solid, MOST_OF_FIXTURE)
        for name, solid in fixture_solids(cell, surface).items()
    }
    if not drawn:
        return []
    together = joined([fixture.solid for fixture in drawn.values()])
    trace = solid_trace(together, towards_light, "fixtures", (style.FIXTURE,))
    notes = (fixture.note(f"Fixture {name}") for name, fixture in drawn.items())
    return [Layer("Fixtures", style.FIXTURE, (trace,), note=" ".join(filter(None, notes)))]


def _candidates(pool: PoolData, lift: float) -> Layer:
    found = weakest_margins(pool)
    edge = [readable(float(distance), "m") for distance in pool.boundary_distance]
    text = [
        f"candidate {number}<br>nearest to refusal: {escape(label)}"
        f" ({share:.0%} of the pool's median)<br>distance to the edge: {far}"
        for number, (label, share, far) in enumerate(
            zip(found.label, found.share, edge, strict=True)
        )
    ]
    bar = {
        "title": {"text": "Smallest margin, part of the pool's median", "side": "top"},
        "orientation": "h", "thickness": 9, "lenmode": "pixels", "len": 280, "tickformat": ".0%",
        "x": 0.5, "xanchor": "center", "y": -0.01, "yanchor": "top", "dtick": 0.25, "ypad": 4,
    }  # fmt: skip
    marker = {
        "size": 2.6, "color": found.share.astype(np.float32), "cmin": 0.0, "cmax": 1.0,
        "colorscale": style.SEQUENTIAL, "colorbar": bar,
    }  # fmt: skip
    trace = scatter(
        pool.contact + lift * pool.normal, "markers", "candidates", "text", marker=marker,
        hovertext=text,
    )  # fmt: skip
    return Layer(f"Candidates ({len(pool.contact)})", "#7b7b78", (trace,))


def _refused(pool: PoolData) -> list[Layer]:
    """Return the points without a posture, a layer a reason, most frequent first."""
    layers = []
    counts = [int(np.sum(pool.refused_by == k)) for k in range(len(pool.refusal_names))]
    for number in sorted(np.flatnonzero(counts), key=lambda k: -counts[k]):
        name, count = pool.refusal_names[number], counts[number]
        trace = scatter(
            pool.sampled[pool.refused_by == number], "markers", f"refused: {escape(name)}", "name",
            marker={"size": 2.6, "symbol": "x", "color": style.REFUSED},
        )  # fmt: skip
        layers.append(Layer(f"Refused by {name} ({count})", style.REFUSED, (trace,), shown=False))
    return layers


def _poses(plan: PlanResult, lift: float) -> Any:
    rank = {pose: number for number, pose in enumerate(plan.search.order)}
    return scatter(
        np.array([_above(pose, lift) for pose in plan.poses]), "markers+text", "poses", "text",
        text=[str(pose.id) for pose in plan.poses], textposition="middle center",
        textfont={"size": 10, "color": style.INK},
        marker={"size": 15, "color": style.PAPER, "line": {"color": style.BLUE, "width": 2}},
        customdata=[pose.id for pose in plan.poses],
        hovertext=[_hover(plan, pose, rank.get(pose.id)) for pose in plan.poses],
    )  # fmt: skip


def _hover(plan: PlanResult, pose: PoseRecord, rank: int | None) -> str:
    unit = {check.name: check.unit or "" for check in plan.pool.checks}
    way = sum(move.duration for move in plan.moves if move.end == pose.id)
    seen = f"seen by {escape(pose.seen_by)}" if pose.seen_by else "not seen by a station"
    lines = [
        f"<b>pose {pose.id}</b>, search rank {rank}",
        f"x, y, z: {millimetres(pose.tcp_position)} mm",
        seen,
        f"{duration(way)} on the way, {duration(pose.contact_time)} in contact",
        "<b>margins</b>",
        *(f"{escape(n)}: {readable(m, unit.get(n, ''))}" for n, m in pose.margins.items()),
    ]
    return "<br>".join(lines)


def _approaches(plan: PlanResult) -> Any:
    """Return the last part of the way to each pose; near the surface it would cross the number."""
    far = plan.contact.approach_distance
    ends = [(_above(pose, 0.4 * far), _above(pose, 1.0 * far)) for pose in plan.poses]
    line = {"color": style.MUTED, "width": 2}
    return scatter(segments(ends), "lines", "approaches", line=line)


def _above(pose: PoseRecord, distance: float) -> FloatArray:
    """Return the point at a distance from the surface, shape (3,), in m."""
    return np.array(pose.tcp_position) + distance * np.array(pose.normal)


def _tour(cell: Cell, plan: PlanResult) -> tuple[Any, Any]:
    path = _tool_path(cell, plan)
    way = scatter(path, "lines", "way", line={"color": style.TOUR, "width": 3})
    home = scatter(
        path[:1], "markers+text", "HOME", "name", text=["HOME"], **_LABEL,
        marker={"size": 6, "symbol": "square", "color": style.TOUR},
    )  # fmt: skip
    return way, home


def _trackers(cell: Cell) -> list[Layer]:
    """Return the layer of the tracker stations, if there are any."""
    stations = cell.file.trackers
    if not stations:
        return []
    trace = scatter(
        np.array([station.position_base for station in stations]), "markers+text", "trackers",
        "text", text=[station.name for station in stations], **_LABEL,
        marker={"size": 8, "symbol": "diamond", "color": style.SIGHT},
        hovertext=[
            f"<b>{escape(station.name)}</b><br>x, y, z: {millimetres(station.position)} mm<br>"
            f"range {station.range[0]:g} m to {station.range[1]:g} m"
            for station in stations
        ],
    )  # fmt: skip
    return [Layer("Tracker stations", style.SIGHT, (trace,))]


def _tool_path(cell: Cell, plan: PlanResult, steps: int = 12) -> FloatArray:
    """Return the tool centre point along all moves, shape (point, 3), in m.

    Moves are straight in joint space, so that the tool runs along curves.

    Parameters
    ----------
    cell : Cell
        Whose robot moves.
    plan : PlanResult
        The plan.
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
        f"{pool.check_names[row]} {readable(float(margin), pool.check_units[row])}"
        for row, margin in zip(check, pool.margin[check, column], strict=True)
    )
    return WeakestMargins(relative[check, column], check, label)


def _typical(margin: FloatArray) -> FloatArray:
    """Return the median of each check's finite margins, 1 where that is no scale."""
    finite = np.where(np.isfinite(margin), np.abs(margin), 0.0)
    median = np.median(finite, axis=1) if margin.shape[1] else np.zeros(len(margin))
    return np.where(median > 0.0, median, 1.0)
