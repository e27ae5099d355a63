"""The contents of a dataset: variables, dimensions, units (docs/reference/files/dataset.md).

This is the one list; the NetCDF file, its CSV twin and every check are made from it. The
variables are those of the paper's Procedure 1: ``P^c``, ``P^m``, ``F^m`` and ``Theta^c``.
"""

import contextlib
import difflib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike, NDArray

from elastocal.errors import DatasetError, SchemaError, UnitError, nearest
from elastocal.records import parse_json
from elastocal.units import parse_quantity

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
StringArray = NDArray[np.str_]
BoolArray = NDArray[np.bool_]
StatusArray = NDArray[np.int8]
Vector = tuple[float, float, float]
Labels = Mapping[str, Sequence[object]]
"""Labels of each dimension, by its name."""
Arrays = Mapping[str, np.ndarray]
"""Values of each variable that is present, by its name."""

SCHEMA = "elastocal.dataset/1"
"""The schema of a dataset without the variables that `SCHEMA_2` adds."""

SCHEMA_2 = "elastocal.dataset/2"
"""The schema with the order in time, the reference's joints and force, secondary encoders,
campaigns, gravity; and without metrology, at some poses or at all."""

SCHEMAS = (SCHEMA, SCHEMA_2)
"""The schemas that this version reads."""

AXES = ("x", "y", "z")
"""Labels of the coordinate axes, in order."""

STATUSES = ("ok", "slipped", "unstable", "aborted", "missing")
"""Statuses of a reading; the position of each is its CF flag value."""

OK = STATUSES.index("ok")
MISSING = STATUSES.index("missing")

JOINT_UNITS = {"rad": "angle", "deg": "angle", "m": "length", "mm": "length"}
"""Units of a joint position, with their dimension: an angle is revolute, a length prismatic."""

SI_JOINT_UNITS = {"angle": "rad", "length": "m"}

MADE_FROM = "made_from"
"""Attribute with the SHA-256 of each file that a dataset was made from, as JSON."""

STATIONS = "stations"
"""Attribute with the poses that each station of the tracker measured, as JSON: a station that moved
counts as another one from there on."""

DOUBTS = "doubts"
"""Attribute with the mistakes that `import` suspected in the readings, as a JSON list of texts."""

ATTRIBUTES = (
    "schema",
    "robot_name",
    "robot_urdf",
    "tcp_frame",
    "marker",
    "gravity",
    "check",
    STATIONS,
    DOUBTS,
    "provenance",
    MADE_FROM,
)
"""Global attributes with a meaning here, in the order in which they are written."""

CF_ATTRIBUTES = (
    "Conventions",
    "title",
    "institution",
    "source",
    "history",
    "references",
    "comment",
)
"""Global attributes that the CF conventions (section 2.6) give every file; carried through."""

CONDITIONED = "conditioned"
"""The attribute ``history`` of a dataset whose every pose began with a full press, made before the
reference was read. Any other text there is a remark, and means that the arm came by free moves."""


