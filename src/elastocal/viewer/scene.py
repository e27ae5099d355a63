"""Scene of a cell: layers of solids, lines, dots and tags, and the camera.

`scene_data` only describes the scene, and ``viewer.js`` draws it. Solids are the shapes of the
collision checks: detailed meshes are not needed to see the robot's posture. A part of the robot is
held once, in its own frame; a page places it by the transforms of a posture.

Meshes are simplified by clustering vertices: J. Rossignac, P. Borrel, "Multi-resolution 3D
approximations for rendering complex scenes", in Modeling in Computer Graphics, Springer, 1993.
Vertices in one cell of a grid become their mean; faces and edges that lose a corner are removed.
"""

import base64
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from elastocal import shapes
from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import TOOLING, Cell, RegionEntry
from elastocal.errors import present
from elastocal.planning import CollisionScene
from elastocal.planning.surface import Surface
from elastocal.results import brief_repr
from elastocal.wording import millimetres, phrase, sentences

_SECTIONS = 24
"""Sides of a drawn cylinder."""
MOST_OF_TOOLING = 60_000
"""Faces of the tooling that an interactive page draws; its file would grow by 24 bytes a face."""
MOST_OF_FIXTURE = 20_000
"""Faces of one fixture."""
MOST_OF_LINK = 3_000
"""Faces of one part of the robot."""
_COARSER = 1.25
"""Factor by which the cells grow until the number of faces is small enough."""
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


@brief_repr
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
        """Return a remark on the drawing; nothing when it is drawn whole."""
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
        Scene of the cell.
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
    if not np.linalg.norm(across) > 1e-6:  # For a lift, the beams are beside the robot.
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
    """Return a solid with at most a number of faces.

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
    # Two cells along each side make eight vertices, and those at most 56 triangles.
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


_FIELD_OF_VIEW = np.radians(45.0)
"""Field of view upward, in rad; ``viewer.js`` has the same."""
_ASPECT = 1.5
"""Width by height of the picture that cameras are set for; the viewer steps back if narrower."""
_ROOM = 1.08
_MARGIN = 0.05


@brief_repr
@dataclass(frozen=True, eq=False)
class Paint:
    """A solid and its colour."""

    solid: Solid
    """Solid in base; for a part of the robot in its own frame."""
    colour: str
    """``#rrggbb``, or a name of the page's style sheet, which may follow the scheme."""
    part: int = -1
    """Number of the robot's part that it is; -1 for what stays."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Strokes:
    """Separate straight lines."""

    ends: FloatArray
    """Shape (line, 2, 3), in m in base."""
    colour: str
    width: float
    """In pixels."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Dots:
    """Small discs."""

    at: FloatArray
    """Shape (dot, 3), in m in base."""
    colours: IndexArray
    """Red, green and blue from 0 to 255, shape (dot, 3)."""
    hints: tuple[str, ...] = ()
    """Texts that a reader who points at one sees; empty for none."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Tags:
    """Short texts at places."""

    at: FloatArray
    """Shape (tag, 3), in m in base."""
    texts: tuple[str, ...]
    colour: str
    hints: tuple[str, ...]
    normals: FloatArray | None = None
    """Normals of poses: out of the surface, shape (tag, 3); a tag on the far side is drawn pale."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Layer:
    """Parts that are shown and hidden together."""

    label: str
    colour: str
    """Colour of the switch's swatch."""
    parts: tuple[Paint | Strokes | Dots | Tags, ...]
    shown: bool = True
    """Whether the layer is on when the page opens."""
    note: str = ""
    """A remark for readers on how it is drawn."""
    name: str = ""
    """Name by which a page replaces its parts; empty for a constant layer."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Camera:
    """Viewpoint of a scene."""

    name: str
    centre: FloatArray
    """Point in the middle of the picture, shape (3,), in m in base."""
    eye: FloatArray
    """Shape (3,), in m in base."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Scene:
    """Layers and camera."""

    layers: tuple[Layer, ...]
    cameras: tuple[Camera, ...]
    """The first is the initial one."""
    light: FloatArray
    """Unit vector towards the light, shape (3,)."""
    up: FloatArray
    """The world's vertical in base, shape (3,)."""
    floor: float
    """Height above which the camera stays, along `up`, in m."""
    places: FloatArray
    """``T_base_part`` of the robot's parts, shape (posture, part, 4, 4)."""


