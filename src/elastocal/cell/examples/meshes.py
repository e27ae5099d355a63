"""The toolings of the example cells, made by code: always the same bytes."""

import numpy as np

from elastocal.arrays import FloatArray, IndexArray

DOME_RADII = (2.4, 1.5)
"""Radius and height in m of the ellipsoid of revolution that a rear pressure dome resembles."""
DOME_POLAR = (0.366, 0.934)
"""From where to where the section reaches along the meridian, as ellipse parameter in rad."""
DOME_AZIMUTH = np.pi / 8.0
"""Half the angle that the section spans about the dome's axis, in rad (one of eight)."""
DOME_CELLS = 32
BLOCK_SIZE = (0.6, 0.4, 0.3)
"""Edge lengths of the block of raw material along x, y, z in m."""

_STL_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def dome_section() -> FloatArray:
    """Return the triangles of one of eight sections of a dome, open at its border.

    The frame lies at the section's middle, z along the outward normal there, x down the
    meridian.

    Returns
    -------
    ndarray, shape (face, 3, 3)
        Corners, counter-clockwise as seen from outside, in m.
    """
    polar = np.linspace(*DOME_POLAR, DOME_CELLS + 1)
    azimuth = np.linspace(-DOME_AZIMUTH, DOME_AZIMUTH, DOME_CELLS + 1)
    t, a = np.meshgrid(polar, azimuth, indexing="ij")
    points = _on_dome(t, a)
    T = _dome_frame()
    own = (points.reshape(-1, 3) - T[:3, 3]) @ T[:3, :3]
    return own[_grid_faces(DOME_CELLS + 1)]


def block() -> FloatArray:
    """Return the triangles of a block that stands on z = 0, centred on x = y = 0.

    Returns
    -------
    ndarray, shape (12, 3, 3)
        Corners, counter-clockwise as seen from outside, in m.
    """
    x, y, z = BLOCK_SIZE
    triangles = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            quad = np.zeros((4, 3))
            quad[:, axis] = side
            quad[:, (axis + 1) % 3] = (-1.0, 1.0, 1.0, -1.0)
            quad[:, (axis + 2) % 3] = (-side, -side, side, side)
            triangles += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    corners: FloatArray = 0.5 * np.array(triangles) * (x, y, z) + (0.0, 0.0, 0.5 * z)
    return corners


def binary_stl(triangles: FloatArray) -> bytes:
    """Return triangles as a binary STL in mm, the unit that CAD systems write.

    Parameters
    ----------
    triangles : ndarray, shape (face, 3, 3)
        Corners in m.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    faces = np.zeros(len(triangles), _STL_FACE)
    faces["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    faces["corners"] = 1e3 * triangles
    header = b"made by elastocal init; unit mm".ljust(80)
    return header + len(faces).to_bytes(4, "little") + faces.tobytes()


def _on_dome(t: FloatArray, a: FloatArray) -> FloatArray:
    """Return points of the ellipsoid at ellipse parameter t and azimuth a, shape (..., 3)."""
    radius, height = DOME_RADII
    ring = radius * np.sin(t)
    return np.stack([ring * np.cos(a), ring * np.sin(a), height * np.cos(t)], axis=-1)


def _dome_frame() -> FloatArray:
    """Return the section's frame in the dome's: z out of the middle, x down the meridian."""
    t = np.array(0.5 * sum(DOME_POLAR))
    radius, height = DOME_RADII
    down = np.array([radius * np.cos(t), 0.0, -height * np.sin(t)])
    x, y = down / np.linalg.norm(down), np.array([0.0, 1.0, 0.0])
    T = np.eye(4)
    T[:3, :3] = np.stack([x, y, np.cross(x, y)], axis=1)
    T[:3, 3] = _on_dome(t, np.array(0.0))
    return T


def _grid_faces(n: int) -> IndexArray:
    """Return the two triangles of every cell of an n by n grid of vertices."""
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    halves = [np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]
    return np.concatenate([half.reshape(-1, 3) for half in halves])
