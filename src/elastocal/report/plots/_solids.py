"""Triangle meshes of what stands in a cell, as few as the screen needs, shaded for Plotly.

They are the shapes that collisions are checked with: fine meshes of a maker's drawings are not
needed to see how the robot stands. Shades are computed here, so that the light is the same on
every machine and in every posture.

Meshes are made coarser by clusters of vertices: J. Rossignac, P. Borrel, "Multi-resolution 3D
approximations for rendering complex scenes", in Modeling in Computer Graphics, Springer, 1993.
Vertices in one cell of a grid become their mean; faces and edges that lose a corner go.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal import shapes
from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import TOOLING, Cell
from elastocal.planning import CollisionScene, PlanResult, collision_scene
from elastocal.planning.surface import Surface
from elastocal.report.plots import style
from elastocal.report.plots.style import tint
from elastocal.results import brief_repr

MOVING_COLOURS = (style.ARM, style.TOOL)
_SECTIONS = 24
"""Sides of a drawn cylinder."""
MOST_OF_TOOLING = 60_000
"""Faces of the tooling that an interactive page draws; its file would grow by 40 bytes a face."""
MOST_OF_FIXTURE = 20_000
"""Faces of one fixture."""
MOST_OF_LINK = 3_000
"""Faces of one part of the robot, whose vertices the page holds for every posture."""
_COARSER = 1.25
"""By how much the cells grow until there are few enough faces."""
_DARK = 0.5
"""Brightness of a face that is turned away from the light."""
_UNLIT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0}


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

    def brightness(self, light: FloatArray) -> FloatArray:
        """Return how much light falls on each face, from 0 (turned away) to 1, shape (face,).

        Parameters
        ----------
        light : ndarray, shape (3,)
            Unit vector towards the light.
        """
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        cosine = normal @ light / np.where(length > 0.0, length, 1.0)
        return np.asarray(0.5 + 0.5 * cosine)


@dataclass(frozen=True, eq=False)
class RobotSolids:
    """Links and tool of a robot; `at` places them."""

    scene: CollisionScene
    parts: tuple[Solid, ...]
    """Links, then tool, each in its own frame, as `CollisionScene.moving` orders them."""

    @property
    def on_tool(self) -> IndexArray:
        """Whether each face of the joined mesh is the tool's: 1 or else 0, shape (face,)."""
        links = len(self.parts) - len(self.scene.tool)
        sizes = [len(part.faces) for part in self.parts]
        return np.repeat((np.arange(len(self.parts)) >= links).astype(np.intp), sizes)

    def at(self, q: FloatArray) -> list[Solid]:
        """Return links and tool as one mesh in base, one a configuration.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Joint positions in rad or m, in the order of the robot's joints.
        """
        places = np.stack([body.T_frame_body for body in self.scene.moving(q)], axis=1)
        return [
            joined([part.placed(T) for part, T in zip(self.parts, row, strict=True)])
            for row in places
        ]


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
        return f"{what} is drawn with {drawn} faces in place of {self.whole}."


def robot_solids(cell: Cell, surface: Surface) -> RobotSolids:
    """Return the solids of a cell's robot and tool."""
    scene = collision_scene(cell, surface)
    nowhere = np.zeros((0, len(cell.robot.joint_names)))
    return RobotSolids(scene, tuple(triangles_of(body.solid) for body in scene.moving(nowhere)))


