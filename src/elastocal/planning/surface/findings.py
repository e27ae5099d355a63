"""Oddities of a surface, in one line each, before a robot is sent there."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray
from elastocal.meshes import load_triangles, says_inches
from elastocal.planning.surface.contact import contact_frames
from elastocal.planning.surface.sampling import sample_uniform
from elastocal.planning.surface.surface import Surface, SurfacePoints
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, arm_base

_FAR = 5.0
"""A surface whose nearest point is more than this many reaches away is in the wrong unit."""
_HUGE = 50.0
"""So is one whose bounding box is larger than this many reaches: a ship is not."""
_TINY = 0.02
"""So is one whose bounding box is smaller than this part of the reach."""
_LARGEST_TOOL, _LARGEST_FIXTURE, _SMALLEST_SOLID = 1.5, 20.0, 1e-3
"""Sizes of solids over the reach, beyond which they are suspected; fixtures may be a hall."""
_TOO_LARGE = {"mm and read as m": 1e-3, "inches and read as m": 0.0254}
_TOO_SMALL = {"m and read as mm": 1e3, "inches and read as mm": 25.4}
"""Mistakes about a unit, and by what the size is to be multiplied to mend them."""
_POINTS = 200
_SPINS = 4
_CLEARLY = 0.25
"""By how much of the points the other side has to be the better reachable one."""
Reachable = Callable[[FloatArray], BoolArray]
"""Whether the robot reaches poses T_base_tcp, shape (pose, 4, 4), within its limits."""


@dataclass(frozen=True)
class Finding:
    """One thing that a user should know."""

    kind: str
    """``open``, ``non-manifold``, ``winding``, ``degenerate``, ``duplicate``, ``far``, ``huge``,
    ``tiny``, ``inches``, ``inverted``, ``masses`` or ``tilted``."""
    message: str
    """One line."""
    fatal: bool = False
    """Whether planning on this surface cannot lead anywhere."""


def mesh_findings(surface: Surface) -> tuple[Finding, ...]:
    """Return what is odd about the mesh itself. None of it stops the work.

    Parameters
    ----------
    surface : Surface
        The surface.
    """
    odd = (
        ("degenerate", surface.mesh.degenerate, ": {} faces without area were left out"),
        ("duplicate", surface.mesh.duplicate, ": {} faces stood twice and were left out once"),
        (
            "winding",
            surface.turned,
            ": {} faces were wound against their neighbours and were turned",
        ),
        (
            "non-manifold",
            surface.non_manifold_edges,
            " is not a manifold: {} edges have three faces or more, or none that agree; the contact"
            " disk keeps away from them",
        ),
        (
            "open",
            surface.open_edges,
            " is an open mesh with {} edges at its border; the contact disk keeps away from them",
        ),
    )
    return tuple(Finding(kind, surface.name + text.format(n)) for kind, n, text in odd if n)


def placement_findings(
    surface: Surface, first_joints: FloatArray, reach: float, reachable: Reachable, rng: Generator
) -> tuple[Finding, ...]:
    """Return what is odd about where the surface is, seen from the robot.

    Parameters
    ----------
    surface : Surface
        The surface.
    first_joints : ndarray, shape (place, 3)
        Where the arm's first joint can be, in base, in m: one row without a rail.
    reach : float
        Of the arm with its tool, in m; an upper bound will do.
    reachable : callable
        The robot; see `Reachable`.
    rng : Generator
        Seeded source of randomness, for the points that are tried.
    """
    name, vertices = surface.name, surface.mesh.vertices
    gap = np.linalg.norm(vertices[:, None] - first_joints[None], axis=2).min()
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if not gap <= _FAR * reach:
        text = (
            f"{name}: its nearest point is {gap:.3g} m from the robot, whose reach is"
            f" {reach:.3g} m: is the mesh in {_misread(size, reach)} (surface.unit), or its pose"
            " wrong?"
        )
        return (Finding("far", text, fatal=True),)
    if not size <= _HUGE * reach:
        text = (
            f"{name} is {size:.3g} m across; the reach of the robot is {reach:.3g} m: is"
            f" the mesh in {_misread(size, reach)} (surface.unit)?"
        )
        return (Finding("huge", text, fatal=True),)
    return tiny_finding(surface, reach) + inverted_finding(surface, reachable, rng)


def tiny_finding(surface: Surface, reach: float) -> tuple[Finding, ...]:
    """Return a finding when a surface is so small that its unit is doubtful.

    Parameters
    ----------
    surface : Surface
        The surface.
    reach : float
        Of the arm with its tool, in m.
    """
    size = float(np.linalg.norm(np.ptp(surface.mesh.vertices, axis=0)))
    text = (
        f"{surface.name} is only {1e3 * size:.3g} mm across; the reach of the robot is"
        f" {reach:.3g} m: is the mesh in {_misread(size, reach)} (surface.unit)?"
    )
    return (Finding("tiny", text),) if size < _TINY * reach else ()


def _misread(size: float, reach: float) -> str:
    """Return the mistake about the unit that would make a surface as large as the arm reaches."""
    mistakes = _TOO_LARGE if size > reach else _TOO_SMALL
    return min(mistakes, key=lambda words: abs(math.log(mistakes[words] * size / reach)))


def unit_findings(path: Path, unit: str, key: str) -> tuple[Finding, ...]:
    """Return a finding when a mesh file speaks of inches and is read in another unit.

    Parameters
    ----------
    path : Path
        The mesh file.
    unit : str
        What its numbers are read in.
    key : str
        Where the cell file names it.

    Raises
    ------
    FileAccessError
        If it cannot be read.
    """
    if unit == "in" or not says_inches(path):
        return ()
    text = f"{path.name} speaks of inches and is read in {unit}: write {key}.unit: in, if it is so"
    return (Finding("inches", text),)


def size_findings(path: Path, unit: float, key: str, reach: float) -> tuple[Finding, ...]:
    """Return a finding when a solid of the cell is larger or smaller than such a thing can be.

    Parameters
    ----------
    path : Path
        The mesh file.
    unit : float
        Length of one unit of the file, in m.
    key : str
        Where the cell file names it: under ``tool``, or else.
    reach : float
        Of the arm with its tool, in m; an upper bound will do.

    Raises
    ------
    FileAccessError, SchemaError
        If the file cannot be read.
    """
    vertices = np.asarray(load_triangles(path).vertices).reshape(-1, 3)
    size = unit * float(np.linalg.norm(np.ptp(vertices, axis=0))) if len(vertices) else 0.0
    largest = _LARGEST_TOOL if key.startswith("tool") else _LARGEST_FIXTURE
    if not size > 0.0 or _SMALLEST_SOLID * reach <= size <= largest * reach:
        return ()
    text = (
        f"{path.name} is {size:.3g} m across; the reach of the robot is {reach:.3g} m: is the mesh"
        f" in {_misread(size, reach)} ({key}.unit)?"
    )
    return (Finding("tiny" if size < reach else "huge", text),)


def inverted_finding(surface: Surface, reachable: Reachable, rng: Generator) -> tuple[Finding, ...]:
    """Return a finding when the normals point to the side where the robot cannot work.

    A closed mesh tells its outside by the sign of its volume. An open one has no outside: there
    the side counts from which the robot reaches clearly more of 200 points. A mesh that has but
    one side cannot be turned.

    Parameters
    ----------
    surface : Surface
        The surface.
    reachable : callable
        The robot; see `Reachable`.
    rng : Generator
        Seeded source of randomness.
    """
    if not surface.orientable:
        return ()
    offer = "; set surface.flip_normals: true to turn them"
    if surface.closed:
        if surface.signed_volume >= 0.0:
            return ()
        text = f"{surface.name} is closed and inside out: its normals point inwards{offer}"
        return (Finding("inverted", text),)
    points = sample_uniform(surface, _POINTS, rng)
    front, back = (_reached(points, sign, reachable) for sign in (1.0, -1.0))
    if not back - front > _CLEARLY:
        return ()
    text = (
        f"{surface.name}: the normals point away from the robot's side: it reaches"
        f" {front:.0%} of the points along them and {back:.0%} against them{offer}"
    )
    return (Finding("inverted", text),)


def _reached(points: SurfacePoints, sign: float, reachable: Reachable) -> float:
    """Return the share of the points that are reached at any of a few spins."""
    spins = np.linspace(0.0, 2.0 * np.pi, _SPINS, endpoint=False)
    poses = contact_frames(points.position, sign * points.normal, spins)
    return float(reachable(poses.reshape(-1, 4, 4)).reshape(len(points), -1).any(axis=1).mean())


def arm_reach(robot: Robot) -> float:
    """Return a bound in m that the tool centre point never goes beyond.

    The sum of the lengths from the arm's second joint to the tool centre point, and of the first
    joint's from its own origin: the arm stretched out as no limit would let it.

    Parameters
    ----------
    robot : Robot
        The robot with its tool.
    """
    joints = robot.chain.joints[robot.external_axes + 1 :]
    lengths = [float(np.linalg.norm(joint.placement[:3, 3])) for joint in joints]
    return sum(lengths) + float(np.linalg.norm(robot.chain.T_last_tip[:3, 3]))


def first_joint_positions(robot: Robot, external: FloatArray) -> FloatArray:
    """Return where the arm's first joint can be, in base, shape (combination, 3), in m.

    Parameters
    ----------
    robot : Robot
        The robot.
    external : ndarray, shape (combination, external axis)
        Positions of its external axes in rad or m.
    """
    first = robot.chain.joints[robot.external_axes].placement
    return (arm_base(robot, external) @ first)[:, :3, 3]


@brief_repr
@dataclass(frozen=True, eq=False)
class ReachableFrom:
    """Whether a robot reaches poses from any of some positions of its external axes."""

    inverse: InverseKinematics
    external: FloatArray
    """Shape (combination, external axis), in rad or m."""

    def __call__(self, T_base_tcp: FloatArray) -> BoolArray:
        """Return whether each pose is reached within the limits, shape (pose,).

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
            In m.
        """
        reached = np.zeros(len(T_base_tcp), dtype=bool)
        for position in self.external:
            left = np.flatnonzero(~reached)
            if len(left):
                reached[left] = self.inverse.solve_many(T_base_tcp[left], position).reachable
        return reached
