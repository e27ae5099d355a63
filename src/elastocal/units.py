"""Units: SI and radians inside, everything else only at the edges (docs/conventions.md).

A person writes ``"175 mm"`` in YAML and ``force_x[kN]`` in a CSV header; the rest of the
package only ever sees metres, radians, newtons. A refusal names the units that are allowed.
"""

import math
import re
from typing import TYPE_CHECKING, TypeVar

from elastocal.errors import UnitError, nearest

if TYPE_CHECKING:
    from elastocal.arrays import FloatArray

_FACTORS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    # Both are exact by definition; Japanese sensors still log in kgf, American ones in lbf.
    "force": {"N": 1.0, "kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "moment": {
        "N*m": 1.0,
        "Nm": 1.0,
        "N·m": 1.0,
        "kN*m": 1e3,
        "N*mm": 1e-3,
        "kgf*m": 9.80665,
        "kgf*cm": 9.80665e-2,
        "lbf*in": 4.4482216152605 * 0.0254,
        "lbf*ft": 4.4482216152605 * 0.3048,
    },
    "mass": {"kg": 1.0, "t": 1e3},
    "speed": {"m/s": 1.0, "mm/s": 1e-3},
    "angular speed": {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    "force rate": {"N/s": 1.0, "kN/s": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rotational compliance": {
        "rad/(N*m)": 1.0,
        "rad/Nm": 1.0,
        "rad/(N·m)": 1.0,
        "urad/(N*m)": 1e-6,
        "µrad/(N·m)": 1e-6,
    },
    "translational compliance": {"m/N": 1.0, "mm/N": 1e-3, "um/N": 1e-6, "µm/N": 1e-6},
    "rotational stiffness": {
        "N*m/rad": 1.0,
        "Nm/rad": 1.0,
        "N·m/rad": 1.0,
        "kN*m/rad": 1e3,
        "MN*m/rad": 1e6,
        "MN·m/rad": 1e6,
        "N*m/arcmin": 10800.0 / math.pi,
        "Nm/arcmin": 10800.0 / math.pi,
    },
    "translational stiffness": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6, "MN/m": 1e6},
    "frequency": {"Hz": 1.0},
    "acceleration": {"m/s2": 1.0, "m/s^2": 1.0, "m/s²": 1.0},
}

MEANT = {
    **dict.fromkeys(("°", "degree", "degrees", "grad", "grd", "degrés"), "deg"),
    "nm": "N*m", "n-m": "N*m", "nmm": "N*mm", "n-mm": "N*mm", "lb": "lbf", "lbs": "lbf",
    "lbf-in": "lbf*in", "lbf-ft": "lbf*ft", "sec": "s", "inch": "in", "inches": "in",
}  # fmt: skip
"""Units by other words for them, in small letters, as logs of three languages have them."""
SHOWN = {
    "mm": 1e3, "µm": 1e6, "mm/s": 1e3, "ms": 1e3, "mrad": 1e3, "N/mm": 1e-3, "N/µm": 1e-6,
    "deg": 180.0 / math.pi, "°": 180.0 / math.pi,
}  # fmt: skip
"""Factors from SI to units for people, in the only table of them."""
_BEGINNINGS = {re.split(r"\W", unit)[0] for table in (*_FACTORS.values(), SHOWN) for unit in table}
"""Signs that a unit begins with: ``N`` of ``N*m``."""
_OF_PAGES = {"h", "kHz", "kB", "MB", "GB", "µs", "nm", "m²", "rpm"}
"""Units that pages write and no file does."""
_BEFORE_UNIT = re.compile(
    r"(?<=\))[ \n](?=%)|(?<=\d)(?:[ \n]?(?=%)|[ \n](?=(?:"
    + "|".join(sorted(_BEGINNINGS - {"", "in"} | _OF_PAGES))
    + r")(?!\w)))"
)
"""What stands between a number and its unit; ``in`` is nearly always the word."""
V = TypeVar("V", float, "FloatArray")

