"""Rigid transforms: inverse, and KUKA's notation.

A KUKA pose is x, y, z and the Z-Y'-X'' Euler angles A, B, C with ``R = Rz(A) Ry(B) Rx(C)``, which
is also what URDF calls roll, pitch, yaw = C, B, A.
"""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray

_GIMBAL = 1e-12
"""cos(B) below which A and C turn about the same axis."""


def inverse_transform(T: FloatArray) -> FloatArray:
    """Return the inverse of rigid transforms, shape (..., 4, 4)."""
    inverse = np.zeros_like(T)
    inverse[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, 3] = -np.einsum("...ji,...j->...i", T[..., :3, :3], T[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def nearest_rotation(M: FloatArray) -> FloatArray:
    """Return the rotations nearest to matrices, shape (..., 3, 3): the largest ``tr(R^T M)``.

    With ``M = sum b a^T`` over centred points it is the rotation that brings points ``a`` nearest
    to ``b`` (W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta
    Crystallographica A32, 1976); reflections are excluded.

    Parameters
    ----------
    M : ndarray, shape (..., 3, 3)
        Any matrices.
    """
    u, _, vt = np.linalg.svd(M)
    # The direction that is known least is the one to turn round.
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    rotation: FloatArray = u @ vt
    return rotation


def T_from_xyzabc(
    x: ArrayLike, y: ArrayLike, z: ArrayLike, a: ArrayLike, b: ArrayLike, c: ArrayLike
) -> FloatArray:
    """Return the homogeneous transform of a KUKA pose.

    Parameters
    ----------
    x, y, z : array_like, shape (...)
        Position in m.
    a, b, c : array_like, shape (...)
        Rotation about z, then the new y, then the new x, in rad.

    Returns
    -------
    ndarray, shape (..., 4, 4)
    """
    x, y, z, a, b, c = np.broadcast_arrays(
        *(np.asarray(v, dtype=float) for v in (x, y, z, a, b, c))
    )
    sa, sb, sc = np.sin(a), np.sin(b), np.sin(c)
    ca, cb, cc = np.cos(a), np.cos(b), np.cos(c)
    zero, one = np.zeros_like(a), np.ones_like(a)
    rows = [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc, x],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc, y],
        [-sb, cb * sc, cb * cc, z],
        [zero, zero, zero, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def xyzabc_from_T(T: ArrayLike) -> FloatArray:
    """Return the KUKA pose of a homogeneous transform.

    Parameters
    ----------
    T : array_like, shape (..., 4, 4)
        Transform; translation in m.

    Returns
    -------
    ndarray, shape (..., 6)
        x, y, z in m and a, b, c in rad; a and c in [-pi, pi], b in [-pi/2, pi/2]. Where b is
        ±pi/2 only one combination of a and c means anything; a is 0 there.
    """
    T = np.asarray(T, dtype=float)
    R = T[..., :3, :3]
    cos_b = np.hypot(R[..., 0, 0], R[..., 1, 0])
    a = np.where(cos_b < _GIMBAL, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    b = np.arctan2(-R[..., 2, 0], cos_b)
    # With A turned back, what is left of the second row is (0, cos C, -sin C), near B = ±90° too.
    sa, ca = np.sin(a), np.cos(a)
    sin_c = sa * R[..., 0, 2] - ca * R[..., 1, 2]
    cos_c = ca * R[..., 1, 1] - sa * R[..., 0, 1]
    return np.concatenate(
        [T[..., :3, 3], np.stack([a, b, np.arctan2(sin_c, cos_c)], axis=-1)], axis=-1
    )
