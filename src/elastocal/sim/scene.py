"""Calibration poses on a simple dome and the five load cases, without a planner.

For tests and demonstrations: poses are spread evenly over a spherical cap, with the free spin
about the tool axis drawn at random, and the inverse kinematics is the simulator's own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.errors import UnreachableError
from elastocal.sim.linkage import Linkage
from elastocal.sim.reach import reach
from elastocal.sim.screws import FloatArray

LOAD_CASES = ("normal", "north", "south", "east", "west")
"""The load cases of paper section 4.1."""

START = (0.0, -1.75, 1.9, 0.0, 1.0, 0.0)
"""Elbow-up posture above the dome of a KUKA-like arm (zero: stretched forward), in rad."""

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
_ATTEMPTS = 40


@dataclass(frozen=True)
class SphericalCap:
    """A dome to press on. The default stands in front of a 2.7 m arm and leans towards it."""

    apex: tuple[float, float, float] = (1.6, 0.0, 0.75)
    """Middle of the dome in base, in m."""
    normal: tuple[float, float, float] = (-0.3, 0.0, 1.0)
    """Outward direction at the apex, in base; any length."""
    radius: float = 1.6
    """Radius of curvature, in m."""
    width: float = 1.2
    """Diameter of the rim, in m."""

    def spread(self, count: int, phase: float) -> tuple[FloatArray, FloatArray]:
        """Return points spread evenly over the cap by Vogel's sunflower, with their normals.

        Vogel, "A better way to construct the sunflower head", Mathematical Biosciences 44 (1979).

        Parameters
        ----------
        count : int
            Number of points.
        phase : float
            Turns the pattern about the apex, in rad.

        Returns
        -------
        points, normals : ndarray, shape (count, 3)
            In base, in m; outward unit vectors.
        """
        index = np.arange(count)
        away = 0.5 * self.width * np.sqrt((index + 0.5) / count)
        turn = phase + index * _GOLDEN_ANGLE
        out = np.sqrt(self.radius**2 - away**2)
        local = np.stack([away * np.cos(turn), away * np.sin(turn), out], axis=1) / self.radius
        normals = local @ _frame_along(np.array(self.normal)).T
        apex_normal = np.array(self.normal) / np.linalg.norm(self.normal)
        return np.array(self.apex) + self.radius * (normals - apex_normal), normals


@dataclass(frozen=True)
class PressPoses:
    """Poses at which the tool touches the surface."""

    joints: FloatArray
    """Shape (pose, joint), in rad or m."""
    T_base_tcp: FloatArray
    """TCP frames with z into the surface, shape (pose, 4, 4)."""


def press_poses(
    linkage: Linkage,
    count: int,
    rng: np.random.Generator,
    surface: SphericalCap | None = None,
    start: ArrayLike = START,
    spin: float = np.pi,
) -> PressPoses:
    """Return poses spread over a surface, the tool pressing along its normals.

    Parameters
    ----------
    linkage : Linkage
        The arm; its tip is the TCP, z out of the tool.
    count : int
        Number of poses.
    rng : numpy.random.Generator
        Turns the pattern and spins the tool.
    surface : SphericalCap, optional
        What to press on.
    start : array_like, shape (joint,)
        Posture near which solutions are sought, in rad or m.
    spin : float
        The tool is turned about its axis by up to this angle either way, in rad.

    Raises
    ------
    UnreachableError
        If a point cannot be reached within the joint limits at any of the spins tried.
    """
    surface = SphericalCap() if surface is None else surface
    points, normals = surface.spread(count, float(rng.uniform(0.0, 2.0 * np.pi)))
    frames = np.array([_frame_along(-normal) for normal in normals])
    start = np.broadcast_to(np.asarray(start, dtype=float), (count, len(linkage.joint_names)))
    goals = np.tile(np.eye(4), (count, 1, 1))
    goals[:, :3, 3] = points
    joints = np.full(start.shape, np.nan)
    for _ in range(_ATTEMPTS):
        open_poses = np.flatnonzero(np.isnan(joints[:, 0]))
        if not len(open_poses):
            return PressPoses(joints, goals)
        turn = _about_z(rng.uniform(-spin, spin, len(open_poses)))
        goals[open_poses, :3, :3] = frames[open_poses] @ turn
        found = reach(linkage, goals[open_poses], start[open_poses])
        inside = np.all((found.q >= linkage.lower) & (found.q <= linkage.upper), axis=1)
        usable = found.ok & inside
        joints[open_poses[usable]] = found.q[usable]
    missing = np.flatnonzero(np.isnan(joints[:, 0]))
    if not len(missing):
        return PressPoses(joints, goals)
    where = ", ".join(f"{value:.3f}" for value in points[missing[0]])
    raise UnreachableError(
        f"{linkage.name} cannot press at ({where}) m within its joint limits: none of {_ATTEMPTS}"
        f" spins is reached, and so for {len(missing)} of {count} points"
    )


def press_forces(
    T_base_tcp: FloatArray, fx: float = 280.0, fy: float = 280.0, fz: float = 1100.0
) -> FloatArray:
    """Return the forces on the robot of the five load cases (paper section 4.1, Fig. 8).

    In the tcp frame: (0, 0, -fz), (+fx, 0, -fz), (-fx, 0, -fz), (0, -fy, -fz), (0, +fy, -fz).

    Parameters
    ----------
    T_base_tcp : ndarray, shape (pose, 4, 4)
        TCP frames.
    fx, fy, fz : float
        Magnitudes in N.

    Returns
    -------
    ndarray, shape (pose, load_case, 3)
        In base, in N, in the order of `LOAD_CASES`.
    """
    lateral = np.array([[0, 0], [fx, 0], [-fx, 0], [0, -fy], [0, fy]], dtype=float)
    force_tcp = np.column_stack([lateral, np.full(len(lateral), -fz)])
    forces: FloatArray = np.einsum("pij,lj->pli", T_base_tcp[:, :3, :3], force_tcp)
    return forces


def _frame_along(direction: FloatArray) -> FloatArray:
    """Return a rotation whose z is a direction and whose x is nearest to base x (or z)."""
    z = direction / np.linalg.norm(direction)
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    x = helper - z * (z @ helper)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _about_z(angles: FloatArray) -> FloatArray:
    turn = np.tile(np.eye(3), (len(angles), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angles)
    turn[:, 1, 0] = np.sin(angles)
    turn[:, 0, 1] = -turn[:, 1, 0]
    return turn
