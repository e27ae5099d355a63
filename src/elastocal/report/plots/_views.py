"""How a plan is seen: its surface laid flat on paper, from cameras on the screen.

On paper every candidate can be seen. A surface that faces one way is seen along its mean normal. A
block is unfolded like a paper net: each of its faces is turned about the edge that it shares with
the face in the middle. What cannot be unfolded without overlap is drawn twice, from two opposite
sides.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning.surface import Surface
from elastocal.report.plots._solids import fixture_solids
from elastocal.wording import phrase

ONE_WAY = np.cos(np.radians(72.0))
"""Least cosine between a normal and the viewing direction at which a surface still reads well."""
_AWAY = "upward is away from the robot's base"
_GAP = 0.1
"""Between two views, as part of their width."""
_HEIGHT = 1e-3
"""Height above the surface from which candidates are looked up on it, in m."""
_TURNED_AWAY = np.cos(np.radians(135.0))
"""A face turned further than this from the middle one cannot hang on it."""
_NET_GAP = 0.05
"""Between the parts of a net, as part of the middle one's size."""
_TOUCHING = 0.02
"""Parts whose boxes share more than this part of the smaller one overlap."""

_FIELD_OF_VIEW = np.radians(45.0)
"""Field of view of the page's camera, upward, in rad; ``view.js`` has the same."""
_ASPECT = 1.5
"""Width by height of the picture that cameras are set for; the page steps back if narrower."""
_ROOM = 1.08
_MARGIN = 0.05


@dataclass(frozen=True, eq=False)
class Sheet:
    """A part of the surface with its own flat map ``u = A x + b``."""

    A: FloatArray
    """Shape (2, 3): unit vectors to the right and upward in the figure, in base."""
    b: FloatArray
    """Shape (2,), in m."""
    faces: IndexArray
    """Faces that are drawn, the farthest from the viewer first."""
    candidates: IndexArray
    """Candidates that lie on it."""

    def flat(self, points: FloatArray) -> FloatArray:
        """Return points in the figure, shape (..., 2), in m."""
        return points @ self.A.T + self.b

    @property
    def towards_viewer(self) -> FloatArray:
        """Unit vector out of the figure, in base, shape (3,)."""
        return np.cross(self.A[0], self.A[1])


@dataclass(frozen=True, eq=False)
class FlatMap:
    """The sheets of a surface, and how to name the picture."""

    sheets: tuple[Sheet, ...]
    kind: str

    def positions(self, contact: FloatArray) -> FloatArray:
        """Return every candidate in the figure, shape (candidate, 2), in m."""
        flat = np.full((len(contact), 2), np.nan)
        for sheet in self.sheets:
            flat[sheet.candidates] = sheet.flat(contact[sheet.candidates])
        return flat


def flat_map(surface: Surface, contact: FloatArray, normal: FloatArray) -> FlatMap:
    """Return a flat map on which every candidate is seen.

    Parameters
    ----------
    surface : Surface
        The tooling.
    contact, normal : ndarray, shape (candidate, 3)
        Contact points in base in m, and outward unit normals.
    """
    middle = normal.sum(axis=0)
    length = float(np.linalg.norm(middle))
    everything = np.arange(len(contact))
    if length > 0.0 and np.all(normal @ middle > ONE_WAY * length):
        away = surface.mesh.vertices.mean(axis=0)
        sheet = _seen_along(surface, middle / length, away, everything)
        return FlatMap((sheet,), f"seen along its mean normal; {_AWAY}")
    patch = surface.patch[_face_under(surface, contact, normal)]
    net = unfold(surface, patch, normal)
    if net is not None:
        return FlatMap(net, f"unfolded; {_AWAY}")
    return FlatMap(_two_sides(surface, normal), "from the robot's side (left) and from behind")


def _seen_along(
    surface: Surface, towards: FloatArray, upward: FloatArray, candidates: IndexArray
) -> Sheet:
    """Return the view against a unit vector; faces that look away are left out."""
    A = axes_across(towards, upward)
    depth = surface.mesh.vertices[surface.mesh.faces].mean(axis=1) @ towards
    facing = np.flatnonzero(surface.face_normals @ towards > 0.0)
    return Sheet(A, np.zeros(2), facing[np.argsort(depth[facing])], candidates)


