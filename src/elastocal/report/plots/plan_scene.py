"""The interactive view of a plan: a Plotly figure whose frames are the postures of the robot.

It holds what moves (robot, line of sight), the layers that stay, and cameras that look at the
work, at the tooling and at the whole cell.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning import PlanResult, PoolData
from elastocal.planning.surface import Surface
from elastocal.report.plots import style
from elastocal.report.plots._plan_layers import Layer, segments, still_layers, tool_path
from elastocal.report.plots._solids import (
    MOST_OF_LINK,
    Solid,
    coarsened,
    fixture_solids,
    robot_solids,
    single_precision,
    solid_trace,
    tones,
)
from elastocal.results import brief_repr

_FIELD_OF_VIEW = np.radians(45.0)
"""Field of view of Plotly's perspective camera, in rad."""
_ASPECT = 1.5
"""Width by height of the picture that cameras are set for; the page steps back if narrower."""
_ROOM = 1.08
_MARGIN = 0.05
_COLOURS = (style.ARM, style.TOOL)


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Ranges of the axes, each of shape (3,), in m."""

    low: FloatArray
    high: FloatArray

    @property
    def sides(self) -> dict[str, float]:
        """Sides of the box in the camera's units: alike in all directions, its volume 1."""
        return _xyz((self.high - self.low) / self._unit)

    def scene(self, point: FloatArray) -> FloatArray:
        """Return points in the camera's units, from the middle of the box."""
        return (point - 0.5 * (self.low + self.high)) / self._unit

    @property
    def _unit(self) -> float:
        return float(np.cbrt(np.prod(self.high - self.low)))


@dataclass(frozen=True, eq=False)
class _MovingParts:
    """The robot at HOME and at every pose, with the lines of sight."""

    robot: tuple[Solid, ...]
    """HOME first."""
    on_tool: IndexArray
    """Which part each face of the robot belongs to, shape (face,): 0 the arm, 1 the tool."""
    light: FloatArray
    """Unit vector towards the light, shape (3,)."""
    sight: tuple[FloatArray, ...]
    """From marker to station and a gap, each of shape (3, 3); NaN where no station sees. Empty in
    a cell without stations."""
    note: str = ""
    """A remark for readers on how the robot is drawn."""

    def layers(self, shown: int) -> tuple[Layer, ...]:
        """Return the layers at one posture (0: HOME)."""
        robot = solid_trace(self.robot[shown], self.light, "robot", _COLOURS, self.on_tool)
        layers = [Layer("Robot and tool", style.ARM, (robot,), note=self.note)]
        if self.sight:
            x, y, z = single_precision(self.sight[shown])
            line = go.Scatter3d(
                x=x, y=y, z=z, mode="lines+markers", name="line of sight", hoverinfo="skip",
                line={"color": style.SIGHT, "width": 5}, marker={"color": style.SIGHT, "size": 4},
            )  # fmt: skip
            layers.append(Layer("Line of sight to the marker", style.SIGHT, (line,)))
        return tuple(layers)

    def frames(self) -> list[Any]:
        """Return a Plotly frame for every posture: what changes of the first traces."""
        return [self._frame(number) for number in range(len(self.robot))]

    def _frame(self, number: int) -> Any:
        x, y, z = single_precision(self.robot[number].vertices)
        shade = tones(self.robot[number], self.light, self.on_tool, len(_COLOURS))
        data = [{"type": "mesh3d", "x": x, "y": y, "z": z, "intensity": shade}]
        if self.sight:
            x, y, z = single_precision(self.sight[number])
            data.append({"type": "scatter3d", "x": x, "y": y, "z": z})
        return go.Frame(name=str(number), data=data, traces=list(range(len(data))))


@brief_repr
@dataclass(frozen=True, eq=False)
class PlanView:
    """A figure, its layers and its camera places."""

    figure: Any
    """Plotly figure; frame 0 is HOME, frame i + 1 is pose i."""
    layers: tuple[Layer, ...]
    """Which traces of the figure go on and off together, in its order."""
    cameras: dict[str, dict[str, Any]]
    """Plotly cameras by name; the first is the initial one."""


def plan_view(cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData) -> PlanView:
    """Return the interactive view of a plan.

    Parameters
    ----------
    cell, surface, plan, pool
        Which belong together; the plan has at least one pose.
    """
    moving = _moving_parts(cell, surface, plan)
    layers = (*moving.layers(1), *still_layers(cell, surface, plan, pool, moving.light))
    traces = [trace.update(visible=layer.shown) for layer in layers for trace in layer.traces]
    reach = [*(robot.vertices for robot in moving.robot), tool_path(cell, plan)]
    bounds = _bounds_of(cell, surface, np.concatenate(reach))
    cameras = _cameras_of(cell, surface, moving.robot[1].vertices, bounds)
    layout = _layout(bounds, next(iter(cameras.values())))
    return PlanView(go.Figure(traces, layout, moving.frames()), layers, cameras)


def _layout(bounds: _Bounds, camera: dict[str, Any]) -> dict[str, Any]:
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