@dataclass(frozen=True)
class Variable:
    """A variable of a dataset."""

    name: str
    dims: tuple[str, ...]
    dimension: str
    """Physical dimension, as `elastocal.units` names them."""
    unit: str
    """SI unit in memory and in NetCDF files."""
    meaning: str
    required: bool = False
    schema: str = SCHEMA
    """The first schema that has it."""
    optional_in: str = ""
    """The schema in which it may be absent although it is required."""
    broadcast: bool = False
    """Whether it may come with fewer dimensions, which then are filled with equal values."""

    @property
    def column_unit(self) -> str:
        """The SI unit as a CSV header writes it."""
        return self.unit.replace(" ", "*")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the CSV columns of the three components."""
        return tuple(f"{self.name}_{axis}" for axis in AXES)


_READING = ("pose", "load_case", "axis")

JOINT_POSITION = Variable(
    "joint_position",
    ("pose", "load_case", "joint"),
    "angle",
    "rad",
    "joint positions after the load case has settled",
    required=True,
)

REFERENCE_JOINT_POSITION = Variable(
    "reference_joint_position",
    ("pose", "joint"),
    "angle",
    "rad",
    "joint positions when the zero of both displacements was read",
    schema=SCHEMA_2,
)

LINK_JOINT_POSITION = Variable(
    "link_joint_position",
    ("pose", "load_case", "joint"),
    "angle",
    "rad",
    "positions of the links by secondary encoders; NaN throughout at a joint that has none",
    schema=SCHEMA_2,
)

REFERENCE_LINK_JOINT_POSITION = Variable(
    "reference_link_joint_position",
    ("pose", "joint"),
    "angle",
    "rad",
    "positions of the links by secondary encoders when the zero of both displacements was read",
    schema=SCHEMA_2,
)

ENCODER_VARIABLES = (LINK_JOINT_POSITION, REFERENCE_LINK_JOINT_POSITION)
"""The variables that are NaN throughout at a joint without a secondary encoder."""

JOINT_VARIABLES = (JOINT_POSITION, REFERENCE_JOINT_POSITION, *ENCODER_VARIABLES)
"""The variables that have a value for each joint."""

JOINT_PREFIXES = {
    "reference_link_": REFERENCE_LINK_JOINT_POSITION,
    "reference_": REFERENCE_JOINT_POSITION,
    "link_": LINK_JOINT_POSITION,
}
"""Prefix of a joint's name in the CSV column of a variable, the longest first."""

MARKER_POSITION = Variable(
    "marker_position",
    ("pose", "axis"),
    "length",
    "m",
    "marker that the tracker measures when the zero of both displacements is read, in base",
    schema=SCHEMA_2,
)

VECTORS = (
    Variable("force", _READING, "force", "N", "force on the robot at the TCP, in base", True),
    Variable("moment", _READING, "moment", "N m", "moment on the robot at the TCP, in base"),
    Variable(
        "controller_displacement",
        _READING,
        "length",
        "m",
        "displacement of the TCP (of the marker, if one is named) by the controller, in base",
        required=True,
    ),
    Variable(
        "marker_displacement",
        _READING,
        "length",
        "m",
        "marker displacement that the tracker measures, in base",
        required=True,
        optional_in=SCHEMA_2,
    ),
    Variable(
        "force_sigma", _READING, "force", "N", "standard deviation of the force", broadcast=True
    ),
    Variable(
        "marker_sigma",
        _READING,
        "length",
        "m",
        "standard deviation of the marker displacement",
        broadcast=True,
    ),
    Variable("tcp_position", ("pose", "axis"), "length", "m", "unloaded TCP position in base"),
    MARKER_POSITION,
    Variable(
        "reference_force",
        ("pose", "axis"),
        "force",
        "N",
        "force on the robot at the TCP, in base, when the zero of both displacements was read",
        schema=SCHEMA_2,
    ),
)
"""The variables that have an x, a y and a z."""

VARIABLES = (*JOINT_VARIABLES, *VECTORS)
"""Every variable that holds quantities."""

STATUS = Variable("status", ("pose", "load_case"), "", "", "how the reading went")
SEQUENCE = Variable(
    "sequence",
    ("pose", "load_case"),
    "",
    "",
    "place of the reading in time among those of its pose",
    schema=SCHEMA_2,
)
CONTACTS = Variable(
    "contacts",
    ("pose", "load_case"),
    "",
    "",
    "disks or tips stacked between tool and tooling at the press",
    schema=SCHEMA_2,
)
MOST_CONTACTS = 9
"""Disks or tips that can be stacked; a larger number is a mistake."""
INTEGERS: dict[Variable, DTypeLike] = {STATUS: np.int8, SEQUENCE: np.int64, CONTACTS: np.int8}
"""The variables that hold whole numbers, with their types."""

VARIABLE_NAMES = tuple(variable.name for variable in (*VARIABLES, *INTEGERS))
COORDINATES = ("pose", "load_case", "axis", "joint", "joint_unit", "campaign")

TEXT_COLUMNS = ("pose", "load_case", "status", "sequence", "contacts", "campaign")
"""CSV columns without a unit."""