def _two_sides(surface: Surface, normal: FloatArray) -> tuple[Sheet, Sheet]:
    """Return the views from the robot's side and from behind, side by side."""
    middle = surface.mesh.vertices.mean(axis=0)
    back = _unit(middle * (1.0, 1.0, 0.0))
    high = np.array([0.0, 0.0, 0.6])
    directions = [_unit(high - back), _unit(high + back)]
    seen = np.argmax(normal @ np.transpose(directions), axis=1)
    sheets, left = [], 0.0
    for number, towards in enumerate(directions):
        sheet = _seen_along(surface, towards, high, np.flatnonzero(seen == number))
        flat = sheet.flat(surface.mesh.vertices)
        shift = np.array([left - flat[:, 0].min(), -flat[:, 1].min()])
        sheets.append(Sheet(sheet.A, shift, sheet.faces, sheet.candidates))
        left += (1.0 + _GAP) * float(np.ptp(flat[:, 0]))
    return sheets[0], sheets[1]


def _face_under(surface: Surface, contact: FloatArray, normal: FloatArray) -> IndexArray:
    """Return the face that each candidate lies on, shape (candidate,)."""
    origin = contact + _HEIGHT * normal
    face = np.array(surface.rays.ray.intersects_first(origin, -normal), dtype=np.intp)
    # A ray right along an edge may slip through: the nearest face will do.
    missed = np.flatnonzero(face < 0)
    if len(missed):
        centres = surface.mesh.vertices[surface.mesh.faces].mean(axis=1)
        face[missed] = cKDTree(centres).query(contact[missed])[1]
    return face


def unfold(surface: Surface, patch: IndexArray, normal: FloatArray) -> tuple[Sheet, ...] | None:
    """Return a net of the smooth patches that hold candidates; None if none is free of overlap.

    The patch that faces the way of most others stays in the middle; each other one is turned
    by the least rotation about its corner that is nearest to the middle one.

    Parameters
    ----------
    surface : Surface
        The tooling.
    patch : ndarray of int, shape (candidate,)
        The surface's smooth patch that each candidate lies on.
    normal : ndarray, shape (candidate, 3)
        Outward unit normals.
    """
    facing = {int(p): _unit(normal[patch == p].sum(axis=0)) for p in np.unique(patch)}
    if any(np.any(normal[patch == p] @ towards <= ONE_WAY) for p, towards in facing.items()):
        return None
    total = np.sum(list(facing.values()), axis=0)
    root = max(facing, key=lambda p: float(facing[p] @ total))
    if any(towards @ facing[root] < _TURNED_AWAY for towards in facing.values()):
        return None
    corners = {p: _corners(surface, p) for p in facing}
    A_root = axes_across(facing[root], corners[root].mean(axis=0))
    sheets = []
    for p, towards in facing.items():
        A, b = _hinged(A_root, facing[root], towards, corners[root], corners[p])
        sheets.append(Sheet(A, b, np.flatnonzero(surface.patch == p), np.flatnonzero(patch == p)))
    flat = [sheet.flat(points) for sheet, points in zip(sheets, corners.values(), strict=True)]
    return None if _overlap(flat) else tuple(sheets)


def axes_across(towards: FloatArray, upward: FloatArray) -> FloatArray:
    """Return right and up in the plane across a unit vector, shape (2, 3).

    Parameters
    ----------
    towards : ndarray, shape (3,)
        Unit vector to the viewer, in base.
    upward : ndarray, shape (3,)
        What is to point upward in the figure, as well as it can.
    """
    up = upward - towards * (towards @ upward)
    if not np.linalg.norm(up) > 1e-3 * np.linalg.norm(upward):
        up = np.eye(3)[np.argmin(np.abs(towards))]
        up = up - towards * (towards @ up)
    up = _unit(up)
    return np.stack([np.cross(up, towards), up])


