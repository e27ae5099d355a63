"""Springs: where a robot is soft.

A spring is a virtual joint about (or along) an axis of a joint's frame. Revolute springs have
compliances in rad/(N·m), prismatic ones in m/N.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import SpringError, nearest
from elastocal.robot import ChainJoint

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_ALIGNED = 1.0 - 1e-9
"""Cosine above which a joint axis counts as a coordinate axis."""

_UNIT = 1e-9
"""Largest error of the length of a unit vector."""


@dataclass(frozen=True)
class Spring:
    """One elastic degree of freedom of a robot."""

    name: str
    """Unique name, ``<joint>.<axis>``, e.g. ``joint_a2.axial`` or ``joint_a2.x``."""
    joint: str
    """Name of the joint in whose frame the spring sits."""
    axis: tuple[float, float, float]
    """Unit vector in the joint frame."""
    revolute: bool = True
    """True for a torsional spring, False for a linear one."""
    distal: bool = False
    """False: in the joint's proximal frame, before its motion (the bearing housing; Angeles'
    Hartenberg-Denavit convention, used by the paper). True: behind its motion."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of that frame that the axis passes through, in m."""

    @property
    def kind(self) -> str:
        """``revolute`` or ``prismatic``."""
        return "revolute" if self.revolute else "prismatic"

    @property
    def unit(self) -> str:
        """SI unit of the spring's compliance."""
        return "rad/(N*m)" if self.revolute else "m/N"


def axial(joint: ChainJoint) -> Spring:
    """Return the spring about (or along) a joint's own axis: gear, servo, belt."""
    return Spring(f"{joint.name}.axial", joint.name, as_axis(joint.axis), joint.revolute)


def is_axial(spring: Spring, joint: ChainJoint) -> bool:
    """Return whether a spring acts along its joint's own motion."""
    return (
        spring.revolute == joint.revolute
        and spring.offset == (0.0, 0.0, 0.0)
        and bool(np.array_equal(np.asarray(spring.axis), joint.axis))
    )


def orthogonal_axes(axis: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Return the two named axes of the virtual springs of a joint with this axis.

    They are the coordinate axes orthogonal to the joint axis. For an axis that is not a
    coordinate axis: the two coordinate axes least aligned with it, made orthonormal to it
    (Gram-Schmidt, the least aligned first) and still named after them.

    >>> orthogonal_axes([0, 1, 0])
    {'x': (1.0, 0.0, 0.0), 'z': (0.0, 0.0, 1.0)}
    """
    unit = np.asarray(as_axis(axis))
    alignment = np.abs(unit)
    if alignment.max() >= _ALIGNED:
        along = int(alignment.argmax())
        return {name: AXES[name] for index, name in enumerate(AXES) if index != along}
    first, second = np.argsort(alignment, kind="stable")[:2]
    names = list(AXES)
    made: dict[str, tuple[float, float, float]] = {}
    basis = [unit]
    for index in (first, second):
        vector = np.asarray(AXES[names[index]])
        for other in basis:
            vector = vector - (vector @ other) * other
        basis.append(vector / np.linalg.norm(vector))
        made[names[index]] = as_axis(basis[-1])
    return dict(sorted(made.items()))


def as_axis(vector: ArrayLike) -> tuple[float, float, float]:
    """Return a vector as a unit axis.

    Raises
    ------
    SpringError
        If it is not three finite numbers, or zero.
    """
    array = np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(array)) if array.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise SpringError(f"axis {vector!r} must be three finite numbers that are not all zero")
    unit: FloatArray = array / length
    return float(unit[0]), float(unit[1]), float(unit[2])


def check_springs(springs: Sequence[Spring], joint_names: Sequence[str]) -> None:
    """Refuse a list of springs that does not fit a robot.

    Raises
    ------
    SpringError
        If the list is empty, a name occurs twice, a joint is not the robot's, or an axis is no
        unit vector.
    """
    if not springs:
        raise SpringError("a model needs at least one spring")
    names = [spring.name for spring in springs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SpringError(f"spring {twice[0]!r} is listed twice")
    for spring in springs:
        if spring.joint not in joint_names:
            raise SpringError(
                f"spring {spring.name!r} sits at joint {spring.joint!r}, which the robot does not"
                f" have{nearest(spring.joint, joint_names)} (joints: {', '.join(joint_names)})"
            )
        if not abs(float(np.linalg.norm(spring.axis)) - 1.0) < _UNIT:
            raise SpringError(f"axis of spring {spring.name!r} is {spring.axis}, not a unit vector")
        if not np.all(np.isfinite(spring.offset)):
            raise SpringError(f"offset of spring {spring.name!r} is {spring.offset}, not finite")
