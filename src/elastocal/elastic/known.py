"""Prior knowledge of springs: bounds, and stiffnesses from data sheets.

Files give both as stiffness or compliance, with units; here they are compliances. Makers of gears
state up to three stiffnesses: ``K1`` up to the torque ``T1``, ``K2`` from there to ``T2``, ``K3``
beyond. Each is the mean compliance of the gear between two torques, which is linear in its
parameters.
"""

from collections.abc import Iterator
from functools import partial
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import BeforeValidator, PlainValidator, model_validator

from elastocal.arrays import FloatArray
from elastocal.elastic.springs import OneAxisSpring, Spring, SpringLoad
from elastocal.errors import SpringError
from elastocal.records import StrictModel, record
from elastocal.results import brief_repr
from elastocal.units import dimension_of, impossible, parse_quantity, parse_share

_DIMENSIONS = {
    "rotational stiffness": (True, True),
    "translational stiffness": (False, True),
    "rotational compliance": (True, False),
    "translational compliance": (False, False),
}
"""Whether a quantity is torsional, and whether it is a stiffness."""


@brief_repr
@record()
class KnownSpring:
    """Prior knowledge of a spring, as compliances in rad/(N·m) or m/N."""

    name: str
    low: float | None = None
    """Smallest compliance; none: zero."""
    high: float | None = None
    """Largest; none: no bound."""
    compliance: float | None = None
    """Expected compliance, a prior; none: nothing is expected."""
    sigma: float | None = None
    """Its standard deviation."""
    weights: tuple[float, ...] | None = None
    """Weights over the parameters of the spring of that name that make the compliance; none: it is
    the parameter of that name."""


class _Compliance(NamedTuple):
    """A compliance as a file states it."""

    value: float
    """In rad/(N·m) or m/N."""
    revolute: bool
    """Whether it is that of a torsional spring."""


def _parse_compliance(text: object) -> _Compliance:
    """Return the compliance that a stiffness or compliance with its unit says."""
    dimension = dimension_of(text)
    if dimension not in _DIMENSIONS:
        raise ValueError(
            f"{text!r} is not a stiffness or compliance with its unit, e.g. '1.2 MN*m/rad'"
        )
    (revolute, stiff), value = _DIMENSIONS[dimension], parse_quantity(text, dimension)
    if not value > 0.0:
        raise ValueError(f"{text!r} must be above 0")
    compliance = 1.0 / value if stiff else value
    kind = "rotational compliance" if revolute else "translational compliance"
    problem = impossible(kind, compliance)
    if problem is not None:
        raise ValueError(f"{text!r} is {problem}")
    return _Compliance(compliance, revolute)


def _parse_torque(text: object) -> float:
    """Return a torque above 0 in N·m."""
    value = parse_quantity(text, "moment")
    if not value > 0.0:
        raise ValueError(f"{text!r} must be above 0")
    return value


_Torque = Annotated[float, BeforeValidator(_parse_torque)]
_Written = Annotated[_Compliance, PlainValidator(_parse_compliance)]