def _moving_parts(cell: Cell, surface: Surface, plan: PlanResult) -> _MovingParts:
    """Return the robot at HOME and in contact at every pose of a plan."""
    q = np.array([plan.robot.home, *(pose.joints for pose in plan.poses)])
    whole = robot_solids(cell, surface)
    drawn = [coarsened(part, MOST_OF_LINK) for part in whole.parts]
    solids = replace(whole, parts=tuple(part.solid for part in drawn))
    finer = any(part.note("A part") for part in drawn)
    note = "Parts of the robot with fine meshes are drawn coarser." if finer else ""
    seen = [None, *(pose.seen_by for pose in plan.poses)]
    sight: tuple[FloatArray, ...] = ()
    if any(seen):
        tcp = cell.robot.forward(q)
        sight = tuple(_sight(cell, T, name) for T, name in zip(tcp, seen, strict=True))
    part = solids.on_tool.astype(np.intp)
    return _MovingParts(tuple(solids.at(q)), part, _light(cell, surface), sight, note)


def _sight(cell: Cell, T_base_tcp: FloatArray, name: str | None) -> FloatArray:
    marker = cell.file.marker
    stations = {station.name: station.position_base for station in cell.file.trackers}
    if marker is None or name is None or name not in stations:
        return np.full((3, 3), np.nan)
    start = T_base_tcp[:3, :3] @ marker.position_tcp + T_base_tcp[:3, 3]
    return segments([(start, stations[name])])


def _bounds_of(cell: Cell, surface: Surface, reach: FloatArray) -> _Bounds:
    """Return ranges that hold robot, tooling and stations, whatever the size of the floor.

    Parameters
    ----------
    cell, surface : Cell, Surface
        What stands in the view.
    reach : ndarray, shape (point, 3)
        Where robot and tool come to, in m.
    """
    stations = [station.position_base[None] for station in cell.file.trackers]
    points = np.concatenate([surface.mesh.vertices, reach, *stations])
    low, high = points.min(axis=0), points.max(axis=0)
    room = _MARGIN * float(np.max(high - low))
    least, most = low - 4.0 * room, high + 4.0 * room
    for solid in fixture_solids(cell, surface).values():
        inner = np.clip(solid.vertices, least, most)
        # A fixture that only begins beyond the box is left out of it.
        if np.all(np.ptp(inner, axis=0) > 0.0):
            low, high = np.minimum(low, inner.min(axis=0)), np.maximum(high, inner.max(axis=0))
    return _Bounds(low - room, high + room)


def _cameras_of(
    cell: Cell, surface: Surface, robot: FloatArray, bounds: _Bounds
) -> dict[str, dict[str, Any]]:
    """Return Plotly cameras that look at the work, at the tooling and at everything.

    Parameters
    ----------
    cell, surface : Cell, Surface
        What stands in the view.
    robot : ndarray, shape (vertex, 3)
        The robot at its work, in m.
    bounds : _Bounds
        Of the view.
    """
    tooling = surface.mesh.vertices
    box = np.array(np.meshgrid(*zip(bounds.low, bounds.high, strict=True))).reshape(3, -1).T
    direction = _viewing_direction(cell, surface)
    places = {
        "Robot and tooling": np.concatenate([tooling, robot]),
        "Tooling": tooling,
        "Whole cell": box,
    }
    return {
        name: _camera(bounds.scene(points), direction, _up(cell)) for name, points in places.items()
    }


def _light(cell: Cell, surface: Surface) -> FloatArray:
    """Return the unit vector towards the light, shape (3,): over the shoulder of who looks."""
    return _unit(0.6 * _viewing_direction(cell, surface) + _up(cell))


def _camera(points: FloatArray, direction: FloatArray, up: FloatArray) -> dict[str, Any]:
    """Return the camera that has all points in a picture of the aspect `_ASPECT`."""
    right = _unit(np.cross(up, direction))
    axes = np.stack([right, np.cross(direction, right), direction])
    seen = points @ axes.T
    centre = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    across, upward, ahead = (seen - centre).T
    tangent = np.tan(0.5 * _FIELD_OF_VIEW)
    distance = ahead + np.maximum(np.abs(upward), np.abs(across) / _ASPECT) / tangent
    middle, back = centre @ axes, _ROOM * float(distance.max())
    return {"center": _xyz(middle), "eye": _xyz(middle + back * direction), "up": _xyz(up)}


def _viewing_direction(cell: Cell, surface: Surface) -> FloatArray:
    """Return where to look from: beside the robot, from above, opposite to the stations."""
    up, middle = _up(cell), surface.mesh.vertices.mean(axis=0)
    ahead = middle - up * (up @ middle)
    # A tooling right above or below the base leaves the side open: any will do.
    ahead = _unit(ahead if np.linalg.norm(ahead) > 1e-6 else np.roll(up, 1))
    side = np.cross(up, ahead)
    stations = [station.position_base for station in cell.file.trackers]
    away = -1.0 if stations and side @ np.mean(stations, axis=0) > 0.0 else 1.0
    return _unit(0.85 * away * side + 0.3 * ahead + 0.65 * up)


def _up(cell: Cell) -> FloatArray:
    """Return the world's vertical in base; a robot may hang from the ceiling."""
    return cell.T_world_base[2, :3]


def _unit(vector: FloatArray) -> FloatArray:
    return vector / np.linalg.norm(vector)


def _xyz(vector: FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip("xyz", vector, strict=True)}
