"""Read a triangle mesh: STL, OBJ or PLY, welded, in metres, without degenerate faces."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import ElastocalError, SchemaError
from elastocal.meshes import SUFFIXES, load_triangles
from elastocal.results import brief_repr

_WELD = 1e-6
"""Vertices nearer than this part of the mesh's diagonal are one; STL carries seven digits."""
_FLAT = 1e-10
"""A face whose area is below this part of its longest edge squared has no usable normal."""
_FARTHEST = 1e9
"""No vertex can be farther away than this, in m; squares of more would overflow somewhere."""


class SurfaceError(ElastocalError, ValueError):
    """Error of a tooling surface: unreadable mesh, no faces, empty region."""


@brief_repr
@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Welded triangles."""

    vertices: FloatArray
    """Shape (vertex, 3), in m."""
    faces: IndexArray
    """Vertex numbers, counter-clockwise as seen from outside, shape (face, 3)."""
    degenerate: int = 0
    """Faces without area that were left out."""
    duplicate: int = 0
    """Repeated faces, in either winding, which were left out."""


def read_mesh(path: Path, unit: float) -> TriangleMesh:
    """Return the triangles of a mesh file.

    Parameters
    ----------
    path : Path
        An STL (binary or text), OBJ or PLY file.
    unit : float
        Length of one unit of the file, in m; mesh files do not say.

    Raises
    ------
    FileAccessError
        If the file cannot be opened.
    SurfaceError
        If the suffix is another, the contents are not such a mesh, or it has no face.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SurfaceError(
            f"mesh {path}: suffix {path.suffix!r} is not one of {', '.join(SUFFIXES)}"
        )
    try:
        loaded = load_triangles(path)
    except SchemaError as error:
        raise SurfaceError(str(error)) from error
    vertices = np.asarray(getattr(loaded, "vertices", ()), dtype=float).reshape(-1, 3)
    faces = np.asarray(getattr(loaded, "faces", ()), dtype=np.intp).reshape(-1, 3)
    return weld(vertices * unit, faces, f"mesh {path}")


def weld(vertices: FloatArray, faces: IndexArray, what: str) -> TriangleMesh:
    """Return a mesh with merged coincident vertices and without degenerate faces.

    Parameters
    ----------
    vertices : ndarray, shape (vertex, 3)
        In m.
    faces : ndarray of int, shape (face, 3)
        Vertex numbers.
    what : str
        Name of the mesh, for messages.

    Raises
    ------
    SurfaceError
        If there is no face with an area, a vertex is not finite or beyond all measure, or a
        number is out of range.
    """
    if not len(faces):
        raise SurfaceError(f"{what} has no faces")
    if not np.isfinite(vertices).all():
        raise SurfaceError(f"{what} has a vertex that is not finite")
    farthest = float(np.abs(vertices).max(initial=0.0))
    if not farthest <= _FARTHEST:
        raise SurfaceError(
            f"{what} has a vertex {farthest:.3g} m from its origin, allowed are {_FARTHEST:g} m"
        )
    if not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise SurfaceError(
            f"{what} has a face that names vertex {faces.max()}; there are {len(vertices)}"
        )
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0))) or 1.0
    _, first, same = np.unique(
        np.round((vertices - vertices.min(axis=0)) / (_WELD * size)).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    vertices, faces = vertices[first], same.reshape(-1)[faces]
    good = _has_area(vertices, faces)
    if not good.any():
        raise SurfaceError(f"{what} has no face with an area ({len(faces)} degenerate ones)")
    faces = faces[good]
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    duplicate = len(faces) - len(once)
    return TriangleMesh(vertices, faces[np.sort(once)], int(np.sum(~good)), duplicate)


def _has_area(vertices: FloatArray, faces: IndexArray) -> np.ndarray:
    """Return whether each face has an area, shape (face,)."""
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    doubled = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return np.asarray(doubled > 2.0 * _FLAT * longest**2)
