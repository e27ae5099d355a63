"""Fields of the cell file that have a dimension: a string with its unit, read as SI; and poses."""

import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, FiniteFloat, ValidationInfo

from elastocal.arrays import FloatArray
from elastocal.dataset import require_labels
from elastocal.records import StrictModel
from elastocal.robot import T_from_xyzabc
from elastocal.units import parse_quantity


def _read(dimension: str) -> BeforeValidator:
    return BeforeValidator(lambda text: parse_quantity(text, dimension))


def _not_zero(values: tuple[float, ...]) -> tuple[float, ...]:
    # The square of a number must neither vanish nor overflow when the direction is normed.
    if not 1e-6 <= math.hypot(*values) <= 1e6:
        raise ValueError("must be a direction, not all zero, of a length from 1e-6 to 1e6")
    return values


def _ascending(values: tuple[float, float]) -> tuple[float, float]:
    if not values[0] < values[1]:
        raise ValueError("the first must be below the second")
    return values


def _label(text: str) -> str:
    require_labels("name", [text])
    return text


Name = Annotated[str, AfterValidator(_label)]
"""Label of a dataset: not empty, printable, without spaces around it."""


OptionalName = Annotated[str, AfterValidator(lambda text: _label(text) if text else text)]
"""The same, or empty."""


_POSITIVE = Field(gt=0.0)


_NOT_NEGATIVE = Field(ge=0.0)


Length = Annotated[float, _read("length")]
"""In m."""


PositiveLength = Annotated[float, _read("length"), _POSITIVE]
"""In m, above 0."""


Distance = Annotated[float, _read("length"), _NOT_NEGATIVE]
"""In m, 0 or above."""


Angle = Annotated[float, _read("angle")]
"""In rad."""


PositiveAngleUpToPi = Annotated[float, _read("angle"), _POSITIVE, Field(le=math.pi)]
"""In rad, above 0, at most π."""


AngleUpToPi = Annotated[float, _read("angle"), _NOT_NEGATIVE, Field(le=math.pi)]
"""In rad, from 0 to π."""


AngleBelowRight = Annotated[float, _read("angle"), _NOT_NEGATIVE, Field(lt=math.pi / 2.0)]
"""In rad, from 0 to below π/2: an angle between two lines."""


Force = Annotated[float, _read("force"), _NOT_NEGATIVE]
"""In N, 0 or above."""


PositiveForce = Annotated[float, _read("force"), _POSITIVE]
"""In N, above 0."""


SignedForce = Annotated[float, _read("force")]
"""In N."""


PositiveMoment = Annotated[float, _read("moment"), _POSITIVE]
"""In N·m, above 0."""


Mass = Annotated[float, _read("mass"), _NOT_NEGATIVE]
"""In kg, 0 or above."""


PositiveMass = Annotated[float, _read("mass"), _POSITIVE]
"""In kg, above 0."""


Time = Annotated[float, _read("time"), Field(ge=0.0, le=1e6)]
"""In s, 0 or above."""


SignedTime = Annotated[float, _read("time")]
"""In s."""


PositiveTime = Annotated[float, _read("time"), _POSITIVE]
"""In s, above 0."""


PositiveSpeed = Annotated[float, _read("speed"), _POSITIVE]
"""In m/s, above 0."""


PositiveForceRate = Annotated[float, _read("force rate"), _POSITIVE]
"""In N/s, above 0."""


Moment = Annotated[float, _read("moment"), _NOT_NEGATIVE]
"""In N·m, 0 or above."""


SampleRate = Annotated[float, _read("frequency"), Field(ge=1.0, le=1000.0)]
"""Samples a second, from 1 to 1000."""


TranslationalCompliance = Annotated[float, _read("translational compliance"), _NOT_NEGATIVE]
"""In m/N, 0 or above."""


RotationalStiffness = Annotated[float, _read("rotational stiffness"), _POSITIVE]
"""In N·m/rad, above 0."""


TranslationalStiffness = Annotated[float, _read("translational stiffness"), _POSITIVE]
"""In N/m, above 0."""


StiffnessOrNone = Annotated[float, _read("translational stiffness"), _NOT_NEGATIVE]
"""In N/m, 0 or above."""


Share = Annotated[FiniteFloat, Field(ge=0.0, lt=1.0)]
"""From 0 to below 1, without dimension."""


ShareBelowHalf = Annotated[FiniteFloat, Field(ge=0.0, lt=0.5)]
"""From 0 to below a half, without dimension."""


Scale = Annotated[FiniteFloat, Field(gt=0.0)]
"""A factor, above 0."""


Point = tuple[Length, Length, Length]
"""x, y, z in m."""


Direction = Annotated[tuple[float, float, float], AfterValidator(_not_zero)]
"""Three numbers without dimension, not all zero; any length."""


Travel = Annotated[tuple[Length, Length], AfterValidator(_ascending)]
"""Lower and upper end in m."""


Range = Annotated[tuple[Distance, Distance], AfterValidator(_ascending)]
"""Nearest and farthest in m, 0 or above."""


class Pose(StrictModel):
    """``{xyz: ["0 mm", "0 mm", "450 mm"], abc: ["0 deg", "0 deg", "0 deg"]}``; zero by default."""

    xyz: Point = (0.0, 0.0, 0.0)
    """In m."""
    abc: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Turns about z, the new y, the new x, in rad (KUKA Z-Y'-X'')."""

    @property
    def T(self) -> FloatArray:
        """Homogeneous transform, shape (4, 4); translation in m."""
        return T_from_xyzabc(*self.xyz, *self.abc)


IDENTITY = Pose()
"""The pose of a frame in itself."""


def vector(values: tuple[float, ...]) -> FloatArray:
    """Return numbers as a read-only array."""
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def unit_vector(values: tuple[float, ...]) -> FloatArray:
    """Return a direction as a read-only unit vector."""
    array = np.array(values, dtype=float)
    return vector(tuple(array / np.linalg.norm(array)))


def needed_for(key: str, refusal: str) -> AfterValidator:
    """Return the validator that asks a field for the source of figures given before it.

    Parameters
    ----------
    key : str
        Field of the figures.
    refusal : str
        Message when the field says nothing.
    """

    def check(text: str | None, info: ValidationInfo) -> str | None:
        if info.data.get(key) and not (text or "").strip():
            raise ValueError(refusal)
        return text

    return AfterValidator(check)


def check_exactly_one(**given: object) -> None:
    """Refuse a model that has not exactly one of some keys.

    Parameters
    ----------
    **given : object
        The keys with their values; None where a key is missing.

    Raises
    ------
    ValueError
        With the given keys and the allowed ones.
    """
    found = [name for name, value in given.items() if value is not None]
    if len(found) != 1:
        raise ValueError(
            f"exactly one of {', '.join(given)} is needed; there is {' and '.join(found) or 'none'}"
        )
