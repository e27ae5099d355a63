"""Frames of the tool where it presses on a surface."""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.surface.flatness import tangents
from elastocal.planning.surface.surface import SurfacePoints


def contact_poses(points: SurfacePoints, spin: FloatArray) -> FloatArray:
    """Return T_base_tcp at sampled points; see `contact_frames`."""
    return contact_frames(points.position, points.normal, spin)


def contact_frames(position: FloatArray, normal: FloatArray, spin: FloatArray) -> FloatArray:
    """Return T_base_tcp at points, z into the surface, turned about z by each spin.

    Parameters
    ----------
    position : ndarray, shape (point, 3)
        Contact points in base, in m.
    normal : ndarray, shape (point, 3)
        Outward unit normals.
    spin : ndarray, shape (spin,)
        In rad.

    Returns
    -------
    ndarray, shape (point, spin, 4, 4)
        In m. At spin 0 the x axis lies in the plane of the normal and the base's x axis, or, for
        a normal along x, is arbitrary but always the same.
    """
    z = -normal
    first, second = tangents(z)
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
