"""Layers of the interactive view of a plan: traces that go on and off together."""

from collections.abc import Sequence
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
    Solid,
    coarsened,
    fixture_solids,
    joined,
    single_precision,
    solid_trace,
)
from elastocal.wording import duration, millimetres, readable

_OFF_SURFACE = 0.004
"""Dots are drawn this far off the surface, as part of its size, so that it does not swallow half
of each."""


@dataclass(frozen=True, eq=False)
class WeakestMargins:
    """The smallest relative margin of each candidate."""

    share: FloatArray
    """As part of the pool's median margin of that check, shape (candidate,)."""
    check: IndexArray
    """Row of the check in the pool's margins, shape (candidate,)."""
    label: tuple[str, ...]
    """Name of the check and the margin with its unit, for example ``edge 12.3 mm``."""


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


def still_layers(
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
    layers = [_tooling(surface, towards_light), *_fixtures(cell, surface, towards_light)]
    lift = _OFF_SURFACE * float(np.linalg.norm(np.ptp(surface.mesh.vertices, axis=0)))
    layers.append(_candidates(pool, lift))
    layers.append(Layer("Poses, in visiting order", style.BLUE, (_poses(plan, 5.0 * lift),)))
    layers.append(Layer("Approach, along the normal", style.MUTED, (_approaches(plan),)))
    layers.append(Layer("Way of the tool from HOME to HOME", style.TOUR, _tour(cell, plan)))
    if cell.file.trackers:
        layers.append(Layer("Tracker stations", style.SIGHT, (_trackers(cell),)))
    return [*layers, *_refused(pool)]


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


def tool_path(cell: Cell, plan: PlanResult, steps: int = 12) -> FloatArray:
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


def _tooling(surface: Surface, towards_light: FloatArray) -> Layer:
    """Return the surface and the lines at which its smooth patches end."""
    mesh = surface.mesh
    drawn = coarsened(Solid(mesh.vertices, mesh.faces), MOST_OF_TOOLING)
    face, corner = np.divmod(surface.border_half_edges, 3)
    ends = np.stack([mesh.faces[face, (corner + step) % 3] for step in (0, 1)], axis=1)
    lines = drawn.solid.vertices[drawn.edges(ends)]
    x, y, z = single_precision(segments([(start, end) for start, end in lines]))
    edges = go.Scatter3d(
        x=x, y=y, z=z, mode="lines", name="edges", hoverinfo="skip",
        line={"color": style.MUTED, "width": 2},
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
    x, y, z = single_precision(pool.contact + lift * pool.normal)
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
    trace = go.Scatter3d(
        x=x, y=y, z=z, mode="markers", name="candidates", marker=marker, hovertext=text,
        hoverinfo="text",
    )  # fmt: skip
    return Layer(f"Candidates ({len(pool.contact)})", "#7b7b78", (trace,))


def _refused(pool: PoolData) -> list[Layer]:
    """Return the points without a posture, a layer a reason, most frequent first."""
    reasons = []
    for number, name in enumerate(pool.refusal_names):
        points = pool.sampled[pool.refused_by == number]
        if len(points):
            reasons.append((len(points), name, points))
    layers = []
    for count, name, points in sorted(reasons, key=lambda reason: -reason[0]):
        x, y, z = single_precision(points)
        trace = go.Scatter3d(
            x=x, y=y, z=z, mode="markers", name=f"refused: {escape(name)}", hoverinfo="name",
            marker={"size": 2.6, "symbol": "x", "color": style.REFUSED},
        )  # fmt: skip
        layers.append(Layer(f"Refused by {name} ({count})", style.REFUSED, (trace,), shown=False))
    return layers


def _poses(plan: PlanResult, lift: float) -> Any:
    contact = np.array([pose.tcp_position for pose in plan.poses])
    normal = np.array([pose.normal for pose in plan.poses])
    x, y, z = single_precision(contact + lift * normal)
    rank = {pose: number for number, pose in enumerate(plan.search.order, start=1)}
    return go.Scatter3d(
        x=x, y=y, z=z, mode="markers+text", name="poses",
        text=[str(pose.id) for pose in plan.poses], textposition="middle center",
        textfont={"size": 10, "color": style.INK},
        marker={"size": 15, "color": style.PAPER, "line": {"color": style.BLUE, "width": 2}},
        customdata=[pose.id for pose in plan.poses],
        hovertext=[_hover(plan, pose, rank.get(pose.id)) for pose in plan.poses],
        hoverinfo="text",
    )  # fmt: skip


def _hover(plan: PlanResult, pose: PoseRecord, rank: int | None) -> str:
    unit = {check.name: check.unit or "" for check in plan.pool.checks}
    seen = f"seen by {escape(pose.seen_by)}" if pose.seen_by else "not seen by a station"
    lines = [
        f"<b>pose {pose.id}</b>, chosen as number {rank}",
        f"x, y, z: {millimetres(pose.tcp_position)} mm",
        seen,
        f"{duration(_travel(plan, pose.id))} on the way, {duration(pose.contact_time)} in contact",
        "<b>margins</b>",
        *(f"{escape(n)}: {readable(m, unit.get(n, ''))}" for n, m in pose.margins.items()),
    ]
    return "<br>".join(lines)


def _travel(plan: PlanResult, pose: int) -> float:
    return sum(move.duration for move in plan.moves if move.end == pose)


def _approaches(plan: PlanResult) -> Any:
    """Return the last part of the way to each pose; near the surface it would cross the number."""
    ends = [(_off(plan, pose, 0.4), _off(plan, pose, 1.0)) for pose in plan.poses]
    x, y, z = single_precision(segments(ends))
    return go.Scatter3d(
        x=x, y=y, z=z, mode="lines", name="approaches", hoverinfo="skip",
        line={"color": style.MUTED, "width": 2},
    )  # fmt: skip


def _off(plan: PlanResult, pose: PoseRecord, part: float) -> FloatArray:
    """Return the point off the surface by a part of the approach distance, shape (3,), in m."""
    distance = part * plan.contact.approach_distance
    return np.array(pose.tcp_position) + distance * np.array(pose.normal)


def _tour(cell: Cell, plan: PlanResult) -> tuple[Any, Any]:
    path = tool_path(cell, plan)
    x, y, z = single_precision(path)
    way = go.Scatter3d(
        x=x, y=y, z=z, mode="lines", name="way", hoverinfo="skip",
        line={"color": style.TOUR, "width": 3},
    )  # fmt: skip
    hx, hy, hz = single_precision(path[:1])
    home = go.Scatter3d(
        x=hx, y=hy, z=hz, mode="markers+text", name="HOME", text=["HOME"],
        textposition="top center", textfont={"size": 13, "color": style.INK},
        marker={"size": 6, "symbol": "square", "color": style.TOUR}, hoverinfo="name",
    )  # fmt: skip
    return way, home


def _trackers(cell: Cell) -> Any:
    stations = cell.file.trackers
    x, y, z = single_precision(np.array([station.position_base for station in stations]))
    return go.Scatter3d(
        x=x, y=y, z=z, mode="markers+text", name="trackers",
        text=[station.name for station in stations], textposition="top center",
        textfont={"size": 13, "color": style.INK},
        marker={"size": 8, "symbol": "diamond", "color": style.SIGHT},
        hovertext=[
            f"<b>{escape(station.name)}</b><br>x, y, z: {millimetres(station.position)} mm<br>"
            f"range {station.range[0]:g} m to {station.range[1]:g} m"
            for station in stations
        ],
        hoverinfo="text",
    )  # fmt: skip


def segments(ends: Sequence[tuple[Any, Any]]) -> FloatArray:
    """Return separate lines as one array with NaN between them, shape (3 line, 3)."""
    gap = np.full(3, np.nan)
    return np.array([row for start, end in ends for row in (start, end, gap)]).reshape(-1, 3)
