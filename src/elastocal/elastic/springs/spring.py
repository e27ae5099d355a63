"""A spring: its place in the chain, its parameters, its law and the law's tangent."""

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields
from typing import ClassVar, Generic

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, triple
from elastocal.elastic.springs.expression import Quantity
from elastocal.errors import SpringError, nearest, present
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import ChainJoint
from elastocal.units import dimension_of, impossible

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Axes of a joint's frame by the words that spring files have for them."""
_UNIT_LENGTH = 1e-9
"""Largest error of the length of a unit vector."""
_ALIGNED = 1.0 - 1e-9
"""Cosine from which a direction counts as a coordinate axis."""


@dataclass(frozen=True)
class Unit:
    """Unit of a parameter, in files and in tables."""

    si: str
    """Spelling in files, e.g. ``rad/(N*m)``."""
    shown: str
    """Spelling in tables and figures, e.g. ``µrad/(N·m)``."""
    factor: float = 1.0
    """Factor from SI to `shown`."""
    stiffness: str = ""
    """Unit of one over a shown value, e.g. ``MN·m/rad``; empty where that is no stiffness."""


@dataclass(frozen=True)
class Parameter:
    """One coefficient of a spring; the deflection is linear in it."""

    name: str
    """Unique in a model: the spring's name where the spring has one parameter."""
    joint: str
    """Name of the joint that the spring sits at."""
    unit: Unit
    scale: float
    """A sensible size, in SI: what makes parameters of different units comparable."""
    lower: float = 0.0
    """Smallest value that makes sense, in SI."""


def require_possible(parameters: Sequence[Parameter], rows: FloatArray, what: str) -> None:
    """Refuse coefficients that no arm's spring has, by the limits of `elastocal.units.impossible`.

    Parameters
    ----------
    parameters : sequence of Parameter
        Parameters of all springs.
    rows : ndarray, shape (row, parameter)
        Their values, in SI.
    what : str
        What a row is, e.g. ``"compliance"``.

    Raises
    ------
    SpringError
        With the first that is none.
    """
    for parameter, low, high in zip(parameters, rows.min(axis=0), rows.max(axis=0), strict=True):
        dimension = present(dimension_of(f"1 {parameter.unit.si}"), "dimension of a spring")
        problem = impossible(dimension, float(low), float(high))
        if problem is not None:
            raise SpringError(f"{what} of spring {parameter.name} is {problem}")


@brief_repr
@dataclass(frozen=True)
class Characteristic:
    """Figure of a spring, as in a data sheet: a sum of its parameters."""

    name: str
    """Begins with the spring's name; equal to it for its compliance without load. A phrase may have
    the rest as its part ``figure``, which is shown alone below the first row."""
    weights: tuple[float, ...]
    """One a parameter of the spring."""
    unit: Unit


@dataclass(frozen=True)
class SpringAxis:
    """A virtual joint that a spring inserts into the chain."""

    name: str
    joint: str
    """Name of the joint in whose frame it sits."""
    axis: tuple[float, float, float]
    """Unit vector in the joint frame."""
    revolute: bool = True
    """True: it turns about the axis. False: it slides along it."""
    distal: bool = False
    """False: in the joint's proximal frame, before its motion. True: behind its motion."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of that frame that the axis passes through, in m."""

    def is_axis_of(self, joint: ChainJoint) -> bool:
        """Return whether this is the joint's own motion."""
        return (
            self.revolute == joint.revolute
            and self.offset == (0.0, 0.0, 0.0)
            and bool(np.array_equal(np.asarray(self.axis), joint.axis))
        )

    def check(self, joint_names: Sequence[str]) -> None:
        """Refuse an axis that does not fit a robot.

        Raises
        ------
        SpringError
            If the joint is not the robot's, or a vector is none.
        """
        if self.joint not in joint_names:
            raise SpringError(
                f"spring {self.name!r} sits at joint {self.joint!r}, which the robot does not"
                f" have{nearest(self.joint, joint_names)} (joints: {', '.join(joint_names)})"
            )
        if not abs(float(np.linalg.norm(self.axis)) - 1.0) < _UNIT_LENGTH:
            raise SpringError(f"axis of spring {self.name!r} is {self.axis}, not a unit vector")
        problem = impossible("length", *self.offset)
        if problem is not None:
            raise SpringError(f"offset of spring {self.name!r} is {problem}")


@brief_repr
@dataclass(frozen=True)
class SpringLoad(Generic[Quantity]):
    """Load on a spring; it holds all arguments of a law."""

    torque: tuple[Quantity, ...]
    """Torque of the load about each axis of the spring, in N·m; force along it, in N, where it
    slides."""
    weight: tuple[Quantity, ...] = ()
    """Torque of the arm's own weight about each axis, of the same shape; empty: the arm is
    weightless."""
    friction: tuple[Quantity, ...] = ()
    """Torque that each friction element of the spring bears, in N·m; empty: none bears any."""


Angles = tuple[tuple[Quantity, ...], ...]
"""Angles by axis, by parameter."""
Tangents = tuple[tuple[tuple[FloatArray | float, ...], ...], ...]
"""Tangents by axis, by torque, by parameter."""


