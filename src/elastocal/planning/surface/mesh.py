"""Read a triangle mesh: STL, OBJ or PLY, welded, in metres, without faces that have no area.

A damaged STL is refused here, since readers say of it what helps nobody. A binary STL has a header
of 80 bytes, the number of its triangles as 4 bytes, and 50 bytes for each triangle; a text STL
begins with ``solid`` and has ``endfacet`` after each triangle.
"""

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import ElastocalError, FileAccessError
from elastocal.results import brief_repr

_SUFFIXES = (".stl", ".obj", ".ply")
_WELD = 1e-6
"""Vertices nearer than this part of the mesh's diagonal are one; STL carries seven digits."""
_FLAT = 1e-10
"""A face whose area is below this part of its longest edge squared has no usable normal."""
_FARTHEST = 1e9
"""No vertex can be farther away than this, in m; squares of more would overflow somewhere."""
_HEAD, _TRIANGLE = 84, 50
_BEGIN, _END = re.compile(rb"\bfacet\s+normal\b", re.I), re.compile(rb"\bendfacet\b", re.I)
_LOOKED_AT = 1000


class SurfaceError(ElastocalError, ValueError):
    """A tooling surface that cannot be used: unreadable mesh, no faces, empty region."""


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
    """Faces that stood twice, either way round, and were left out the second time."""


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
    if path.suffix.lower() not in _SUFFIXES:
        raise SurfaceError(
            f"mesh {path}: suffix {path.suffix!r} is not one of {', '.join(_SUFFIXES)}"
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    if path.suffix.lower() == ".stl":
        _check_stl(data, f"mesh {path}")
    try:
        kind = path.suffix[1:].lower()
        loaded = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False)
    # What the readers of trimesh raise on bad contents is not documented; these were seen.
    except (ValueError, IndexError, KeyError, TypeError, AttributeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SurfaceError(f"mesh {path} is not a readable {path.suffix[1:]}: {reason}") from error
    vertices = np.asarray(getattr(loaded, "vertices", ()), dtype=float).reshape(-1, 3)
    faces = np.asarray(getattr(loaded, "faces", ()), dtype=np.intp).reshape(-1, 3)
    return weld(vertices * unit, faces, f"mesh {path}")


def _check_stl(data: bytes, what: str) -> None:
    """Refuse what is no STL, or only the beginning of one.

    Parameters
    ----------
    data : bytes
        Contents of the file.
    what : str
        Name of the file, for messages.

    Raises
    ------
    SurfaceError
        With what is missing.
    """
    if not data:
        raise SurfaceError(f"{what} is empty")
    count = int.from_bytes(data[80:_HEAD], "little")
    promised = _HEAD + _TRIANGLE * count
    if len(data) >= _HEAD and len(data) == promised:
        return
    if data[:_LOOKED_AT].lstrip()[:5].lower() == b"solid" and _is_text(data[:_LOOKED_AT]):
        begun, ended = len(_BEGIN.findall(data)), len(_END.findall(data))
        if begun > ended:
            raise SurfaceError(
                f"{what} is cut short: it begins {begun} triangles and ends {ended} of them"
            )
        return
    if _is_text(data[:_LOOKED_AT]):
        raise SurfaceError(f"{what} is no STL: it is a text that does not begin with 'solid'")
    if len(data) < _HEAD:
        raise SurfaceError(f"{what} is no STL: it has {len(data)} bytes, the head alone has 84")
    if len(data) < promised:
        raise SurfaceError(
            f"{what} is cut short, or no STL: its head promises {count} triangles, which take"
            f" {promised} bytes; it has {len(data)}"
        )


def _is_text(data: bytes) -> bool:
    return all(byte >= 32 or byte in b"\t\n\r\f" for byte in data)


def weld(vertices: FloatArray, faces: IndexArray, what: str) -> TriangleMesh:
    """Return a mesh whose coincident vertices are one and whose faces all have an area.

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