COLUMN_NAMES = (*TEXT_COLUMNS, *(name for variable in VECTORS for name in variable.columns))
"""Every CSV column but those of the joints."""

_JOINT_NAME = re.compile(r"[^\[\],;\"#\s](?:[^\[\],;\"#]*[^\[\],;\"#\s])?")
SIMILAR = 0.85
"""Similarity (difflib ratio) from which a joint name is taken for a misspelt column."""


def joint_name_problem(name: str) -> str | None:
    """Return why ``name`` cannot name a joint column, or None when it can.

    A joint column is every column that is not known otherwise, so a name that nearly equals a known
    column must be refused: it is a typing error, not a joint.

    >>> joint_name_problem("joint_a1") is None
    True
    >>> joint_name_problem("tcp_positon_x")
    "it is not a joint; did you mean 'tcp_position_x'?"
    """
    if name in (*COLUMN_NAMES, *VARIABLE_NAMES):
        return "the name stands for something else in a dataset"
    if not name.isprintable() or _JOINT_NAME.fullmatch(name) is None:
        return "a joint name is not empty and has no brackets, delimiters, quotes or line breaks"
    similar = difflib.get_close_matches(name, COLUMN_NAMES, n=1, cutoff=SIMILAR)
    return f"it is not a joint; did you mean {similar[0]!r}?" if similar else None


def require_joint_names(names: Sequence[str]) -> None:
    """Refuse joints that no dataset can hold; every reader of a robot to measure calls this.

    Raises
    ------
    DatasetError
        If there is none, or one cannot name a column of its own, or is repeated.
    """
    if not names:
        raise DatasetError("coordinate 'joint' is empty: a robot has at least one joint")
    for name in names:
        if problem := joint_name_problem(name):
            raise DatasetError(f"joint {name!r}: {problem}")
        if any(prefix + other == name for prefix in JOINT_PREFIXES for other in names):
            raise DatasetError(f"joint {name!r}: the name stands for a column of another joint")
    require_unique("joint", names)


def require_labels(kind: str, labels: Iterable[object]) -> None:
    """Refuse labels that a table or a terminal cannot show as they are.

    Parameters
    ----------
    kind : str
        What they name: load case, campaign, station; for the message.

    Raises
    ------
    DatasetError
        With the first that is empty, not printable, or has spaces around it.
    """
    for label in map(str, labels):
        if not label or label != label.strip() or not label.isprintable():
            raise DatasetError(
                f"{kind} {label!r} must be a printable name without spaces around it"
            )


def require_unique(kind: str, labels: Sequence[object]) -> None:
    """Refuse repeated labels.

    Raises
    ------
    DatasetError
        With the first of them and both its places.
    """
    first: dict[object, int] = {}
    for index, label in enumerate(labels):
        if label in first:
            raise DatasetError(
                f"{kind} {label!r} stands twice, at positions {first[label]} and {index}:"
                f" every {kind} needs its own label"
            )
        first[label] = index


def freeze(array: NDArray[np.generic]) -> None:
    """Make an array read-only, so that values do not change under anyone's feet."""
    array.setflags(write=False)


def canonical_attributes(attributes: Mapping[str, object]) -> dict[str, str]:
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
    if not isinstance(schema, str) or schema not in SCHEMAS:
        found = "no attribute 'schema'" if schema is None else f"schema {schema!r}"
        known_schemas = " and ".join(map(repr, SCHEMAS))
        raise SchemaError(f"dataset has {found}; this version reads {known_schemas}")
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
        if name in _VECTOR_ATTRIBUTES:
            read_vector(name, {name: value})
        if name == MADE_FROM:
            read_made_from({name: value})
        if name == STATIONS:
            read_stations({name: value})
        if name == DOUBTS:
            read_doubts({name: value})
    texts = {"robot_name": "", "provenance": "", **attributes}
    return {name: str(texts[name]) for name in known if name in texts}


_NOTHING = 1e-12
"""Number in SI units below which `parse_quantity` reads none."""

