"""Triangle meshes of what stands in a cell, as few as the screen needs.

They are the shapes that collisions are checked with: fine meshes of a maker's drawings are not
needed to see how the robot stands. A part of the robot is held once, in its own frame, with its
place in every posture.

Meshes are made coarser by clusters of vertices: J. Rossignac, P. Borrel, "Multi-resolution 3D
approximations for rendering complex scenes", in Modeling in Computer Graphics, Springer, 1993.
Vertices in one cell of a grid become their mean; faces and edges that lose a corner go.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal import shapes
from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import TOOLING, Cell
from elastocal.planning import CollisionScene
from elastocal.results import brief_repr
from elastocal.wording import phrase

_SECTIONS = 24
"""Sides of a drawn cylinder."""
MOST_OF_TOOLING = 60_000
"""Faces of the tooling that an interactive page draws; its file would grow by 24 bytes a face."""
MOST_OF_FIXTURE = 20_000
"""Faces of one fixture."""
MOST_OF_LINK = 3_000
"""Faces of one part of the robot."""
_COARSER = 1.25
"""By how much the cells grow until there are few enough faces."""
_BEAM, _BEAM_APART = 0.12, 0.56
"""Side of a rail's two beams, and from the middle of one to that of the other, in m."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles; vertices in m."""

    vertices: FloatArray
    """Shape (vertex, 3)."""
    faces: IndexArray
    """Shape (face, 3)."""

    def placed(self, T: FloatArray) -> "Solid":
        """Return the solid moved by a transform, shape (4, 4)."""
        return Solid(self.vertices @ T[:3, :3].T + T[:3, 3], self.faces)


@dataclass(frozen=True, eq=False)
class RobotSolids:
    """Links and tool of a robot, and where they are in some postures."""

    parts: tuple[Solid, ...]
    """Links, then tool, each in its own frame, as `CollisionScene.moving` orders them."""
    tool: int
    """Number of the first part of the tool."""
    places: FloatArray
    """``T_base_part``, shape (posture, part, 4, 4)."""
    note: str = ""
    """A remark for readers on how the robot is drawn."""

    def at(self, posture: int) -> Solid:
        """Return links and tool as one mesh in base."""
        places = zip(self.parts, self.places[posture], strict=True)
        return joined([part.placed(T) for part, T in places])


@brief_repr
@dataclass(frozen=True, eq=False)
class CoarseSolid:
    """A mesh as it is drawn."""

    solid: Solid
    cluster: IndexArray
    """Vertex of the drawn solid that each vertex of the whole one went into, shape (vertex,)."""
    whole: int
    """Faces of the whole mesh."""

    def edges(self, ends: IndexArray) -> IndexArray:
        """Return which edges of the whole mesh are left, each once, shape (edge, 2).

        Parameters
        ----------
        ends : ndarray of int, shape (edge, 2)
            Vertex numbers of the whole mesh.
        """
        drawn = np.sort(self.cluster[ends], axis=1)
        return np.unique(drawn[drawn[:, 0] < drawn[:, 1]], axis=0)

    def note(self, what: str) -> str:
        """Return what to tell of it; nothing when it is drawn whole."""
        drawn = len(self.solid.faces)
        if drawn == self.whole:
            return ""
        return phrase(
            "{what} is drawn with {drawn} faces in place of {whole}.",
            what=what,
            drawn=drawn,
            whole=self.whole,
        )


def robot_solids(scene: CollisionScene, q: FloatArray) -> RobotSolids:
    """Return the solids of a cell's robot and tool.

    Parameters
    ----------
    scene : CollisionScene
        Of the cell.
    q : ndarray, shape (posture, joint)
        Joint positions in rad or m, in the order of the robot's joints.
    """
    bodies = scene.moving(q)
    parts = [coarsened(triangles_of(body.solid), MOST_OF_LINK) for body in bodies]
    finer = any(part.note("A part") for part in parts)
    return RobotSolids(
        tuple(part.solid for part in parts),
        len(parts) - len(scene.tool),
        np.stack([body.T_frame_body for body in bodies], axis=1),
        phrase("Parts of the robot with fine meshes are drawn coarser.") if finer else "",
    )