def cell_scene(
    cell: Cell, surface: Surface, collisions: CollisionScene, q: FloatArray, reach: FloatArray
) -> Scene:
    """Return the scene of a cell: robot, tooling, fixtures, rail, region and stations.

    Parameters
    ----------
    cell, surface, collisions : Cell, Surface, CollisionScene
        Which belong together.
    q : ndarray, shape (posture, joint)
        Postures, in rad or m: the first determines the floor, and the second, if there is one, the
        camera.
    reach : ndarray, shape (point, 3)
        What else the camera for the whole cell has in its picture, in m.
    """
    robot = robot_solids(collisions, q)
    postures = [robot.at(posture).vertices for posture in range(len(q))]
    tooling = surface.mesh.vertices
    # The world's vertical in base: a robot may hang from the ceiling.
    up = cell.T_world_base[2, :3]
    everything = _box_of(cell, collisions, np.concatenate([tooling, *postures, reach]))
    direction = _viewing_direction(cell, tooling, up)
    layers = (
        _robot(robot),
        _tooling(surface),
        *_fixtures(collisions),
        *_rail(cell),
        *_region(cell, surface),
        *_stations(cell),
    )
    return Scene(
        layers,
        tuple(_cameras(tooling, postures[:2][-1], everything, direction, up)),
        _unit(0.6 * direction + up),
        up,
        float((np.concatenate([tooling, postures[0]]) @ up).min()),
        robot.places,
    )


def arms_scene(
    arms: Sequence[tuple[str, RobotSolids, FloatArray]], points: FloatArray, up: FloatArray
) -> Scene:
    """Return the scene of arms that work on each other, a layer each.

    Parameters
    ----------
    arms : sequence of (str, RobotSolids, ndarray)
        Name, solids at the same postures of all, and base in the common frame, shape (4, 4).
    points : ndarray, shape (point, 3)
        Where they work, in the common frame, in m.
    up : ndarray, shape (3,)
        The world's vertical there.
    """
    layers, places, bodies = list[Layer](), list[FloatArray](), list[FloatArray]()
    first = 0
    for name, robot, T in arms:
        layers.append(_robot(robot, name, first))
        first += len(robot.parts)
        places.append(T @ robot.places)
        bodies.append(robot.at(0).placed(T).vertices)
    bases = np.array([T[:3, 3] for _, _, T in arms])
    along = np.ptp(bases, axis=0)
    side = _unit(np.cross(up, along if np.linalg.norm(along) > 0.0 else np.roll(up, 1)))
    whole = np.concatenate([*bodies, points])
    views = (
        (phrase("Both arms"), whole, side + 0.5 * up),
        (phrase("Where they meet"), points, side + 0.5 * up),
        (phrase("From the side"), whole, side + 0.1 * up),
        (phrase("From above"), whole, up + 0.05 * side),
    )
    cameras = tuple(_camera(name, seen, _unit(towards), up) for name, seen, towards in views)
    floor = float((np.concatenate(bodies) @ up).min())
    light = _unit(0.6 * side + up)
    return Scene(tuple(layers), cameras, light, up, floor, np.concatenate(places, axis=1))


def _robot(robot: RobotSolids, name: str = phrase("Robot and tool"), first: int = 0) -> Layer:
    """Return the layer of a robot whose parts are numbered from one on."""
    parts = tuple(
        Paint(part, "--arm" if number < robot.tool else "--tool", first + number)
        for number, part in enumerate(robot.parts)
    )
    return Layer(name, "--arm", parts, note=robot.note)