def _hinged(
    A_root: FloatArray,
    root: FloatArray,
    towards: FloatArray,
    root_corners: FloatArray,
    corners: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the map of a patch turned into the plane of the middle one."""
    A = A_root @ _rotation(towards, root)
    distance, nearest = map(np.asarray, cKDTree(root_corners).query(corners))
    hinge = int(distance.argmin())
    outward = A_root @ towards
    length = float(np.linalg.norm(outward))
    gap = _NET_GAP * float(np.linalg.norm(np.ptp(root_corners, axis=0)))
    apart = gap * outward / length if length > 1e-9 else np.zeros(2)
    return A, A_root @ root_corners[int(nearest[hinge])] - A @ corners[hinge] + apart


def _rotation(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the least rotation from one unit vector to another, not its opposite (Rodrigues)."""
    x, y, z = np.cross(start, end)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + K + K @ K / (1.0 + start @ end)
    return rotation


def _overlap(parts: list[FloatArray]) -> bool:
    """Return whether the boxes of flat parts, each of shape (point, 2), overlap."""
    boxes = [(part.min(axis=0), part.max(axis=0)) for part in parts]
    for (low_a, high_a), (low_b, high_b) in combinations(boxes, 2):
        shared = np.prod(np.clip(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0.0, None))
        smaller = min(np.prod(high_a - low_a), np.prod(high_b - low_b))
        if shared > _TOUCHING * smaller:
            return True
    return False


def _corners(surface: Surface, patch: int) -> FloatArray:
    """Return the vertices of a patch, shape (vertex, 3)."""
    faces = surface.mesh.faces[surface.patch == patch]
    corners: FloatArray = surface.mesh.vertices[np.unique(faces)]
    return corners


@dataclass(frozen=True, eq=False)
class Bounds:
    """A box that holds what a view shows, in m in base."""

    low: FloatArray
    """Shape (3,)."""
    high: FloatArray
    """Shape (3,)."""

    @property
    def corners(self) -> FloatArray:
        """Corners, shape (8, 3)."""
        return np.array(np.meshgrid(*zip(self.low, self.high, strict=True))).reshape(3, -1).T


@dataclass(frozen=True, eq=False)
class Camera:
    """From where a view is seen."""

    name: str
    centre: FloatArray
    """What stands in the middle of the picture, shape (3,), in m in base."""
    eye: FloatArray
    """Shape (3,), in m in base."""


def bounds_of(cell: Cell, surface: Surface, reach: FloatArray) -> Bounds:
    """Return a box that holds robot, tooling and stations, whatever the size of the floor.

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
) -> tuple[Camera, ...]:
    """Return cameras that look at the work, at the tooling and at everything.

    Parameters
    ----------
    cell, surface : Cell, Surface
        What stands in the view.
    robot : ndarray, shape (vertex, 3)
        The robot at its work, in m.
    bounds : Bounds
        Of the view.
    """
    tooling, direction = surface.mesh.vertices, _viewing_direction(cell, surface)
    places = {
        phrase("Robot and tooling"): np.concatenate([tooling, robot]),
        phrase("Tooling"): tooling,
        phrase("Whole cell"): bounds.corners,
    }
    return tuple(_camera(name, points, direction, upward(cell)) for name, points in places.items())


def light_over(cell: Cell, surface: Surface) -> FloatArray:
    """Return the unit vector towards the light, shape (3,): over the shoulder of who looks."""
    return _unit(0.6 * _viewing_direction(cell, surface) + upward(cell))


def _camera(name: str, points: FloatArray, direction: FloatArray, up: FloatArray) -> Camera:
    """Return the camera that has all points in a picture of the aspect `_ASPECT`."""
    right = _unit(np.cross(up, direction))
    axes = np.stack([right, np.cross(direction, right), direction])
    seen = points @ axes.T
    centre = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    across, high, ahead = (seen - centre).T
    tangent = np.tan(0.5 * _FIELD_OF_VIEW)
    distance = ahead + np.maximum(np.abs(high), np.abs(across) / _ASPECT) / tangent
    middle, back = centre @ axes, _ROOM * float(distance.max())
    return Camera(name, middle, middle + back * direction)


def _viewing_direction(cell: Cell, surface: Surface) -> FloatArray:
    """Return where to look from: beside the robot, from above, opposite to the stations."""
    up, middle = upward(cell), surface.mesh.vertices.mean(axis=0)
    ahead = middle - up * (up @ middle)
    # A tooling right above or below the base leaves the side open: any will do.
    ahead = _unit(ahead if np.linalg.norm(ahead) > 1e-6 else np.roll(up, 1))
    side = np.cross(up, ahead)
    stations = [station.position_base for station in cell.file.trackers]
    away = -1.0 if stations and side @ np.mean(stations, axis=0) > 0.0 else 1.0
    return _unit(0.85 * away * side + 0.3 * ahead + 0.65 * up)


def upward(cell: Cell) -> FloatArray:
    """Return the world's vertical in base; a robot may hang from the ceiling."""
    return cell.T_world_base[2, :3]


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector with length 1, or as it is with length 0."""
    return vector / (np.linalg.norm(vector) or 1.0)