class Knowledge(StrictModel):
    """Keys of a spring file that say what is known of a spring."""

    bounds: tuple[_Written, _Written] | None = None
    """Two stiffnesses or two compliances; in any order."""
    stiffness: _Written | None = None
    """Expected, of a data sheet."""
    uncertainty: Annotated[float, BeforeValidator(partial(parse_share, most=10.0))] | None = None
    """Standard deviation of that, or of each of the next three, as a percentage."""
    K1: _Written | None = None
    """Stiffness of a gear up to ``T1``; without torque where that is not given."""
    K2: _Written | None = None
    """From ``T1`` to ``T2``."""
    K3: _Written | None = None
    """Beyond ``T2``."""
    T1: _Torque | None = None
    T2: _Torque | None = None

    @model_validator(mode="after")
    def _require_pairs(self) -> "Knowledge":
        stated = any(each is not None for each in (self.stiffness, self.K1, self.K2, self.K3))
        if stated != (self.uncertainty is not None):
            name = "stiffness" if self.stiffness is not None or not stated else "K1, K2, K3"
            raise ValueError(f"{name} and uncertainty come together or not at all")
        missing = {"K2": self.T1 is None or self.T2 is None, "K3": self.T2 is None}
        for name, torques in (("K2", "T1 and T2"), ("K3", "T2")):
            if getattr(self, name) is not None and missing[name]:
                raise ValueError(f"{name} holds between torques: it needs {torques}")
        if self.T1 is not None and self.T2 is not None and not self.T1 < self.T2:
            raise ValueError("T1 must be below T2")
        stated_gear = [each.value for each in (self.K1, self.K2, self.K3) if each is not None]
        if stated_gear != sorted(stated_gear, reverse=True):
            raise ValueError("K1, K2, K3 must grow: a gear stiffens with its torque")
        self._require_bounds()
        return self

    def _require_bounds(self) -> None:
        if self.bounds is None:
            return
        low, high = sorted(bound.value for bound in self.bounds)
        if low == high:
            raise ValueError("bounds must be two different values")
        if self.stiffness is not None and not low <= self.stiffness.value <= high:
            raise ValueError("stiffness must lie within bounds")

    @property
    def knows(self) -> bool:
        """Whether anything is known."""
        stated = (self.bounds, self.stiffness, self.K1, self.K2, self.K3)
        return any(each is not None for each in stated)

    def of_spring(self, spring: Spring) -> tuple[KnownSpring, ...]:
        """Return the known values of a spring; of a gear, one for each stiffness of its data sheet.

        Raises
        ------
        SpringError
            If the spring has several parameters and is no gear, or turns where the values are of
            one that slides.
        """
        gear = tuple(self._of_gear(spring))
        if gear and self.bounds is None and self.stiffness is None:
            return gear
        if len(spring.parameters) != 1:
            raise SpringError(
                f"spring {spring.name!r} ({spring.kind}) has {len(spring.parameters)} numbers:"
                " bounds and stiffness are for springs of one, revolute or prismatic"
            )
        (parameter,) = spring.parameters
        written = [each for each in (*(self.bounds or ()), self.stiffness) if each is not None]
        for each in written:
            if each.revolute != spring.axes[0].revolute:
                raise SpringError(
                    f"spring {spring.name!r} is {spring.kind}: what is known of it must have the"
                    f" unit of {parameter.unit.si}, or of its inverse"
                )
        low, high = (None, None) if self.bounds is None else sorted(b.value for b in self.bounds)
        mean = None if self.stiffness is None else self.stiffness.value
        sigma = None if mean is None or self.uncertainty is None else mean * self.uncertainty
        return (KnownSpring(parameter.name, low, high, mean, sigma),)

    def _of_gear(self, spring: Spring) -> Iterator[KnownSpring]:
        """Yield what a data sheet says: the mean compliance between two torques, or at none."""
        beyond = 0.0 if self.T2 is None else 2.0 * self.T2
        ways = ((self.K1, 0.0, self.T1), (self.K2, self.T1, self.T2), (self.K3, self.T2, beyond))
        for stiffness, low, high in ways:
            if stiffness is None or self.uncertainty is None:
                continue
            if not (isinstance(spring, OneAxisSpring) and spring.bears_weight):
                raise SpringError(
                    f"spring {spring.name!r} ({spring.kind}) is no gear: K1, K2 and K3 are what"
                    " makers state of one"
                )
            if not stiffness.revolute:
                raise SpringError(f"spring {spring.name!r} turns: K1, K2 and K3 are in N*m/rad")
            weights = _mean_compliance(spring, low or 0.0, high or 0.0)
            yield KnownSpring(
                spring.name,
                compliance=stiffness.value,
                sigma=stiffness.value * self.uncertainty,
                weights=tuple(weights.tolist()),
            )


def _mean_compliance(spring: Spring, low: float, high: float) -> FloatArray:
    """Return the weights over a spring's parameters of its mean compliance between two torques."""
    if high > low:
        between = SpringLoad((np.array(high - low),), (np.array(low),))
        return np.array(spring.angles(between)[0], dtype=float) / (high - low)
    return np.array(spring.tangents(SpringLoad((np.array(0.0),)))[0][0], dtype=float)
