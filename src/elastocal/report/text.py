"""Numbers as people read them: millimetres, degrees, minutes."""

import math

_READABLE = {
    "m": (1e3, " mm"),
    "rad": (180.0 / math.pi, "°"),
    "N*m": (1.0, " N·m"),
    "1": (1.0, ""),
    "": (1.0, ""),
}


def readable(value: float, unit: str) -> str:
    """Return an SI value in the unit that people read, with three digits.

    >>> readable(0.0123, "m"), readable(0.5, "rad"), readable(1234.0, "N"), readable(0.25, "1")
    ('12.3 mm', '28.6°', '1234 N', '0.25')
    >>> readable(math.inf, "m")
    'no limit'
    """
    if math.isinf(value):
        return "no limit"
    scale, name = _READABLE.get(unit, (1.0, f" {unit}"))
    return f"{_three_digits(value * scale)}{name}"


def millimetres(point: tuple[float, float, float]) -> str:
    """Return a point in mm.

    >>> millimetres((1.2345, -0.5, 0.0))
    '1234.5, -500.0, 0.0'
    """
    return ", ".join(f"{1e3 * value + 0.0:.1f}" for value in point)


def duration(seconds: float) -> str:
    """Return a time span.

    >>> duration(42.4), duration(1300.0), duration(7322.0)
    ('42 s', '21 min 40 s', '2 h 02 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def _three_digits(value: float) -> str:
    """Return at least three significant digits, without an exponent for everyday sizes."""
    if value == 0.0:
        return "0"
    digits = 2 - math.floor(math.log10(abs(value)))
    if digits > 6:
        return f"{value:.2e}"
    text = f"{value:.{max(0, digits)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