_VECTOR_ATTRIBUTES = {
    "marker": ("length", "0 m, 0.04 m, -0.06 m"),
    "gravity": ("acceleration", "0 m/s2, 0 m/s2, -9.81 m/s2"),
}
"""Attributes of three numbers: their dimension, and an example."""


def write_vector(vector: Vector, unit: str = "m") -> str:
    """Return the text of a vector, as the command line takes it; a picometre is nothing.

    >>> write_vector((0.0, 0.04, -0.06))
    '0.0 m, 0.04 m, -0.06 m'
    """
    return ", ".join(
        f"{value if abs(value) >= _NOTHING else 0.0!r} {unit}" for value in map(float, vector)
    )


def read_vector(name: str, attributes: Mapping[str, str]) -> Vector | None:
    """Return three numbers of an attribute, in m or m/s²; None: it is not there.

    Raises
    ------
    DatasetError
        If it is not three quantities with their units.
    """
    if (text := attributes.get(name)) is None:
        return None
    dimension, example = _VECTOR_ATTRIBUTES[name]
    try:
        x, y, z = (parse_quantity(part.strip(), dimension) for part in text.split(","))
    except (UnitError, ValueError) as error:
        raise DatasetError(
            f"attribute {name!r} is {text!r:.60}: it must be three {dimension}s, such as"
            f" {example!r}"
        ) from error
    return x, y, z


def read_made_from(attributes: Mapping[str, str]) -> dict[str, str]:
    """Return the SHA-256 of each file that a dataset was made from, by its name; none: not stated.

    Raises
    ------
    DatasetError
        If it is not JSON of texts.
    """
    text = attributes.get(MADE_FROM, "{}")
    with contextlib.suppress(SchemaError):
        found = parse_json(text, MADE_FROM)
        if isinstance(found, dict) and all(isinstance(each, str) for each in found.values()):
            return found
    raise DatasetError(f"attribute {MADE_FROM!r} is {text!r:.60}: it must be SHA-256s as JSON")


def read_stations(attributes: Mapping[str, str]) -> dict[str, tuple[int, ...]]:
    """Return the poses that each station measured, by its name; none: not stated.

    Raises
    ------
    DatasetError
        If it is not JSON of lists of whole numbers.
    """
    text = attributes.get(STATIONS, "{}")
    with contextlib.suppress(SchemaError):
        found = parse_json(text, STATIONS)
        if isinstance(found, dict) and all(map(_is_poses, found.values())):
            return {name: tuple(poses) for name, poses in found.items()}
    raise DatasetError(f"attribute {STATIONS!r} is {text!r:.60}: it must be lists of poses as JSON")


def write_stations(stations: Mapping[str, Sequence[int]]) -> str:
    """Return the text of the poses that each station measured.

    >>> write_stations({"left": [0, 2]})
    '{"left": [0, 2]}'
    """
    return json.dumps({name: [int(pose) for pose in poses] for name, poses in stations.items()})


def read_doubts(attributes: Mapping[str, str]) -> tuple[str, ...]:
    """Return the mistakes that `import` suspected; none: not stated.

    Raises
    ------
    DatasetError
        If it is not a JSON list of texts.
    """
    text = attributes.get(DOUBTS, "[]")
    with contextlib.suppress(SchemaError):
        found = parse_json(text, DOUBTS)
        if isinstance(found, list) and all(isinstance(each, str) for each in found):
            return tuple(found)
    raise DatasetError(f"attribute {DOUBTS!r} is {text!r:.60}: it must be a list of texts as JSON")


def write_doubts(doubts: Iterable[str]) -> dict[str, str]:
    """Return the attribute of some mistakes, each once; none without any."""
    once = list(dict.fromkeys(doubts))
    return {DOUBTS: json.dumps(once)} if once else {}


def _is_poses(value: object) -> bool:
    return isinstance(value, list) and all(type(each) is int for each in value)


def _storable(text: str) -> bool:
    """Return whether a NetCDF file can hold a text: UTF-8, without the zero that ends it in C."""
    return "\0" not in text and not any("\ud800" <= letter <= "\udfff" for letter in text)
