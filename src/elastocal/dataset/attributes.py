"""Global attributes of a dataset: texts, and only those that are known."""

from collections.abc import Hashable, Mapping
from typing import Any

from elastocal.dataset.layout import ATTRIBUTES, CF_ATTRIBUTES, SCHEMA
from elastocal.errors import DatasetError, SchemaError, UnitError, nearest
from elastocal.units import parse_quantity

Point = tuple[float, float, float]


def canonical_attributes(attributes: Mapping[Hashable, Any]) -> dict[str, str]:
    """Return the global attributes in order, with empty texts where a text is optional.

    Raises
    ------
    DatasetError
        If an attribute is unknown or not a text.
    SchemaError
        If the schema is missing or not known.
    """
    known = (*ATTRIBUTES, *CF_ATTRIBUTES)
    schema = attributes.get("schema")
    if not isinstance(schema, str) or schema != SCHEMA:
        found = "no attribute 'schema'" if schema is None else f"schema {schema!r}"
        raise SchemaError(f"dataset has {found}; this version reads {SCHEMA!r}")
    for name, value in attributes.items():
        if name not in known:
            raise DatasetError(
                f"attribute {name!r} is not known{nearest(str(name), known)}"
                f" (allowed: {', '.join(known)})"
            )
        if not isinstance(value, str) or not _storable(value):
            raise DatasetError(f"attribute {name!r} is {value!r:.60}: it must be a text")
        if name in ("robot_urdf", "tcp_frame") and not value:
            raise DatasetError(f"attribute {name!r} is empty: leave it out when it is not known")
        if name == "marker":
            read_point(name, value)
    texts = {"robot_name": "", "provenance": "", **attributes}
    return {name: str(texts[name]) for name in known if name in texts}


_NOTHING = 1e-12
"""Length in m below which `parse_quantity` reads none."""


def write_point(point: Point) -> str:
    """Return the text of a point, as the command line takes it; a picometre is nothing.

    >>> write_point((0.0, 0.04, -0.06))
    '0.0 m, 0.04 m, -0.06 m'
    """
    return ", ".join(
        f"{value if abs(value) >= _NOTHING else 0.0!r} m" for value in map(float, point)
    )


def read_point(name: str, text: str) -> Point:
    """Return the point that an attribute states, in m.

    Raises
    ------
    DatasetError
        If it is not three lengths with their units.
    """
    try:
        x, y, z = (parse_quantity(part.strip(), "length") for part in text.split(","))
    except (UnitError, ValueError) as error:
        raise DatasetError(
            f"attribute {name!r} is {text!r:.60}: it must be three lengths, such as"
            " '0 m, 0.04 m, -0.06 m'"
        ) from error
    return x, y, z


def _storable(text: str) -> bool:
    """Return whether a NetCDF file can hold a text: UTF-8, without the zero that ends it in C."""
    return "\0" not in text and not any("\ud800" <= letter <= "\udfff" for letter in text)