@brief_repr
@record()
class Spring(ABC):
    """A place where a robot is soft.

    A spring inserts virtual joints, its `axes`, into the chain. A load moves them, from where the
    arm's own weight holds them, by

        theta_a = sum over parameters p of angle_ap(load) c_p,

    which is linear in the parameters ``c`` but need not be in the load. With the Jacobian ``J_a``
    of the observed point for each axis, the deflection is ``sum_a J_a theta_a``, so the columns of
    the observation matrix (paper Eq. 11, 14) are ``sum_a J_a angle_ap``.
    """

    name: str
    """Unique name, ``<joint>.<axis>``, e.g. ``joint_a2.axial`` or ``joint_a2.x``."""
    joint: str
    """Name of the joint in whose frame the spring sits."""

    units: ClassVar[tuple[Unit, ...]]
    """Every unit that parameters of this kind may have."""
    bears_weight: ClassVar[bool] = False
    """Whether the law depends on the torque of the arm's own weight."""
    places: ClassVar[frozenset[str]] = frozenset(
        {"name", "joint", "axis", "revolute", "distal", "offset"}
    )
    """Fields that say where a spring is; the law may not depend on them."""

    @classmethod
    @abstractmethod
    def at(cls, axis: SpringAxis) -> "Spring":
        """Return the spring that a spring file asks for at a place."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """The word of files for the spring; a field of every kind but the hinge, understood."""

    @property
    @abstractmethod
    def axes(self) -> tuple[SpringAxis, ...]:
        """The virtual joints that the spring inserts."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The coefficients, in the order of every compliance vector."""

    @property
    def characteristics(self) -> tuple[Characteristic, ...]:
        """Figures of the spring in tables; by default its parameters."""
        unit_vectors = np.eye(len(self.parameters)).tolist()
        return tuple(
            Characteristic(parameter.name, tuple(weights), parameter.unit)
            for parameter, weights in zip(self.parameters, unit_vectors, strict=True)
        )

    @property
    def friction_limits(self) -> tuple[float, ...]:
        """Torques about the first axis at which its friction elements slide, in N·m or N."""
        return ()

    @abstractmethod
    def angles(self, load: SpringLoad[Quantity]) -> Angles[Quantity]:
        """Return the law: the angle of each axis for one unit of each parameter.

        Written with ``+ - * /`` and the functions of `elastocal.elastic.springs.expression`, so
        that it takes arrays (of any shape, element by element) as well as names.
        """

    @abstractmethod
    def tangents(self, load: SpringLoad[FloatArray]) -> Tangents:
        """Return the derivative of the law by the load torques.

        Symmetric in axis and torque, since a spring stores energy.
        """

    def columns(
        self, J: Sequence[FloatArray], load: SpringLoad[FloatArray]
    ) -> tuple[FloatArray, ...]:
        """Return the columns of the observation matrix, one for each parameter.

        Parameters
        ----------
        J : sequence of ndarray, shape (..., 3, spring)
            For each axis, its column of the Jacobian of the observed point. The last axis is for
            springs that share this law: they are evaluated together.
        load : SpringLoad
            Each array of shape (..., spring).

        Returns
        -------
        tuple of ndarray, shape (..., 3, spring)
            In m per unit of the parameter.
        """
        angles = self.angles(load)
        first, *others = zip(J, angles, strict=True)
        columns = [first[0] * angle[..., None, :] for angle in first[1]]
        for J_axis, row in others:
            columns = [c + J_axis * x[..., None, :] for c, x in zip(columns, row, strict=True)]
        return tuple(columns)

    @property
    def law(self) -> Hashable:
        """The settings that springs evaluated together have in common: all but their place."""
        settings = (getattr(self, f.name) for f in fields(self) if f.name not in self.places)
        return (type(self), *settings)


@record()
class OneAxisSpring(Spring):
    """A spring about one axis, or along it; its subclasses differ in parameters and law."""

    axis: tuple[float, float, float]
    """Unit vector in the joint frame."""
    revolute: bool = True
    """True for a torsional spring, False for a linear one."""
    distal: bool = False
    """False: in the joint's proximal frame, before its motion (the bearing housing; Angeles'
    Hartenberg-Denavit convention, used by the paper). True: behind its motion."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of that frame that the axis passes through, in m."""

    @classmethod
    def at(cls, axis: SpringAxis) -> "OneAxisSpring":
        """Return the spring at an axis."""
        return cls(axis.name, axis.joint, axis.axis, axis.revolute, axis.distal, axis.offset)

    @property
    def axes(self) -> tuple[SpringAxis, ...]:
        """The axis of the spring."""
        place = (self.axis, self.revolute, self.distal, self.offset)
        return (SpringAxis(self.name, self.joint, *place),)


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
    return triple(unit)


def coordinate_axis(unit: ArrayLike) -> str | None:
    """Return the name of the coordinate axis along which a unit vector points, in either sense.

    None where it points along none of them.

    >>> coordinate_axis([0.0, -1.0, 0.0])
    'y'
    """
    alignment = np.abs(np.asarray(unit, dtype=float))
    nearest = int(alignment.argmax())
    return tuple(AXES)[nearest] if alignment[nearest] >= _ALIGNED else None
