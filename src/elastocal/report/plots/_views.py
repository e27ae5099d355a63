"""The surface of a plan laid flat on paper, where every candidate can be seen.

 A surface that faces one way is seen along its mean normal. A
block is unfolded like a paper net: each of its faces is turned about the edge that it shares with
the face in the middle. What cannot be unfolded without overlap is drawn twice, from two opposite
sides.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning.surface import Surface

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


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector with length 1, or as it is with length 0."""
    return vector / (np.linalg.norm(vector) or 1.0)