def _tooling(surface: Surface) -> Layer:
    """Return the surface and the lines at which its smooth patches end."""
    mesh = surface.mesh
    drawn = coarsened(Solid(mesh.vertices, mesh.faces), MOST_OF_TOOLING)
    face, corner = np.divmod(surface.border_half_edges, 3)
    ends = np.stack([mesh.faces[face, (corner + step) % 3] for step in (0, 1)], axis=1)
    edges = Strokes(drawn.solid.vertices[drawn.edges(ends)], "--muted", 1.5)
    paint = Paint(drawn.solid, "--tooling")
    return Layer(
        phrase("Tooling"), "--tooling", (paint, edges), note=drawn.note(phrase("The tooling"))
    )


def _fixtures(collisions: CollisionScene) -> Iterator[Layer]:
    """Yield the layer of the fixtures, if there are any."""
    drawn = {
        name: coarsened(solid, MOST_OF_FIXTURE)
        for name, solid in fixture_solids(collisions).items()
    }
    if drawn:
        together = joined([fixture.solid for fixture in drawn.values()])
        notes = (
            fixture.note(phrase("Fixture {name}", name=name)) for name, fixture in drawn.items()
        )
        note = sentences([note for note in notes if note])
        parts = (Paint(together, "--fixture"),)
        yield Layer(phrase("Fixtures"), "--fixture", parts, note=note)


def _rail(cell: Cell) -> Iterator[Layer]:
    """Yield the layer of the rail below the robot, if there is one."""
    solid = rail_solid(cell)
    if solid is not None:
        yield Layer(phrase("Rail"), "--rail", (Paint(solid, "--rail"),))


def _region(cell: Cell, surface: Surface) -> Iterator[Layer]:
    """Yield the layer of the edges that bound where poses may be, if anything does."""
    region = cell.file.surface.region
    if region is not None:
        T = cell.T_base_surface @ region.pose.T
        low, high = np.split(_region_corners(region, surface, T), 2)
        rings = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (low, high)]
        ends = np.concatenate([*rings, np.stack([low, high], axis=1)])
        strokes = Strokes(ends @ T[:3, :3].T + T[:3, 3], "--region", 2.5)
        yield Layer(phrase("Region of the tooling"), "--region", (strokes,))


def _region_corners(region: RegionEntry, surface: Surface, T: FloatArray) -> FloatArray:
    """Return the lower corners, then the upper ones, in the region's frame, shape (corner, 3)."""
    if region.box is not None:
        (x0, y0, z0), (x1, y1, z1) = region.box.min, region.box.max
        flat, heights = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)], (z0, z1)
    else:
        polygon = present(region.polygon, "region.polygon")
        own = (surface.mesh.vertices - T[:3, 3]) @ T[:3, :3]
        heights = polygon.height or (float(own[:, 2].min()), float(own[:, 2].max()))
        flat = list(polygon.corners)
    return np.array([(*corner, height) for height, corner in product(heights, flat)])


def _stations(cell: Cell) -> Iterator[Layer]:
    """Yield the layer of the tracker stations, if there are any."""
    stations = cell.file.trackers
    if stations:
        hints = tuple(
            phrase(
                "{station}\nx, y, z: {place} mm\nrange {near} m to {far} m",
                station=station.name,
                place=millimetres(station.position),
                near=f"{station.range[0]:g}",
                far=f"{station.range[1]:g}",
            )
            for station in stations
        )
        at = np.array([station.position_base for station in stations])
        tags = Tags(at, tuple(station.name for station in stations), "--sight", hints)
        yield Layer(phrase("Tracker stations"), "--sight", (tags,))


def _box_of(cell: Cell, collisions: CollisionScene, points: FloatArray) -> FloatArray:
    """Return the corners of a box that holds everything, whatever the size of the floor, (8, 3)."""
    stations = [station.position_base[None] for station in cell.file.trackers]
    points = np.concatenate([points, *stations])
    low, high = points.min(axis=0), points.max(axis=0)
    room = _MARGIN * float(np.max(high - low))
    least, most = low - 4.0 * room, high + 4.0 * room
    for solid in fixture_solids(collisions).values():
        inner = np.clip(solid.vertices, least, most)
        # A fixture that only begins beyond the box is left out of it.
        if np.all(np.ptp(inner, axis=0) > 0.0):
            low, high = np.minimum(low, inner.min(axis=0)), np.maximum(high, inner.max(axis=0))
    return np.array(list(product(*zip(low - room, high + room, strict=True))))


