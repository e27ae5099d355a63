"""Conditions of a study, and what it may vary: a short list, each factor with its unit.

A new factor is an entry in `FACTORS`, a field of `Condition`, and its effect in the simulation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from elastocal.codec.variants import ALL_LOADS, values_by_key
from elastocal.errors import CodecError, ElastocalError, nearest
from elastocal.planning.search import technique
from elastocal.records import record
from elastocal.units import parse_number

Value = int | float | str
_LARGEST_SCALE = 100.0
"""Largest factor on the instruments' errors."""
_LARGEST_SPREAD = 1.0
"""Standard deviation of the logarithm of a stiffness: a factor of 2.7 in either direction."""


@dataclass(frozen=True)
class Factor:
    """One thing that a study may vary."""

    allowed: str
    """Allowed values, in words."""
    unit: str
    """Unit of a column header; empty for names and counts."""
    read: Callable[[str], Value]
    """Returns a value from its text.

    Raises
    ------
    ValueError
        If the text is invalid.
    """


def _count(text: str) -> int:
    parse_number(text)
    value = int(text)
    if not value >= 1:
        raise ValueError
    return value


def _number(largest: float) -> Callable[[str], float]:
    def read(text: str) -> float:
        value = parse_number(text)
        if not 0.0 <= value <= largest:
            raise ValueError
        return value + 0.0

    return read


def _technique(text: str) -> str:
    technique(text)
    return text


_SCALE = Factor(f"a factor from 0 to {_LARGEST_SCALE:g}", "1", _number(_LARGEST_SCALE))
FACTORS: dict[str, Factor] = {
    "poses": Factor("a number of calibration poses, 1 or more", "", _count),
    "search": Factor("a search technique", "", _technique),
    "load_cases": Factor("'all', or load cases of the cell joined by '+'", "", str),
    "springs": Factor("springs as for calibrate, or a .yaml file", "", str),
    "tracker_noise": _SCALE,
    "force_noise": _SCALE,
    "truth": Factor(
        f"spread of the stiffness, a standard deviation from 0 to {_LARGEST_SPREAD:g} of its"
        " natural logarithm",
        "1",
        _number(_LARGEST_SPREAD),
    ),
}
"""Factors by name, in the order of the results' columns."""


@record()
class Condition:
    """One value of every factor."""

    poses: int
    """Number of calibration poses."""
    search: str = "cover"
    """Technique that chooses them; one of `planning.search.TECHNIQUES`."""
    load_cases: str = ALL_LOADS
    """Load cases of the calibration: ``all``, or names joined by ``+``."""
    springs: str = "bearing"
    """As for `calibrate`: the name of a layout, ``gears``, ``auto``, or a YAML file. A choice is
    made in each sample from its own readings, as on a real arm, and takes some three times as
    long."""
    tracker_noise: float = 1.0
    """Factor on the tracker's noise in the cell file."""
    force_noise: float = 1.0
    """Factor on noise, drift and cross-talk of the force sensor in the cell file."""
    truth: float = 0.2
    """Variation among arms of one type: standard deviation of the logarithm of every stiffness
    about that of the cell file. The default, some 20 %, is an assumption."""

    def value(self, factor: str) -> Value:
        """Return the value of a factor by its name in `FACTORS`."""
        value: Value = getattr(self, factor)
        return value


def read_variation(text: str) -> tuple[str, tuple[Value, ...]]:
    """Return factor and values of ``"KEY=A,B"``.

    >>> read_variation("poses=10, 20")
    ('poses', (10, 20))

    Raises
    ------
    CodecError, PlanningError
        If the factor is unknown, or a value is missing, repeated or impossible.
    """
    key, _, listed = text.partition("=")
    key = key.strip()
    if key not in FACTORS:
        raise CodecError(
            f"--vary {text!r}: unknown factor {key!r}{nearest(key, FACTORS)}"
            f" (known: {', '.join(FACTORS)})"
        )
    values = tuple(_value(key, part.strip()) for part in listed.split(","))
    if len(set(values)) < len(values):
        raise CodecError(f"--vary {text!r}: a value stands twice")
    return key, values


def read_variations(texts: Sequence[str]) -> dict[str, tuple[Value, ...]]:
    """Return the values of every factor that is varied; see `read_variation`.

    Raises
    ------
    CodecError
        Also if a factor is repeated.
    """
    return values_by_key("--vary", texts, read_variation)


def make_conditions(
    variations: Mapping[str, Sequence[Value]], base: Condition
) -> tuple[Condition, ...]:
    """Return every combination of the varied values; the other factors are those of ``base``."""
    columns = {key: variations.get(key, (base.value(key),)) for key in FACTORS}
    # The values have been read by their factors, so their types are the fields'.
    return tuple(
        Condition(**dict(zip(columns, values, strict=True)))  # type: ignore[arg-type]
        for values in product(*columns.values())
    )


def condition_name(factors: Sequence[str], condition: Condition) -> str:
    """Return a name of some factors' values, e.g. ``"poses 10, springs bearing"``."""
    values = (f"{key.replace('_', ' ')} {value_text(condition.value(key))}" for key in factors)
    return ", ".join(values) or f"poses {condition.poses}"


def value_text(value: Value) -> str:
    """Return a factor's value as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _value(key: str, text: str) -> Value:
    factor = FACTORS[key]
    refusal = CodecError(f"--vary {key}: {text!r} is not {factor.allowed}")
    if not text:
        raise refusal
    try:
        return factor.read(text)
    except ElastocalError:
        raise
    except ValueError as error:
        raise refusal from error
