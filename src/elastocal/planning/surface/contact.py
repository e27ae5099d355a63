"""The tool on a surface: its frame in contact, and how its disk lies there (paper 2.2, Fig. 2a)."""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.planning.surface.mesh import SurfaceError
from elastocal.planning.surface.surface import Surface, SurfacePoints
from elastocal.results import brief_repr

_RINGS = ((1.0, 16), (0.5, 8))
"""Radius, as part of the disk's, and number of the probes on each ring."""
_CHUNK = 20_000
"""Points that are probed at once; bounds the memory of a pool of any size."""
_NUDGE = 1e-5
"""Part of the radius by which a ray that slipped between two triangles is moved and cast again."""


def contact_frames(position: FloatArray, normal: FloatArray, spin: FloatArray) -> FloatArray:
    """Return T_base_tcp at points, z into the surface, turned about z by each spin.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        Contact points in base, in m.
    normal : ndarray, shape (point, 3)
        Outward unit normals.
    spin : ndarray, shape (spin,) or (point, spin)
        In rad.

    Returns
    -------
    ndarray, shape (point, spin, 4, 4)
        In m. At spin 0 the x axis lies in the plane of the normal and the base's x axis, or, for
        a normal along x, is arbitrary but always the same.
    """
    z = -normal
    first, second = _tangents(z)
    # Of all directions square to z, the one nearest to base x: so that the spin means something.
    lean = np.arctan2(second[:, 0], first[:, 0])
    turn = lean[:, None] + spin
    cosine, sine = np.cos(turn)[..., None], np.sin(turn)[..., None]
    T = np.zeros((*turn.shape, 4, 4))
    T[..., :3, 0] = cosine * first[:, None] + sine * second[:, None]
    T[..., :3, 1] = cosine * second[:, None] - sine * first[:, None]
    T[..., :3, 2] = z[:, None]
    T[..., :3, 3] = position[:, None]
    T[..., 3, 3] = 1.0
    return T


@brief_repr
@dataclass(frozen=True, eq=False)
class DiskFit:
    """Fit of disks on the surface, from 24 probes each; infinite where a disk overhangs."""

    angle: FloatArray
    """Largest angle between the disk's axis and the surface's normal under it, shape (point,),
    in rad."""
    gap: FloatArray
    """Largest distance along the axis between disk plane and surface, shape (point,), in m."""

    @property
    def supported(self) -> BoolArray:
        """Whether there is surface under all of the disk, shape (point,)."""
        return np.isfinite(self.gap)


def fit_disk(surface: Surface, points: SurfacePoints, radius: float) -> DiskFit:
    """Return the fit of disks centred at points, perpendicular to their normals, on the surface.

    Rays are cast along the disk's axis at 16 points of its rim and 8 half-way in. Where a ray meets
    no surface within one radius before or behind the disk plane, the disk overhangs.

    Parameters
    ----------
    points : SurfacePoints
        Centres of the disks, on that surface.
    radius : float
        Radius of the disk, in m.

    Raises
    ------
    SurfaceError
        If the radius is not positive and finite.
    """
    if not 0.0 < radius < math.inf:
        raise SurfaceError(f"disk radius {radius!r} m: must be positive and finite")
    angle, gap = np.empty(len(points)), np.empty(len(points))
    for start in range(0, len(points), _CHUNK):
        part = slice(start, start + _CHUNK)
        probes = _probes(points.position[part], points.normal[part], radius)
        axis = np.repeat(points.normal[part], probes.shape[1], axis=0)
        height, normal = _under(surface, probes.reshape(-1, 3), axis, radius)
        chord = np.linalg.norm(normal - axis, axis=1)
        turned = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * chord))
        turned = np.where(np.isfinite(height), turned, np.inf)
        angle[part] = turned.reshape(probes.shape[:2]).max(axis=1)
        gap[part] = np.abs(height).reshape(probes.shape[:2]).max(axis=1)
    return DiskFit(angle, gap)


def _probes(position: FloatArray, normal: FloatArray, radius: float) -> FloatArray:
    """Return points in the disk plane, shape (point, probe, 3)."""
    turn = np.concatenate([np.arange(n) * (2.0 * np.pi / n) for _, n in _RINGS])
    length = radius * np.concatenate([np.full(n, share) for share, n in _RINGS])
    first, second = _tangents(normal)
    along, across = (length * np.cos(turn))[:, None], (length * np.sin(turn))[:, None]
    probes: FloatArray = position[:, None] + along * first[:, None] + across * second[:, None]
    return probes


def _under(
    surface: Surface, probes: FloatArray, axis: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return height over the disk plane (infinite where nothing is) and normal of each probe."""
    height = np.full(len(probes), np.inf)
    normal = np.zeros_like(probes)
    missing = np.arange(len(probes))
    for shift in (0.0, _NUDGE * radius):
        origin = probes[missing] + radius * axis[missing] + shift * _tangents(axis[missing])[0]
        face, ray, hit = surface.rays.ray.intersects_id(
            origin, -axis[missing], multiple_hits=False, return_locations=True
        )
        ray = missing[np.asarray(ray, dtype=np.intp)]
        hit = np.asarray(hit, dtype=float).reshape(-1, 3)
        reached = np.einsum("pi,pi->p", hit - probes[ray], axis[ray])
        near = reached >= -radius
        height[ray[near]] = reached[near]
        face = np.asarray(face, dtype=np.intp)[near]
        normal[ray[near]] = surface.normals_at(face, _weights(surface, face, hit[near]))
        missing = np.setdiff1d(missing, ray[near])
        if not len(missing):
            break
    return height, normal


def _weights(surface: Surface, face: np.ndarray, position: FloatArray) -> FloatArray:
    """Return the barycentric weights of points in their faces, shape (point, 3)."""
    a, b, c = np.moveaxis(surface.mesh.vertices[surface.mesh.faces[face]], 1, 0)
    normal = surface.face_normals[face]
    doubled = 2.0 * surface.face_areas[face]
    to_point = position - a
    of_b = np.einsum("pi,pi->p", np.cross(to_point, c - a), normal) / doubled
    of_c = np.einsum("pi,pi->p", np.cross(b - a, to_point), normal) / doubled
    weights = np.stack([1.0 - of_b - of_c, of_b, of_c], axis=1).clip(0.0)
    result: FloatArray = weights / weights.sum(axis=1, keepdims=True)
    return result


def _tangents(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors square to each normal and to each other, shape (point, 3) each.

    Source: T. Duff et al., "Building an orthonormal basis, revisited", Journal of Computer
    Graphics Techniques 6(1), 2017; without the singularity that a cross product has.
    """
    x, y, z = normal.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return first, np.stack([b, sign + y * y * a, -y], axis=1)
