"""Where a straight approach meets the tooling: a ray against the triangles of the cell's mesh."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import FileAccessError, SchemaError

_GRAZING = 1e-12
"""A ray less steep to a triangle passes it by (product of its edges and the ray, in m²)."""


@dataclass(frozen=True, eq=False)
class Hit:
    """Where a ray meets the surface."""

    distance: float
    """Along the ray, in m."""
    normal: FloatArray
    """Unit normal of the triangle on the side that the ray comes from, shape (3,)."""


@dataclass(frozen=True, eq=False)
class TrueSurface:
    """The tooling where it really stands."""

    corners: FloatArray
    """Triangles in base, shape (face, 3, 3), in m."""

    @classmethod
    def of(cls, cell: Cell) -> "TrueSurface":
        """Return the surface of a cell.

        Raises
        ------
        FileAccessError, SchemaError
            If the mesh cannot be read.
        """
        T = cell.T_base_surface
        offset = np.array(cell.file.simulation.contact.surface_offset)
        corners = cell.file.surface.metres * _triangles(cell.surface_path)
        return cls(corners @ T[:3, :3].T + T[:3, 3] + offset)

    def hit(self, origin: FloatArray, direction: FloatArray, reach: float) -> Hit | None:
        """Return the nearest point of the surface ahead; None when there is none within reach.

        Source: T. Möller, B. Trumbore, "Fast, minimum storage ray-triangle intersection", Journal
        of Graphics Tools 2(1), 1997.

        Parameters
        ----------
        origin : ndarray, shape (3,)
            In base, in m.
        direction : ndarray, shape (3,)
            Unit vector.
        reach : float
            In m.
        """
        first = self.corners[:, 0]
        edge_1, edge_2 = self.corners[:, 1] - first, self.corners[:, 2] - first
        across = np.cross(direction, edge_2)
        steep = np.sum(edge_1 * across, axis=1)
        crossed = np.abs(steep) > _GRAZING
        scale = np.where(crossed, steep, 1.0)
        from_first = origin - first
        u = np.sum(from_first * across, axis=1) / scale
        turned = np.cross(from_first, edge_1)
        v = turned @ direction / scale
        distance = np.sum(edge_2 * turned, axis=1) / scale
        edge = 1e-9
        inside = crossed & (u >= -edge) & (v >= -edge) & (u + v <= 1.0 + edge)
        ahead = inside & (distance >= 0.0) & (distance <= reach)
        if not ahead.any():
            return None
        face = int(np.argmin(np.where(ahead, distance, np.inf)))
        normal = np.cross(edge_1[face], edge_2[face])
        normal *= -np.sign(normal @ direction) / np.linalg.norm(normal)
        return Hit(float(distance[face]), normal)


def _triangles(path: Path) -> FloatArray:
    """Return the triangles of a mesh file in its own unit, shape (face, 3, 3)."""
    try:
        with path.open("rb") as file:
            mesh = trimesh.load_mesh(file, file_type=path.suffix[1:].lower(), process=False)
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, IndexError, KeyError, TypeError, AttributeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(f"mesh {path} cannot be read: {reason}") from error
    triangles: FloatArray = np.asarray(getattr(mesh, "triangles", ()), dtype=np.float64)
    if not len(triangles):
        raise SchemaError(f"mesh {path} has no triangle")
    return triangles