def fixture_solids(cell: Cell, surface: Surface) -> dict[str, Solid]:
    """Return the fixtures of a cell in base, by name; not the tooling."""
    return {
        body.name: triangles_of(body.solid).placed(body.T_frame_body)
        for body in collision_scene(cell, surface).obstacles
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


def solid_trace(
    solid: Solid, light: FloatArray, name: str, colours: Sequence[str], part: Any = 0
) -> Any:
    """Return a Plotly mesh of a solid.

    Parameters
    ----------
    solid : Solid
        In base.
    light : ndarray, shape (3,)
        Unit vector towards the light.
    name : str
        Of the trace.
    colours : sequence of str
        Of the parts, as ``#rrggbb``.
    part : int or ndarray of int, shape (face,)
        Which part each face belongs to.
    """
    i, j, k = np.asarray(solid.faces, dtype=np.int32).T
    return go.Mesh3d(
        **_xyz(solid.vertices), i=i, j=j, k=k, name=name, hoverinfo="skip", showscale=False,
        intensity=tones(solid, light, part, len(colours)), intensitymode="cell", cmin=0.0, cmax=1.0,
        colorscale=_scale(colours), lighting=_UNLIT,
    )  # fmt: skip


def tones(solid: Solid, light: FloatArray, part: Any, parts: int) -> Any:
    """Return where each face lies on the colour scale of `solid_trace`, shape (face,).

    Each part has its own stretch of the scale, from dark to light.
    """
    within = 0.01 + 0.98 * solid.brightness(light)
    return ((part + within) / parts).astype(np.float32)


def _scale(colours: Sequence[str]) -> list[tuple[float, str]]:
    count = len(colours)
    return [
        stop
        for k, colour in enumerate(colours)
        for stop in ((k / count, tint(colour, _DARK, ground=0)), ((k + 1) / count, colour))
    ]


@dataclass(frozen=True, eq=False)
class MovingParts:
    """The robot at HOME and at every pose, with the lines of sight."""

    robot: tuple[Solid, ...]
    """HOME first."""
    on_tool: IndexArray
    """Part that each face of the robot belongs to, shape (face,): 0 the arm, 1 the tool."""
    light: FloatArray
    """Unit vector towards the light, shape (3,)."""
    sight: tuple[FloatArray, ...]
    """Lines from marker to station and a gap, each of shape (3, 3); NaN where no station sees.
    Empty in a cell without stations."""
    note: str = ""
    """A remark for readers on how the robot is drawn."""

    def frames(self) -> list[Any]:
        """Return a Plotly frame for every posture: what changes of the first traces."""
        frames = []
        for number, robot in enumerate(self.robot):
            shade = tones(robot, self.light, self.on_tool, len(MOVING_COLOURS))
            data = [{"type": "mesh3d", **_xyz(robot.vertices), "intensity": shade}]
            if self.sight:
                data.append({"type": "scatter3d", **_xyz(self.sight[number])})
            frames.append(go.Frame(name=str(number), data=data, traces=list(range(len(data)))))
        return frames


def moving_parts(cell: Cell, surface: Surface, plan: PlanResult, light: FloatArray) -> MovingParts:
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
    return MovingParts(tuple(solids.at(q)), solids.on_tool, light, sight, note)


def _sight(cell: Cell, T_base_tcp: FloatArray, name: str | None) -> FloatArray:
    marker = cell.file.marker
    stations = {station.name: station.position_base for station in cell.file.trackers}
    if marker is None or name is None or name not in stations:
        return np.full((3, 3), np.nan)
    start = T_base_tcp[:3, :3] @ marker.position_tcp + T_base_tcp[:3, 3]
    return segments([(start, stations[name])])


def scatter(
    points: FloatArray, mode: str, name: str, hoverinfo: str = "skip", **options: object
) -> Any:
    """Return a Plotly trace of points or lines, shape (point, 3), in base in m."""
    return go.Scatter3d(**_xyz(points), mode=mode, name=name, hoverinfo=hoverinfo, **options)


def _xyz(points: FloatArray) -> dict[str, object]:
    """Return coordinates in single precision, which is good to a micrometre within 10 m."""
    return dict(zip("xyz", np.asarray(points, dtype=np.float32).T, strict=True))


def segments(lines: Iterable[Sequence[FloatArray]]) -> FloatArray:
    """Return separate lines as one array with NaN between them, shape (3 line, 3)."""
    gap = np.full(3, np.nan)
    return np.array([row for ends in lines for row in (*ends, gap)]).reshape(-1, 3)
