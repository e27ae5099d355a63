"""What is known of springs before the data: bounds, and stiffnesses of data sheets.

People write both as stiffness or as compliance, with units; here they are compliances.
"""

from typing import Annotated, NamedTuple

from pydantic import BeforeValidator, PlainValidator, model_validator

from elastocal.elastic.springs import Spring
from elastocal.errors import SpringError, UnitError
from elastocal.records import StrictModel, record
from elastocal.units import parse_quantity

_DIMENSIONS = {
    "rotational stiffness": (True, True),
    "translational stiffness": (False, True),
    "rotational compliance": (True, False),
    "translational compliance": (False, False),
}
"""Whether a quantity is of a torsional spring, and whether it is a stiffness."""


@record()
class KnownSpring:
    """What is known of a spring, as compliances in rad/(N·m) or m/N."""

    name: str
    low: float | None = None
    """Smallest compliance; none: zero."""
    high: float | None = None
    """Largest; none: no bound."""
    compliance: float | None = None
    """Expected compliance, a prior; none: nothing is expected."""
    sigma: float | None = None
    """Its standard deviation."""


class _Compliance(NamedTuple):
    """A compliance as a file states it."""

    value: float
    """In rad/(N·m) or m/N."""
    revolute: bool
    """Whether it is that of a torsional spring."""


def _parse_compliance(text: object) -> _Compliance:
    """Return the compliance that a stiffness or compliance with its unit says."""
    for dimension, (revolute, stiff) in _DIMENSIONS.items():
        try:
            value = parse_quantity(text, dimension)
        except UnitError:
            continue
        if not value > 0.0:
            raise ValueError(f"{text!r} must be above 0")
        return _Compliance(1.0 / value if stiff else value, revolute)
    raise ValueError(
        f"{text!r} is not a stiffness or compliance with its unit, e.g. '1.2 MN*m/rad'"
    )


def _parse_share(text: object) -> float:
    """Return a share from ``"20 %"``."""
    number, sign, rest = str(text).partition("%")
    try:
        share = float(number) / 100.0
    except ValueError:
        share = float("nan")
    if not (sign and not rest.strip() and 0.0 < share <= 10.0):
        raise ValueError(f"{text!r} must be a percentage above 0 %, e.g. '20 %'")
    return share


_Written = Annotated[_Compliance, PlainValidator(_parse_compliance)]


class Knowledge(StrictModel):
    """Keys of a spring file that say what is known of a spring."""

    bounds: tuple[_Written, _Written] | None = None
    """Two stiffnesses or two compliances; in any order."""
    stiffness: _Written | None = None
    """Expected, of a data sheet."""
    uncertainty: Annotated[float, BeforeValidator(_parse_share)] | None = None
    """Standard deviation of that, as a percentage."""

    @model_validator(mode="after")
    def _require_pairs(self) -> "Knowledge":
        if (self.stiffness is None) != (self.uncertainty is None):
            raise ValueError("stiffness and uncertainty come together or not at all")
        if self.bounds is not None and self.bounds[0].value == self.bounds[1].value:
            raise ValueError("bounds must be two different values")
        return self

    @property
    def knows(self) -> bool:
        """Whether anything is known."""
        return self.bounds is not None or self.stiffness is not None

    def of_spring(self, spring: Spring) -> KnownSpring:
        """Return what is known of a spring.

        Raises
        ------
        SpringError
            If the spring has several parameters, or turns where the values are of one that slides.
        """
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
        return KnownSpring(parameter.name, low, high, mean, sigma)
