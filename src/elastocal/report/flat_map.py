"""A surface laid flat for a printed figure, so that every candidate can be seen.

A surface that faces one way is seen along its mean normal. A block is unfolded: each of its faces
is turned about the edge that it shares with the face in the middle, like a paper net. What cannot
be unfolded without overlap is drawn twice, from two opposite sides.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning.surface import Surface
from elastocal.report.net import unfolded
from elastocal.report.sheet import ONE_WAY, Sheet, axes_across

_AWAY = "upward is away from the robot's base"
_GAP = 0.1
"""Between two views, as part of their width."""
_HEIGHT = 1e-3
"""From how far above the surface candidates are looked up on it, in m."""


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
    net = unfolded(surface, patch, normal)
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
    back = np.array([middle[0], middle[1], 0.0])
    back = back / (np.linalg.norm(back) or 1.0)
    high = np.array([0.0, 0.0, 0.6])
    directions = [view / np.linalg.norm(view) for view in (high - back, high + back)]
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
