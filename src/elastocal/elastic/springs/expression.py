"""Formulas of named inputs, so that one law of a spring serves arrays, Python and C.

A kind writes its law with ``+ - * /`` and the functions of this module. Given arrays it computes;
given an `Input` it makes an `Expression`, from which `elastocal.compensation.kernel` takes the
statements of the online step and of the exported C.
"""

from dataclasses import dataclass
from typing import TypeVar, overload

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.results import brief_repr


@dataclass(frozen=True)
class Expression:
    """A formula; see the subclasses."""

    def __add__(self, other: "Expression | float") -> "Expression":
        return Sum((self, _as_expression(other)))

    def __radd__(self, other: float) -> "Expression":
        return Sum((Number(other), self))

    def __sub__(self, other: "Expression | float") -> "Expression":
        return Sum((self, -_as_expression(other)))

    def __rsub__(self, other: float) -> "Expression":
        return Sum((Number(other), -self))

    def __mul__(self, other: "Expression | float") -> "Expression":
        return Product((self, _as_expression(other)))

    def __rmul__(self, other: float) -> "Expression":
        return Product((Number(other), self))

    def __truediv__(self, other: "Expression | float") -> "Expression":
        if isinstance(other, Expression):
            return Function("quotient", (self, other))
        return Product((self, Number(1.0 / other)))

    def __rtruediv__(self, other: float) -> "Expression":
        return Function("quotient", (Number(other), self))

    def __neg__(self) -> "Expression":
        return Product((Number(-1.0), self))


@dataclass(frozen=True)
class Input(Expression):
    """A named input."""

    name: str


@dataclass(frozen=True)
class Number(Expression):
    """A constant."""

    value: float


@brief_repr
@dataclass(frozen=True)
class Sum(Expression):
    """A sum, left to right."""

    terms: tuple[Expression, ...]


@brief_repr
@dataclass(frozen=True)
class Product(Expression):
    """A product, left to right."""

    factors: tuple[Expression, ...]


@brief_repr
@dataclass(frozen=True)
class Function(Expression):
    """A function: ``atan2``, or ``quotient`` of two formulas."""

    name: str
    arguments: tuple[Expression, ...]


Quantity = TypeVar("Quantity", FloatArray, Expression)
"""Argument of a law: numbers, or the names of numbers in generated code."""


@overload
def atan2(y: FloatArray, x: FloatArray) -> FloatArray: ...
@overload
def atan2(y: Expression, x: Expression) -> Expression: ...
def atan2(y: FloatArray | Expression, x: FloatArray | Expression) -> FloatArray | Expression:
    """Return the angle of the point ``(x, y)``, in rad within ``+-pi``."""
    if isinstance(y, Expression) or isinstance(x, Expression):
        return Function("atan2", (_as_expression(y), _as_expression(x)))
    return np.arctan2(y, x)


def _as_expression(x: Expression | FloatArray | float) -> Expression:
    return x if isinstance(x, Expression) else Number(float(x))
