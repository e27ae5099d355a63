"""The contact disk on the tooling: point of contact, deformation under a force, and slip.

The tooling is the triangles of the cell's mesh, met by a straight approach as by a ray.

The disk sinks in by ``f_n / k_n`` and the tooling yields by ``f_n / k_t`` along its normal; both
are true motion of the tool, which marker and controller measure alike. Sideways the disk follows
Mindlin's law for a contact of which an outer ring slips already (R. D. Mindlin, "Compliance of
elastic bodies in contact", J. Appl. Mech. 16, 1949; K. L. Johnson, "Contact Mechanics", 1985, 7.2),

    shear = (3 mu f_n / 2 k_s) (1 - (1 - f_l / mu f_n)^(2/3)),

which starts as ``f_l / k_s`` and ends in full sliding at Coulomb's limit ``f_l = mu f_n``. It is
taken without its own hysteresis. The slip of the ring does not repeat exactly: a random part of it
grows towards the limit.

The force acts off the middle of the disk. A disk of radius R that is tilted by ``a`` on the tooling
is pressed unevenly, with the moment ``k_n R² a / 4`` of an elastic bed (Johnson, chapter 4), so
that the point of attack moves by that over ``f_n``, at most to half the radius; and it varies
slightly from load case to load case.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import SchemaError
from elastocal.meshes import load_triangles
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._timeline import generator

LIMIT = 0.999
"""Part of the friction limit that a sliding contact keeps up: its shear is finite."""
_GRAZING = 1e-12
"""A ray less steep to a triangle passes it by (product of its edges and the ray, in m²)."""


_CORRELATED = 0.05
"""Distance within which places of a tooling are alike, in m. An assumption."""
_WAVES = 64
_SOFTEST = 0.3
"""Compliance of a place over the mean, at least."""


@dataclass(frozen=True, eq=False)
class PlaceSpread:
    """Compliances of places over their mean: a smooth random function of the place.

    Source: A. Rahimi, B. Recht, "Random features for large-scale kernel machines", NIPS 2007: a sum
    of waves of random length and phase is a Gaussian process.
    """

    spread: float
    """Standard deviation."""
    waves: FloatArray
    """Wave vectors of both directions, shape (2, wave, 3), in rad/m."""
    phases: FloatArray
    """Shape (2, wave), in rad."""

    @classmethod
    def of(cls, spread: float, seed: int) -> "PlaceSpread | None":
        """Return the spread of a cell; None where all places are alike."""
        if spread == 0.0:
            return None
        rng = generator(seed, "places")
        waves = rng.standard_normal((2, _WAVES, 3)) / _CORRELATED
        return cls(spread, waves, rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES)))

    def at(self, point: FloatArray) -> FloatArray:
        """Return the normal and the lateral compliance over the mean at a point, shape (2,)."""
        summed = np.cos(self.waves @ point + self.phases).sum(axis=1)
        grown: FloatArray = 1.0 + self.spread * np.sqrt(2.0 / _WAVES) * summed
        return np.maximum(grown, _SOFTEST)


@dataclass(frozen=True)
class ContactLaw:
    """Disk, tooling and friction between them."""

    normal_stiffness: float
    """k_n in N/m."""
    shear_stiffness: float
    """k_s in N/m."""
    tooling_stiffness: float
    """k_t in N/m."""
    friction: float
    """mu."""
    micro_slip: float
    """Standard deviation of the random slip along each axis at half the limit, in m."""
    radius: float = 0.0
    """R in m."""
    tilt: float = 0.0
    """Standard deviation of a along each axis, in rad."""
    wander: float = 0.0
    """Standard deviation of the point of attack along each axis, in m."""
    places: "PlaceSpread | None" = None
    """How places differ; None: all are alike."""

    @classmethod
    def of(cls, cell: Cell) -> "ContactLaw":
        """Return the contact of a cell."""
        entry = truth_of(cell).contact
        friction = entry.friction
        return cls(
            entry.normal_stiffness,
            entry.shear_stiffness,
            entry.tooling_stiffness,
            cell.file.load_cases.friction if friction is None else friction,
            entry.micro_slip,
            cell.file.engagement.disk_radius,
            entry.tilt,
            entry.wander,
            PlaceSpread.of(entry.spread, truth_of(cell).seed),
        )

    def at(self, point: FloatArray, disks: int) -> "ContactLaw":
        """Return the law of stacked disks at a point, in base, shape (3,), in m.

        Disks under one force are springs in series.
        """
        softer = np.ones(2) if self.places is None else self.places.at(point)
        normal, lateral = (disks * softer).tolist()
        return replace(
            self,
            normal_stiffness=self.normal_stiffness / normal,
            shear_stiffness=self.shear_stiffness / lateral,
        )

    def attack(self, force_tcp: FloatArray, chance: FloatArray) -> FloatArray | None:
        """Return the offsets of the points of attack in the tcp frame, (..., 3), in m, or None.

        Parameters
        ----------
        force_tcp : ndarray, shape (..., 3)
            On the robot, in the tcp frame, in N.
        chance : ndarray, shape (..., 4)
            Tilt and wander in standard deviations; see `VisitChance.load`.
        """
        if self.tilt == 0.0 and self.wander == 0.0:
            return None
        pressed = np.maximum(np.abs(force_tcp[..., 2:]), 1e-9)
        uneven = (
            0.25 * self.normal_stiffness * self.radius**2 * self.tilt * chance[..., :2] / pressed
        )
        beside = uneven + self.wander * chance[..., 2:]
        size = np.linalg.norm(beside, axis=-1, keepdims=True)
        beside = beside * np.minimum(1.0, 0.5 * self.radius / np.maximum(size, 1e-12))
        return np.concatenate([beside, np.zeros_like(beside[..., :1])], axis=-1)

    def effort(self, force_tcp: FloatArray) -> float:
        """Return the lateral force over the friction limit; above 1 the contact slides.

        Parameters
        ----------
        force_tcp : ndarray, shape (3,)
            Force on the robot in the tcp frame, in N; it presses where z is below 0.
        """
        lateral = float(np.hypot(force_tcp[0], force_tcp[1]))
        if lateral == 0.0:
            return 0.0
        limit = self.friction * -float(force_tcp[2])
        return lateral / limit if limit > 0.0 else np.inf

    def held(self, force_tcp: FloatArray) -> FloatArray:
        """Return the force that friction lets build up, shape (3,), in N."""
        part = min(1.0, LIMIT / max(self.effort(force_tcp), 1e-12))
        held: FloatArray = force_tcp * np.array([part, part, 1.0])
        return held

    def shear(self, force_tcp: FloatArray) -> FloatArray:
        """Return the lateral motion of the tool, tcp frame, shape (3,), in m."""
        effort = self.effort(force_tcp)
        if effort == 0.0:
            return np.zeros(3)
        growth = 1.5 * (1.0 - (1.0 - min(effort, LIMIT)) ** (2.0 / 3.0)) / effort
        shear: FloatArray = -growth / self.shear_stiffness * force_tcp * np.array([1.0, 1.0, 0.0])
        return shear

    def slip_sigma(self, force_tcp: FloatArray) -> float:
        """Return the standard deviation of the random slip, in m."""
        effort = min(self.effort(force_tcp), 0.95)
        return self.micro_slip * effort / (1.0 - effort)


@dataclass(frozen=True, eq=False)
class Contact:
    """The disk on one place of the tooling."""

    law: ContactLaw
    anchor: FloatArray
    """Position of the tool without any force, in base, shape (3,), in m; changes when it slips."""
    R_base_tcp: FloatArray
    """Orientation that the controller keeps, shape (3, 3)."""
    normal: FloatArray
    """Outward normal of the tooling in base, shape (3,)."""
    q_touch: FloatArray
    """Joints at which the tool touches without force, shape (joint,), in rad or m."""
    chance: FloatArray
    """Tilt and wander of the load case, shape (4,); see `ContactLaw.attack`."""

    def attack(self, force_base: FloatArray) -> FloatArray | None:
        """Return the point of the tool where a force in base acts, tcp frame, shape (3,), in m."""
        return self.law.attack(self.R_base_tcp.T @ force_base, self.chance)

    def tool_position(self, force_base: FloatArray) -> FloatArray:
        """Return the tool's position under a force on the robot, in base, shape (3,), in m."""
        force_tcp = self.R_base_tcp.T @ force_base
        sunk = -force_tcp * np.array([0.0, 0.0, 1.0]) / self.law.normal_stiffness
        tooling = -self.normal * (self.normal @ force_base) / self.law.tooling_stiffness
        moved: FloatArray = self.R_base_tcp @ (sunk + self.law.shear(force_tcp)) + tooling
        return self.anchor + moved

    def slipped(self, lateral_tcp: FloatArray) -> "Contact":
        """Return the contact after a slip, tcp frame, shape (2,), in m."""
        return replace(self, anchor=self.anchor + self.R_base_tcp[:, :2] @ lateral_tcp)


@dataclass(frozen=True, eq=False)
class Hit:
    """Intersection of a ray with the surface."""

    distance: float
    """Along the ray, in m."""
    normal: FloatArray
    """Unit normal of the triangle on the side that the ray comes from, shape (3,)."""


@dataclass(frozen=True, eq=False)
class TrueSurface:
    """The tooling at its true position."""

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
        offset = np.array(truth_of(cell).contact.surface_offset)
        corners = cell.file.surface.metres * _triangles(cell.surface_path)
        return cls(corners @ T[:3, :3].T + T[:3, 3] + offset)

    def hit(self, origin: FloatArray, direction: FloatArray, reach: float) -> Hit | None:
        """Return the nearest point of the surface ahead; None if there is none within reach.

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
    triangles: FloatArray = np.asarray(
        getattr(load_triangles(path), "triangles", ()), dtype=np.float64
    )
    if not len(triangles):
        raise SchemaError(f"mesh {path} has no triangle")
    return triangles
