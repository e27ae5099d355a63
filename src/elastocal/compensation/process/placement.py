"""Fibre placement courses across a tooling (paper section 4.2).

Forces: the compaction of 1100 N along the tool and amplitudes up to 280 N aside are the paper's
load cases for this process (4.2); how much of them acts, and how fast the head goes, is
assumed here.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import trimesh
from numpy.random import Generator

from elastocal.arrays import FloatArray
from elastocal.compensation.process.course import (
    Course,
    Process,
    arc_length,
    engaged,
    evenly_spaced,
    swing,
    tool_frames,
    unit_tangents,
)
from elastocal.compensation.settings import CompensatorSettings
from elastocal.errors import CompensationError
from elastocal.planning.surface import Surface

_RAYS = 400
"""Points across the surface, before they are spaced evenly."""


@dataclass(frozen=True)
class FibrePlacement(Process):
    """Courses across a surface, along y of its frame; deviations count aside."""

    border: float = 0.08
    """Distance of the courses from the border of the mesh, in m."""
    speed: float = 0.1
    """In m/s."""
    step: float = 0.04
    """Time between rows, in s."""
    compaction: float = 1100.0
    """In N."""
    compaction_swing: float = 0.05
    """Share of it."""
    lateral: tuple[float, float] = (120.0, 220.0)
    """Mean of a course, drawn between these, to either side, in N."""
    lateral_swing: float = 60.0
    """In N."""
    drag: float = 60.0
    """Against the direction of travel, in N."""
    rise: float = 0.5
    """Time in which the roller comes down, in s."""

    compensator: ClassVar[CompensatorSettings] = CompensatorSettings.model_validate(
        {"filter": {"lead": "40 ms"}}
    )
    """The lead makes up for filters (19 ms) and controller (22 ms, `loop.Controller`)."""

    def courses(self, surface: Surface, rng: Generator) -> tuple[Course, ...]:
        """Return courses across the surface; see `Process.courses`."""
        T = surface.T_base_surface
        own = (surface.mesh.vertices - T[:3, 3]) @ T[:3, :3]
        low, high = own.min(axis=0), own.max(axis=0)
        inside = np.linspace(low[0] + self.border, high[0] - self.border, self.count)
        return tuple(
            self._course(f"course {n + 1}", surface, (x, low[1], high[1], high[2]), rng)
            for n, x in enumerate(inside)
        )

    def _course(
        self, name: str, surface: Surface, where: tuple[float, float, float, float], rng: Generator
    ) -> Course:
        hits = _within(_hits(surface, where), self.border)
        if len(hits) < 10:
            raise CompensationError(f"{surface.name} is too small for {name} within its border")
        rows = evenly_spaced(hits, self.speed, self.step)
        kept, normal = rows[:, :3], rows[:, 3:]
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        forward = unit_tangents(kept)
        T = tool_frames(kept, forward, -normal)
        time = np.arange(float(len(kept))) * self.step
        share = engaged(time, self.rise)
        press = self.compaction * (1.0 + self.compaction_swing * swing(time, rng))
        mean = rng.choice([-1.0, 1.0]) * rng.uniform(*self.lateral)
        aside = mean + self.lateral_swing * swing(time, rng)
        tcp = np.stack([np.full(len(kept), -self.drag), aside, -press], axis=1) * share[:, None]
        force = np.einsum("rij,rj->ri", T[:, :3, :3], tcp)
        return Course(name, self.step, T, force, T[:, :3, 1], normal=normal)


def _hits(surface: Surface, where: tuple[float, float, float, float]) -> FloatArray:
    """Return points with normals, shape (point, 6), where a plane across the surface meets it.

    The plane is x = constant of the surface's frame, seen along its z.
    """
    x, low, high, top = where
    y = np.linspace(low, high, _RAYS)
    own = np.stack([np.full(len(y), x), y, np.full(len(y), top + 0.1)], axis=1)
    T = surface.T_base_surface
    origins, down = own @ T[:3, :3].T + T[:3, 3], -T[:3, 2]
    points, index, face = surface.rays.ray.intersects_location(
        origins, np.repeat(down[None], len(y), axis=0), multiple_hits=False
    )
    order = np.argsort(index)
    points, face = np.asarray(points)[order], np.asarray(face)[order]
    corners = surface.mesh.vertices[surface.mesh.faces[face]]
    weights = trimesh.triangles.points_to_barycentric(corners, points)  # type: ignore[no-untyped-call]
    return np.hstack([points, surface.normals_at(face, weights)])


def _within(rows: FloatArray, border: float) -> FloatArray:
    """Return the rows that are so far from both ends, in m; none when there are none."""
    if len(rows) < 2:
        return rows[:0]
    length = arc_length(rows[:, :3])
    kept: FloatArray = rows[(length > border) & (length < length[-1] - border)]
    return kept