_LARGEST: dict[str, tuple[float, str]] = {
    "length": (1e3, "1 km"),  # the longest rails and halls are some hundred metres
    "angle": (200.0 * math.pi, "100 turns"),
    "force": (1e7, "10 MN"),  # a large forging press
    "moment": (1e7, "10 MN·m"),
    "mass": (1e6, "1000 t"),  # the heaviest robots are some ten tonnes, gantries some hundred
    "speed": (1e3, "1 km/s"),
    "angular speed": (1e3, "1000 rad/s"),
    "force rate": (1e9, "1 GN/s"),
    "time": (1e6, "1e6 s"),
    "acceleration": (1e3, "1000 m/s2"),
    "frequency": (1e6, "1 MHz"),
    # A metre under a newton, a radian under a newton metre: not even a toy's servo is as soft. The
    # stiffest bearings of large machines have some 1e10 N/m and N·m/rad.
    "rotational compliance": (1.0, "1 rad/(N·m)"),
    "translational compliance": (1.0, "1 m/N"),
    "rotational stiffness": (1e12, "1e12 N·m/rad"),
    "translational stiffness": (1e12, "1e12 N/m"),
}
"""Largest magnitude of what belongs to a robot cell, in SI: more is a slip of the keyboard, or a
damaged file. Whatever reads or makes such numbers asks here (`impossible`): within these, products
of them are finite, so that a correction can only be a number."""
_NEVER_NEGATIVE = ("mass", "rotational stiffness", "translational stiffness")
_SMALLEST = 1e-12
"""Smallest magnitude of the same, in SI, but for 0."""

_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*([^\s\d.].*)\s*")
_COLUMN = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*")


def factor(unit: str, dimension: str) -> float:
    """Return the SI value of one ``unit`` of ``dimension``.

    >>> factor("mm", "length")
    0.001

    Raises
    ------
    UnitError
        If the unit is not one of the dimension's.
    """
    table = _FACTORS[dimension]
    if unit not in table:
        meant = MEANT.get(unit.lower(), unit)
        raise UnitError(
            f"unit {unit!r} is not {_a(dimension)}: allowed are {', '.join(table)}"
            f"{nearest(meant if meant in table else unit, table)}"
        )
    return table[unit]


def in_unit(value: V, unit: str) -> V:
    """Return an SI value, or an array of them, in another unit.

    >>> in_unit(0.0123, "mm"), in_unit(math.pi, "deg")
    (12.3, 180.0)

    Raises
    ------
    KeyError
        If the unit is not in `SHOWN`.
    """
    return value * SHOWN[unit]


def quantity(value: float, unit: str, spec: str = "g") -> str:
    """Return an SI value in another unit, with the unit.

    >>> quantity(0.0123, "mm"), quantity(0.5, "°", ".1f"), quantity(-1e-9, "mm", ".1f")
    ('12.3 mm', '28.6°', '0.0 mm')

    Raises
    ------
    KeyError
        If the unit is not in `SHOWN`.
    """
    number = f"{in_unit(float(value), unit):{spec}}"
    bare = number.removeprefix("-")
    # Rounded to nothing, it has no sign.
    shown = bare if not bare.strip("0.") else number
    return f"{shown}°" if unit == "°" else f"{shown} {unit}"


def with_fixed_units(text: str) -> str:
    """Return a text for a page, a no-break space between each number and its unit (ISO 80000-1).

    >>> with_fixed_units("0.3 mm of 12 models, 5 N·m, 95 %, ±39%").replace(chr(160), "_")
    '0.3_mm of 12 models, 5_N·m, 95_%, ±39_%'
    """
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", text)


def parse_quantity(text: object, dimension: str) -> float:
    """Return the SI value of a quantity such as ``"175 mm"``; a bare number is refused.

    >>> parse_quantity("1.1 kN", "force")
    1100.0

    Raises
    ------
    UnitError
        If ``text`` is not a string, has no unit or a unit of another dimension, or is larger or
        smaller than anything in a robot cell: a length of more than 1 km, for example.
    """
    match = _QUANTITY.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        units = ", ".join(_FACTORS[dimension])
        raise UnitError(f"{text!r} is not {_a(dimension)} with its unit (one of {units})")
    value = float(match[1]) * factor(match[2].strip(), dimension)
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is not a finite {dimension}")
    _check_size(value, dimension, f"{text!r}")
    return value


