"""Options of ``codec`` that a person types."""

from elastocal.codec import Tolerance
from elastocal.errors import CodecError, UnitError
from elastocal.units import parse_quantity


def parse_ratio(text: str) -> float:
    """Return training over verification poses from ``"A/B"`` or a number.

    >>> parse_ratio("70/30") == 70 / 30
    True

    Raises
    ------
    CodecError
        If the text is neither.
    """
    above, _, below = text.partition("/")
    try:
        return float(above) / float(below or 1.0)
    except (ValueError, ZeroDivisionError) as error:
        raise CodecError(f"ratio {text!r} must be two numbers above 0, e.g. '70/30'") from error


def parse_tolerance(text: str) -> Tolerance:
    """Return a tolerance from ``"PART %, LENGTH"``; the length may be left out.

    >>> parse_tolerance("5 %, 0.01 mm")
    Tolerance(relative=0.05, floor=1e-05)
    >>> parse_tolerance("0.1").relative
    0.1

    Raises
    ------
    CodecError
        If the text does not fit.
    """
    part, _, length = (each.strip() for each in text.partition(","))
    percent = part.endswith("%")
    try:
        relative = float(part.removesuffix("%")) / (100.0 if percent else 1.0)
        floor = parse_quantity(length, "length") if length else Tolerance.floor
    except (ValueError, UnitError) as error:
        raise CodecError(
            f"tolerance {text!r} must be a part and a length, e.g. '5 %, 5 um'"
        ) from error
    return Tolerance(relative, floor)
