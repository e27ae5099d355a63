"""Small values that a person types on the command line."""

from elastocal.errors import IdentificationError, UnitError
from elastocal.units import parse_quantity


def parse_bounds(text: str) -> tuple[float, float]:
    """Return two bounds from ``"LOW,HIGH"``.

    >>> parse_bounds("0,inf")
    (0.0, inf)

    Raises
    ------
    IdentificationError
        If the text is not two numbers.
    """
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError as error:
        raise IdentificationError(f"bounds {text!r} must be two numbers, e.g. '0,inf'") from error
    return low, high


def parse_point(text: str) -> tuple[float, float, float]:
    """Return a point in m from three lengths with units.

    >>> parse_point("0 mm, 0 mm, 35 mm")
    (0.0, 0.0, 0.035)

    Raises
    ------
    UnitError
        If the text is not three lengths.
    """
    parts = text.split(",")
    if len(parts) != 3:
        raise UnitError(f"{text!r} must be three lengths, e.g. '0 mm, 0 mm, 35 mm'")
    x, y, z = (parse_quantity(part.strip(), "length") for part in parts)
    return x, y, z
