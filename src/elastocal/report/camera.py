"""Where to look from, and how much of a cell the view holds."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.planning.surface import Surface
from elastocal.report.solids import fixture_solids

_FIELD_OF_VIEW = np.radians(45.0)
"""Of Plotly's perspective camera."""
ASPECT = 1.5
"""Width by height of the picture that cameras are set for; the page steps back if narrower."""
_ROOM = 1.08
_MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class Bounds:
    """Ranges of the axes, each of shape (3,), in m."""

    low: FloatArray
    high: FloatArray

    @property
    def sides(self) -> dict[str, float]:
        """Sides of the box in the camera's units: alike in all directions, its volume 1."""
        return _xyz((self.high - self.low) / self._unit)

    def scene(self, point: FloatArray) -> FloatArray:
        """Return points in the camera's units, from the middle of the box."""
        inside: FloatArray = (point - 0.5 * (self.low + self.high)) / self._unit
        return inside

    @property
    def _unit(self) -> float:
        return float(np.cbrt(np.prod(self.high - self.low)))


def bounds_of(cell: Cell, surface: Surface, reach: FloatArray) -> Bounds:
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
    return Bounds(low - room, high + room)


def cameras_of(
    cell: Cell, surface: Surface, robot: FloatArray, bounds: Bounds
) -> dict[str, dict[str, Any]]:
    """Return Plotly cameras that look at the work, at the tooling and at everything.

    Parameters
    ----------
    cell, surface : Cell, Surface
        What stands in the view.
    robot : ndarray, shape (vertex, 3)
        The robot at its work, in m.
    bounds : Bounds
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


def light(cell: Cell, surface: Surface) -> FloatArray:
    """Return the unit vector towards the light, shape (3,): over the shoulder of who looks."""
    return _unit(0.6 * _viewing_direction(cell, surface) + _up(cell))


def _camera(points: FloatArray, direction: FloatArray, up: FloatArray) -> dict[str, Any]:
    """Return the camera that has all points in a picture of the aspect `ASPECT`."""
    right = _unit(np.cross(up, direction))
    axes = np.stack([right, np.cross(direction, right), direction])
    seen = points @ axes.T
    centre = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    across, upward, ahead = (seen - centre).T
    tangent = np.tan(0.5 * _FIELD_OF_VIEW)
    distance = ahead + np.maximum(np.abs(upward), np.abs(across) / ASPECT) / tangent
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
    result: FloatArray = vector / np.linalg.norm(vector)
    return result


def _xyz(vector: FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip("xyz", vector, strict=True)}