def parse_share(text: object, most: float) -> float:
    """Return a share above 0 from a percentage; a bare number is refused.

    >>> parse_share("30 %", most=1.0)
    0.3

    Raises
    ------
    UnitError
        If ``text`` is no percentage, or its share is not above 0 and up to ``most``.
    """
    number, sign, rest = str(text).partition("%")
    try:
        share = float(number) / 100.0
    except ValueError:
        share = math.nan
    if not (isinstance(text, str) and sign and not rest.strip() and 0.0 < share <= most):
        raise UnitError(
            f"{text!r} must be a percentage above 0 % and up to {100.0 * most:.0f} %, e.g. '20 %'"
        )
    return share


def parse_number(text: str) -> float:
    """Return the number in a text, as people and controllers write it; it may be NaN or inf.

    Python's own ``float`` also takes ``1_100`` and the digits of any script.

    >>> parse_number(" -1.1e3 ")
    -1100.0

    Raises
    ------
    ValueError
        If it is not a number.
    """
    plain = text.strip()
    if not plain.isascii() or "_" in plain:
        raise ValueError(f"{text!r} is not a number")
    try:
        return float(plain)
    except ValueError:
        raise ValueError(f"{text!r} is not a number") from None


def largest(dimension: str) -> tuple[float, str]:
    """Return the largest magnitude of a dimension in a robot cell, in SI, and its name.

    >>> largest("length")
    (1000.0, '1 km')
    """
    return _LARGEST[dimension]


def impossible(dimension: str, *values: float) -> str | None:
    """Return why a number in SI, or NaN, is impossible in a robot cell; None if it is possible.

    >>> impossible("length", 0.5, 1e160)
    '1e+160 m: the largest length is 1 km'
    """
    largest, name = _LARGEST[dimension]
    for value in values:
        text = f"{value:g} {next(iter(_FACTORS[dimension]))}"
        if not math.isfinite(value):
            return f"{text}: it must be finite"
        if not abs(value) <= largest:
            return f"{text}: the largest {dimension} is {name}"
        if value < 0.0 and dimension in _NEVER_NEGATIVE:
            return f"{text}: it must not be negative"
    return None


def dimension_of(quantity: object) -> str | None:
    """Return the dimension of a quantity's unit; None if the text is no quantity.

    >>> dimension_of("1.2 MN*m/rad")
    'rotational stiffness'
    """
    match = _QUANTITY.fullmatch(quantity) if isinstance(quantity, str) else None
    return dimension_of_unit(match[2].strip()) if match else None


def dimension_of_unit(unit: str) -> str | None:
    """Return the dimension of a unit, which has but one; None if it is not known.

    >>> dimension_of_unit("kN")
    'force'
    """
    return next((name for name, table in _FACTORS.items() if unit in table), None)


def in_unit_of(value: float, quantity: str) -> str | None:
    """Return an SI value in the unit of a quantity; None if the text is no quantity.

    >>> in_unit_of(0.02, "25 mm/s")
    '20 mm/s'
    """
    match, dimension = _QUANTITY.fullmatch(quantity), dimension_of(quantity)
    if match is None or dimension is None:
        return None
    unit = match[2].strip()
    return f"{value / _FACTORS[dimension][unit]:.6g} {unit}"


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


def _a(dimension: str) -> str:
    return f"{'an' if dimension[0] in 'aeiou' else 'a'} {dimension}"


def _check_size(value: float, dimension: str, text: str) -> None:
    if dimension not in _LARGEST:
        return
    largest, name = _LARGEST[dimension]
    if not abs(value) <= largest:
        raise UnitError(f"{text} is too large: the largest {dimension} is {name}")
    if not (value == 0.0 or abs(value) >= _SMALLEST):
        raise UnitError(f"{text} is too small: write 0, or at least {_SMALLEST:g} in SI units")


def split_column(header: str) -> tuple[str, str | None]:
    """Split a CSV header such as ``force_x[N]`` into its name and its unit.

    >>> split_column("force_x[N]")
    ('force_x', 'N')
    >>> split_column("pose")
    ('pose', None)

    Raises
    ------
    UnitError
        If brackets do not match or nothing precedes them.
    """
    match = _COLUMN.fullmatch(header)
    if match is None or not match["name"].strip():
        raise UnitError(f"column header {header!r} is not of the form name[unit]")
    unit = match["unit"]
    return match["name"], None if unit is None else unit.strip()
