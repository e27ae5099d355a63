"""The cell as it is drawn: triangles once, and where the moving ones stand at a posture.

Triangles are those that collisions are checked with, made as few as a screen needs; the page gets
them as single precision, and draws them where it is told to.
"""

import base64
from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import TOOLING, Cell, RegionEntry
from elastocal.errors import present
from elastocal.planning import CollisionScene
from elastocal.planning.surface import Surface
from elastocal.records import record
from elastocal.report.plots import Solid, coarsened, triangles_of
from elastocal.results import brief_repr
from elastocal.robot.inverse import arm_base

_MOST_OF_LINK, _MOST_OF_FIXTURE, _MOST_OF_TOOLING = 6_000, 20_000, 60_000
"""Faces that are drawn of a link, a fixture, and the tooling."""
ARM, TOOL, FIXTURE = "arm", "tool", "fixture"
"""Roles of bodies, beside that of the tooling."""


@brief_repr
@record(eq=False)
class DrawnBody:
    """Triangles of one body, in its own frame if it moves, else in base."""

    name: str
    role: str
    """arm, tool, tooling or fixture."""
    moves: bool
    """Whether it has a place at every posture."""
    vertices: str
    """Coordinates in m: single precision, little endian, base64."""
    faces: str
    """Numbers of vertices, 32 bits, likewise."""


@brief_repr
@record()
class DrawnLine:
    """Points in base, in m, that are joined one by one; or in pairs."""

    name: str
    points: tuple[tuple[float, float, float], ...]


@record()
class DrawnPlace:
    """A named point in base, in m."""

    name: str
    position: tuple[float, float, float]


@brief_repr
@record()
class Scene:
    """All that stands, and the shapes of what moves."""

    bodies: tuple[DrawnBody, ...]
    region: DrawnLine | None
    """Edges of the region, in pairs; none where the whole surface may be pressed on."""
    rail: DrawnLine | None
    """The foot of the arm from one end of its linear axis to the other."""
    stations: tuple[DrawnPlace, ...]
    low: tuple[float, float, float]
    """Corner of the box round the work, in m: what a camera looks at first."""
    high: tuple[float, float, float]
    note: str = ""
    """A remark on how it is drawn."""


def drawn_scene(cell: Cell, surface: Surface, scene: CollisionScene) -> Scene:
    """Return what a page draws of a cell.

    Parameters
    ----------
    cell, surface : Cell, Surface
        The cell.
    scene : CollisionScene
        Of the same cell.
    """
    bodies = tuple(_bodies(cell, surface, scene))
    stations = tuple(
        DrawnPlace(station.name, _triple(station.position_base)) for station in cell.file.trackers
    )
    points = np.concatenate(
        [surface.mesh.vertices, cell.robot.forward(cell.home)[None, :3, 3], _feet(cell)]
    )
    return Scene(
        bodies=bodies,
        region=_region(cell, surface),
        rail=_rail(cell),
        stations=stations,
        low=_triple(points.min(axis=0)),
        high=_triple(points.max(axis=0)),
    )


def _bodies(cell: Cell, surface: Surface, scene: CollisionScene) -> Iterator[DrawnBody]:
    moving = scene.moving(np.zeros((0, len(cell.robot.joint_names))))
    links = len(moving) - len(scene.tool)
    for number, body in enumerate(moving):
        solid = coarsened(triangles_of(body.solid), _MOST_OF_LINK).solid
        yield _body(body.name, ARM if number < links else TOOL, True, solid)
    mesh = coarsened(Solid(surface.mesh.vertices, surface.mesh.faces), _MOST_OF_TOOLING).solid
    yield _body(TOOLING, TOOLING, False, mesh)
    for body in scene.obstacles:
        if body.name != TOOLING:
            solid = coarsened(triangles_of(body.solid), _MOST_OF_FIXTURE).solid
            yield _body(body.name, FIXTURE, False, solid.placed(body.T_frame_body))


def _body(name: str, role: str, moves: bool, solid: Solid) -> DrawnBody:
    vertices = np.ascontiguousarray(solid.vertices, dtype="<f4").tobytes()
    faces = np.ascontiguousarray(solid.faces, dtype="<u4").tobytes()
    return DrawnBody(
        name, role, moves, base64.b64encode(vertices).decode(), base64.b64encode(faces).decode()
    )


def _feet(cell: Cell) -> FloatArray:
    """Return the foot of the arm at both ends of its external axes, shape (end, 3), in m."""
    count, limits = cell.robot.external_axes, cell.robot.limits
    ends = np.stack([limits.lower[:count], limits.upper[:count]])
    ends = np.where(np.isfinite(ends), ends, 0.0)
    return np.asarray(arm_base(cell.robot, ends)[:, :3, 3])


def _rail(cell: Cell) -> DrawnLine | None:
    if cell.file.robot.rail is None:
        return None
    return DrawnLine(cell.file.robot.rail.name, tuple(map(_triple, _feet(cell))))


def _region(cell: Cell, surface: Surface) -> DrawnLine | None:
    """Return the edges of the box or the prism that bounds where poses may be."""
    region = cell.file.surface.region
    if region is None:
        return None
    T = cell.T_base_surface @ region.pose.T
    corners = _region_corners(region, surface, T)
    low, high = np.split(corners, 2)
    edges = [*_ring(low), *_ring(high), *zip(low, high, strict=True)]
    ends = np.array(edges).reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
    return DrawnLine("region", tuple(map(_triple, ends)))


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


def _ring(corners: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    return list(pairwise([*corners, corners[0]]))


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