def _cameras(
    tooling: FloatArray, robot: FloatArray, box: FloatArray, direction: FloatArray, up: FloatArray
) -> Iterator[Camera]:
    """Yield cameras on points of the tooling, of the robot at work, and of everything."""
    work, level = np.concatenate([tooling, robot]), direction - up * (up @ direction)
    for name, points, towards in (
        (phrase("Robot and tooling"), work, direction),
        (phrase("Tooling"), tooling, direction),
        (phrase("Whole cell"), box, direction),
        (phrase("From the side"), work, level + 0.1 * up),
        (phrase("From above"), work, up + 0.05 * level),
    ):
        yield _camera(name, points, _unit(towards), up)


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


def _viewing_direction(cell: Cell, tooling: FloatArray, up: FloatArray) -> FloatArray:
    """Return the direction of view: beside the robot, from above, opposite to the stations."""
    middle = tooling.mean(axis=0)
    ahead = middle - up * (up @ middle)
    # A tooling right above or below the base leaves the side open: any will do.
    ahead = _unit(ahead if np.linalg.norm(ahead) > 1e-6 else np.roll(up, 1))
    side = np.cross(up, ahead)
    stations = [station.position_base for station in cell.file.trackers]
    away = -1.0 if stations and side @ np.mean(stations, axis=0) > 0.0 else 1.0
    return _unit(0.85 * away * side + 0.3 * ahead + 0.65 * up)


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector with length 1, or as it is with length 0."""
    return vector / (np.linalg.norm(vector) or 1.0)


def scene_data(scene: Scene, say: Callable[[object], str] = str) -> dict[str, object]:
    """Return a scene as the viewer takes it, ready for JSON.

    Parameters
    ----------
    scene : Scene
        What is drawn.
    say : callable
        Returns a text in the language of the page.
    """
    return {
        "layers": [
            {
                "name": layer.name,
                "label": say(layer.label),
                "colour": layer.colour,
                "shown": layer.shown,
                "parts": [_part_data(part, say) for part in layer.parts],
            }
            for layer in scene.layers
        ],
        "cameras": [
            {"name": say(each.name), "centre": each.centre.tolist(), "eye": each.eye.tolist()}
            for each in scene.cameras
        ],
        "light": scene.light.tolist(),
        "up": scene.up.tolist(),
        "floor": scene.floor,
        "places": packed_places(scene.places),
    }


def _part_data(
    part: Paint | Strokes | Dots | Tags, say: Callable[[object], str]
) -> dict[str, object]:
    match part:
        case Paint(solid, colour, number):
            vertices, faces = packed(solid.vertices), packed(solid.faces, "<u4")
            own = {"vertices": vertices, "faces": faces, "colour": colour, "part": number}
        case Strokes(ends, colour, width):
            own = {"ends": packed(ends), "colour": colour, "width": width}
        case Dots(at, colours, hints):
            own = {"at": packed(at), "colours": packed(colours, "u1")}
            own |= {"hints": list(map(say, hints))}
        case Tags(at, texts, colour, hints, normals):
            own = {"at": packed(at), "texts": list(texts), "colour": colour}
            own |= {"hints": list(map(say, hints))}
            own |= {"normals": None if normals is None else packed(normals)}
    return {"kind": type(part).__name__.lower(), **own}


def packed(values: FloatArray | IndexArray, kind: str = "<f4") -> str:
    """Return numbers as base64; single precision is good to a micrometre within 10 m."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def packed_places(places: FloatArray) -> str:
    """Return transforms, shape (..., 4, 4), as the viewer takes them: column by column."""
    return packed(np.swapaxes(places, -1, -2))
