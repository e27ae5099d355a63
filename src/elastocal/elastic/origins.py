"""Where the virtual springs of a joint sit: its Hartenberg-Denavit origin (paper Eq. 2).

The origin of a joint is where the common normal with the axis before it meets its own axis (J.
Angeles, *Fundamentals of Robotic Mechanical Systems*, 2014, section 4.2). It belongs to the two
axes, not to the frame that somebody drew: sliding a URDF's joint frame along its own axis, or
turning it about it, moves nothing. Special cases:

* parallel axes have many common normals: the one through the previous origin counts. Axes are
  taken as parallel up to `PARALLEL`, beyond which a calibrated arm's nearly parallel axes would
  meet kilometres away;
* the first axis has none before it: the foot of the base's origin on it, and the base's axes;
* a prismatic joint has a direction and no place: the axes on its two sides are neighbours, at
  the position zero of the joint.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.elastic.springs import AXES, as_axis, coordinate_axis
from elastocal.results import brief_repr
from elastocal.robot import SerialChain

PARALLEL = 1e-2
"""Angle in rad below which two axes count as parallel."""
_SHORTEST_LINK = 1e-2
"""Distance in m below which two origins have no link between them."""
_SAME_AXIS = 1e-6
"""Distance in m below which two parallel axes count as one line."""

_Triple = tuple[float, float, float]


@brief_repr
@dataclass(frozen=True)
class JointOrigin:
    """Origin of a joint and the directions of its virtual springs, in the joint's frame."""

    offset: _Triple
    """The origin in the joint's proximal frame, in m."""
    far: _Triple
    """Where the common normal with the next axis, or for the last joint the one through the tip,
    meets the axis, likewise; the origin again where axes are parallel."""
    directions: dict[str, _Triple]
    """Unit vectors orthogonal to the joint axis by name: the common normal, and the direction
    orthogonal to it. Named after the frame's coordinate axes where they are those, else
    ``normal`` and ``binormal``."""


@brief_repr
@dataclass(frozen=True)
class LinkMiddle:
    """The middle of the link behind a joint, in the joint's frame behind its motion."""

    joint: str
    """Name of the joint in front of the link."""
    middle: _Triple
    """Half-way to the next joint's origin, in m."""
    directions: dict[str, _Triple]
    """Unit vectors orthogonal to the link by name, as those of `JointOrigin`."""


def joint_origins(chain: SerialChain) -> tuple[JointOrigin, ...]:
    """Return the Hartenberg-Denavit origin of every joint of a chain."""
    return tuple(_origins(chain))


def link_middles(chain: SerialChain) -> tuple[LinkMiddle, ...]:
    """Return the middle of every link between two joints of a chain that has a length.

    A link runs from one Hartenberg-Denavit origin to the next, so that neither its middle nor its
    directions depend on how joints are drawn: one is the part of the axis in front of it that is
    orthogonal to it, or of the axis behind where the first runs along it.
    """
    return tuple(_middles(chain))


def _middles(chain: SerialChain) -> Iterator[LinkMiddle]:
    frames, axes, _ = _at_zero(chain)
    origins = [
        T[:3, :3] @ np.array(origin.offset) + T[:3, 3]
        for T, origin in zip(frames, joint_origins(chain), strict=True)
    ]
    for k, (start, end) in enumerate(pairwise(origins)):
        length = float(np.linalg.norm(end - start))
        if length < _SHORTEST_LINK:
            continue
        along = (end - start) / length
        across = [axis - along * float(axis @ along) for axis in axes[k : k + 2]]
        first = next((n for n in across if np.linalg.norm(n) > PARALLEL), _transverse(along))
        first = first / np.linalg.norm(first)
        R, drawn = frames[k][:3, :3], frames[k][:3, 3]
        yield LinkMiddle(
            chain.joints[k].name,
            _triple(R.T @ (0.5 * (start + end) - drawn)),
            _named(R.T @ first, R.T @ np.cross(along, first)),
        )


def _at_zero(chain: SerialChain) -> tuple[list[FloatArray], list[FloatArray], FloatArray]:
    """Return frames and axes of the joints and the tip in base, at positions zero."""
    frames = list(accumulate((joint.placement for joint in chain.joints), np.matmul))
    axes = [T[:3, :3] @ joint.axis for T, joint in zip(frames, chain.joints, strict=True)]
    return frames, axes, (frames[-1] @ chain.T_last_tip)[:3, 3]


def _origins(chain: SerialChain) -> Iterator[JointOrigin]:
    frames, axes, tip = _at_zero(chain)
    before: tuple[FloatArray, FloatArray] | None = None
    for k, (joint, T_base_joint, axis) in enumerate(zip(chain.joints, frames, axes, strict=True)):
        R, drawn = T_base_joint[:3, :3], T_base_joint[:3, 3]
        origin, normal = _meeting(axis, drawn, before)
        far = _foot(tip, axis, drawn)
        if k + 1 < len(axes):
            crossing = float(np.linalg.norm(np.cross(axis, axes[k + 1]))) > PARALLEL
            following = axes[k + 1], frames[k + 1][:3, 3]
            far = _meeting(axis, drawn, following)[0] if crossing else origin
        yield JointOrigin(
            _triple(R.T @ (origin - drawn)),
            _triple(R.T @ (far - drawn)),
            _named(R.T @ normal, R.T @ np.cross(axis, normal)),
        )
        if joint.revolute:
            before = axis, origin


def _meeting(
    axis: FloatArray, point: FloatArray, before: tuple[FloatArray, FloatArray] | None
) -> tuple[FloatArray, FloatArray]:
    """Return the origin on an axis through a point, and the unit normal there, in base."""
    if before is None:
        return _foot(np.zeros(3), axis, point), _transverse(axis)
    previous, start = before
    across = np.cross(previous, axis)
    sine = float(np.linalg.norm(across))
    if sine > PARALLEL:
        # Where the plane of the previous axis and the common normal cuts the axis.
        off_plane = np.cross(previous, across)
        travel = float(off_plane @ (point - start)) / float(off_plane @ axis)
        return point - travel * axis, across / sine
    origin = _foot(start, axis, point)
    normal = origin - start
    distance = float(np.linalg.norm(normal))
    return origin, normal / distance if distance > _SAME_AXIS else _transverse(axis)


def _foot(of: FloatArray, axis: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point of a line that is nearest to a point."""
    return np.asarray(point + axis * float(axis @ (of - point)))


def _transverse(axis: FloatArray) -> FloatArray:
    """Return the base's coordinate axis least aligned with an axis, made orthogonal to it."""
    least = np.eye(3)[int(np.argmin(np.round(np.abs(axis), 9)))]
    normal = least - axis * float(axis @ least)
    return np.asarray(normal / np.linalg.norm(normal))


def _named(normal: FloatArray, binormal: FloatArray) -> dict[str, _Triple]:
    """Return two directions by name, coordinate axes in their order and positive."""
    found: list[tuple[str, ArrayLike]] = []
    for name, direction in (("normal", normal), ("binormal", binormal)):
        along = coordinate_axis(direction)
        found.append((name, direction) if along is None else (along, AXES[along]))
    pairs = sorted(found, key=lambda pair: pair[0]) if found[0][0] in AXES else found
    return {name: as_axis(direction) for name, direction in pairs}


def _triple(vector: FloatArray) -> _Triple:
    # A picometre is a rounding, and a zero has no sign.
    x, y, z = (float(round(value, 12)) + 0.0 for value in vector)
    return x, y, z