def rail_solid(cell: Cell) -> Solid | None:
    """Return the two beams of the rail below the robot's foot; None without a rail."""
    rail = cell.file.robot.rail
    if rail is None:
        return None
    along = np.asarray(rail.axis, dtype=float) / np.linalg.norm(rail.axis)
    up = rail.pose.T[:3, 2]
    across = np.cross(up, along)
    if not np.linalg.norm(across) > 1e-6:  # A lift: its beams stand beside the robot.
        up, across = rail.pose.T[:3, 0], rail.pose.T[:3, 1]
    else:
        across /= np.linalg.norm(across)
    R = np.stack([along, across, np.cross(along, across)], axis=1)
    low, high = rail.travel
    box = shapes.Box(high - low + 2.0 * _BEAM_APART, _BEAM, _BEAM)
    beams = []
    for side in (-0.5, 0.5):
        T = np.eye(4)
        T[:3, :3] = R
        middle = rail.pose.T[:3, 3] + 0.5 * (low + high) * along
        T[:3, 3] = middle + side * _BEAM_APART * across - 0.5 * _BEAM * R[:, 2]
        beams.append(triangles_of(box).placed(T))
    return joined(beams)


def fixture_solids(scene: CollisionScene) -> dict[str, Solid]:
    """Return the fixtures of a cell in base, by name; not the tooling."""
    return {
        body.name: triangles_of(body.solid).placed(body.T_frame_body)
        for body in scene.obstacles
        if body.name != TOOLING
    }


def joined(solids: Sequence[Solid]) -> Solid:
    """Return several solids as one."""
    if not solids:
        return Solid(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp))
    starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    faces = [solid.faces + start for solid, start in zip(solids, starts, strict=False)]
    return Solid(np.concatenate([solid.vertices for solid in solids]), np.concatenate(faces))


def triangles_of(solid: shapes.Solid) -> Solid:
    """Return the triangles of a solid, its round sides as fine as they are drawn."""
    mesh = solid.triangulated(_SECTIONS)
    return Solid(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.intp))


def coarsened(solid: Solid, most: int) -> CoarseSolid:
    """Return a solid with no more than a number of faces.

    Parameters
    ----------
    solid : Solid
        Its vertices are welded.
    most : int
        Faces, at least 56. A solid that has no more stays as it is.
    """
    count = len(solid.faces)
    if count <= most:
        return CoarseSolid(solid, np.arange(len(solid.vertices)), count)
    a, b = solid.vertices[solid.faces[:, 0]], solid.vertices[solid.faces[:, 1]]
    size = float(np.ptp(solid.vertices, axis=0).max())
    middling = float(np.median(np.linalg.norm(b - a, axis=1)))
    cell = max(middling, 1e-6 * size) * np.sqrt(count / most)
    # Two cells along each side make eight vertices, and those no more than 56 triangles.
    coarsest = 0.51 * size
    while True:
        cell = min(cell, coarsest)
        cluster, vertices = _clusters(solid.vertices, cell)
        faces = _proper(cluster[solid.faces])
        if len(faces) <= most or cell == coarsest:
            return CoarseSolid(Solid(vertices, faces), cluster, count)
        cell *= _COARSER


def _clusters(vertices: FloatArray, cell: float) -> tuple[IndexArray, FloatArray]:
    """Return the cluster of each vertex, and the mean of each cluster."""
    place = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    _, cluster, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    cluster = cluster.reshape(-1)
    sums = [np.bincount(cluster, vertices[:, axis]) for axis in range(3)]
    return cluster, np.stack(sums, axis=1) / count[:, None]


def _proper(faces: IndexArray) -> IndexArray:
    """Return the faces with three different corners, each once."""
    corners = np.sort(faces, axis=1)
    kept = np.flatnonzero((np.diff(corners, axis=1) != 0).all(axis=1))
    _, first = np.unique(corners[kept], axis=0, return_index=True)
    return faces[kept[np.sort(first)]]
