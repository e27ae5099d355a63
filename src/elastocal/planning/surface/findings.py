"""Oddities of a surface, in one line each, before a robot is sent there."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.meshes import load_triangles, says_inches
from elastocal.planning.surface.contact import contact_frames
from elastocal.planning.surface.sampling import sample_uniform
from elastocal.planning.surface.surface import Surface, SurfacePoints
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import InverseKinematics, arm_base
from elastocal.wording import phrase

_FAR = 5.0
"""A surface whose nearest point is more than this many reaches away is in the wrong unit."""
_HUGE = 50.0
"""So is one whose bounding box is larger than this many reaches: a ship is not."""
_TINY = 0.02
"""So is one whose bounding box is smaller than this part of the reach."""
_LARGEST_TOOL, _LARGEST_FIXTURE, _SMALLEST_SOLID = 1.5, 20.0, 1e-3
"""Sizes of solids over the reach, beyond which they are suspected; fixtures may be a hall."""
_TOO_LARGE = {phrase("mm and read as m"): 1e-3, phrase("inches and read as m"): 0.0254}
_TOO_SMALL = {phrase("m and read as mm"): 1e3, phrase("inches and read as mm"): 25.4}
"""Mistakes about a unit, and by what the size is to be multiplied to mend them."""
_POINTS = 200
_SPINS = 4
_CLEARLY = 0.25
"""Share of the points by which the other side must be better reachable."""
Reachable = Callable[[FloatArray], BoolArray]
"""Whether the robot reaches poses T_base_tcp, shape (pose, 4, 4), within its limits."""


DEGENERATE = Kind("surface.degenerate", "{name}: {count} faces without area were left out")
DUPLICATE = Kind("surface.duplicate", "{name}: {count} faces stood twice and were left out once")
WINDING = Kind(
    "surface.winding", "{name}: {count} faces were wound against their neighbours and were turned"
)
NON_MANIFOLD = Kind(
    "surface.non-manifold",
    "{name} is not a manifold: {count} edges have three faces or more, or none that"
    " agree; the contact disk keeps away from them",
)
OPEN = Kind(
    "surface.open",
    "{name} is an open mesh with {count} edges at its border; the contact disk keeps"
    " away from them",
)
FAR = Kind(
    "surface.far",
    "{name}: its nearest point is {gap} m from the robot, whose reach is {reach} m: is the"
    " mesh in {unit} (surface.unit), or its pose wrong?",
    grade=Grade.REFUSAL,
    shown=dict.fromkeys(("gap", "reach"), as_number(".3g")),
)
OUT_OF_REACH = Kind(
    "surface.out-of-reach",
    "{name}: no part of it is within reach: it lies {gap} m from the shoulder of the robot, whose"
    " reach is {reach} m (surface.pose)",
    shown=dict.fromkeys(("gap", "reach"), as_number(".3g")),
)
HUGE = Kind(
    "surface.huge",
    "{name} is {size} m across; the reach of the robot is {reach} m: is the mesh in {unit}"
    " (surface.unit)?",
    grade=Grade.REFUSAL,
    shown=dict.fromkeys(("size", "reach"), as_number(".3g")),
)
TINY = Kind(
    "surface.tiny",
    "{name} is only {size} mm across; the reach of the robot is {reach} m: is the mesh in"
    " {unit} (surface.unit)?",
    shown={"size": as_number(".3g", 1e3), "reach": as_number(".3g")},
)
INCHES = Kind(
    "surface.inches",
    "{name} speaks of inches and is read in {unit}: write {key}.unit: in, if it is so",
)
SOLID_TINY = Kind(
    "solid.tiny",
    "{name} is {size} m across; the reach of the robot is {reach} m: is the mesh in {unit}"
    " ({key}.unit)?",
    shown=dict.fromkeys(("size", "reach"), as_number(".3g")),
)
SOLID_HUGE = replace(SOLID_TINY, name="solid.huge")
INSIDE_OUT = Kind(
    "surface.inside-out",
    "{name} is closed and inside out: its normals point inwards; set surface.flip_normals:"
    " true to turn them",
)
INVERTED = Kind(
    "surface.inverted",
    "{name}: the normals point away from the robot's side: it reaches {front} of the points"
    " along them and {back} against them; set surface.flip_normals: true to turn them, or turn z of"
    " the tcp (tcp.abc) if it points into the tool",
    shown=dict.fromkeys(("front", "back"), as_number(".0%")),
)
OF_WRONG_MESHES = frozenset(
    kind.name for kind in (TINY, SOLID_TINY, INCHES, INSIDE_OUT, INVERTED, OUT_OF_REACH)
)
"""Kinds that may be why no pose is found."""


def mesh_findings(surface: Surface) -> tuple[Finding, ...]:
    """Return the oddities of the mesh itself. None of them stops the work."""
    mesh = surface.mesh
    odd = (
        (DEGENERATE, mesh.degenerate),
        (DUPLICATE, mesh.duplicate),
        (WINDING, surface.turned),
        (NON_MANIFOLD, surface.non_manifold_edges),
        (OPEN, surface.open_edges),
    )
    return tuple(kind(name=surface.name, count=int(count)) for kind, count in odd if count)


def placement_findings(
    surface: Surface, first_joints: FloatArray, reach: float, reachable: Reachable, rng: Generator
) -> tuple[Finding, ...]:
    """Return the oddities of the surface's place, seen from the robot.

    Parameters
    ----------
    first_joints : ndarray, shape (place, 3)
        Where the arm's first joint can be, in base, in m: one row without a rail.
    reach : float
        Reach of the arm with its tool, in m; an upper bound will do.
    reachable : callable
        The robot; see `Reachable`.
    rng : Generator
        Seeded source of randomness, for the points that are tried.
    """
    name, vertices = surface.name, surface.mesh.vertices
    gap = float(np.linalg.norm(vertices[:, None] - first_joints[None], axis=2).min())
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if not gap <= _FAR * reach:
        return (FAR(name=name, gap=gap, reach=reach, unit=_misread(size, reach)),)
    if not size <= _HUGE * reach:
        return (HUGE(name=name, size=size, reach=reach, unit=_misread(size, reach)),)
    found = tiny_finding(surface, reach) + inverted_finding(surface, reachable, rng)
    # No face is nearer than the box around all of them.
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    outside = np.maximum(np.maximum(low - first_joints, first_joints - high), 0.0)
    gap = float(np.linalg.norm(outside, axis=1).min())
    if gap > reach:
        found += (OUT_OF_REACH(name=name, gap=gap, reach=reach),)
    return found


def tiny_finding(surface: Surface, reach: float) -> tuple[Finding, ...]:
    """Return a finding if a surface is so small that its unit is doubtful.

    Parameters
    ----------
    reach : float
        Reach of the arm with its tool, in m.
    """
    size = float(np.linalg.norm(np.ptp(surface.mesh.vertices, axis=0)))
    if not size < _TINY * reach:
        return ()
    return (TINY(name=surface.name, size=size, reach=reach, unit=_misread(size, reach)),)


def _misread(size: float, reach: float) -> str:
    """Return the mistake about the unit that would make a surface as large as the arm reaches."""
    mistakes = _TOO_LARGE if size > reach else _TOO_SMALL
    return min(mistakes, key=lambda words: abs(math.log(mistakes[words] * size / reach)))


def unit_findings(path: Path, unit: str, key: str) -> tuple[Finding, ...]:
    """Return a finding if a mesh file mentions inches and is read in another unit.

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
    return (INCHES(name=path.name, unit=unit, key=key),)


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
        Reach of the arm with its tool, in m; an upper bound will do.

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
    kind, mistake = SOLID_TINY if size < reach else SOLID_HUGE, _misread(size, reach)
    return (kind(name=path.name, size=size, reach=reach, unit=mistake, key=key),)


def inverted_finding(surface: Surface, reachable: Reachable, rng: Generator) -> tuple[Finding, ...]:
    """Return a finding if the normals point to the side where the robot cannot work.

    The sign of the volume of a closed mesh shows its outside. An open one has no outside: the side
    counts from which the robot reaches clearly more of 200 points. A mesh with one side only (a
    Möbius strip) cannot be turned.

    Parameters
    ----------
    reachable : callable
        The robot; see `Reachable`.
    rng : Generator
        Seeded source of randomness.
    """
    if not surface.orientable:
        return ()
    if surface.closed:
        return () if surface.signed_volume >= 0.0 else (INSIDE_OUT(name=surface.name),)
    points = sample_uniform(surface, _POINTS, rng)
    front, back = (_reached(points, sign, reachable) for sign in (1.0, -1.0))
    if not back - front > _CLEARLY:
        return ()
    return (INVERTED(name=surface.name, front=front, back=back),)


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
                reached[left] = self.inverse.reachable(T_base_tcp[left], position)
        return reached
