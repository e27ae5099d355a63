"""Names for the arrays that pass between modules, and how a record's file holds them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from elastocal.errors import described_type

if TYPE_CHECKING:
    from pydantic_core import CoreSchema


@dataclass(frozen=True)
class _ArrayField:
    """An array as lists of numbers in a file; read, it is a copy that cannot be written to."""

    kind: str

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> "CoreSchema":
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self._read)

    def _read(self, value: Any) -> NDArray[Any]:
        try:
            # A text among numbers would give every item of the array the room of the longest.
            array = np.array(None if _holds_text(value) else value)
        except ValueError:
            array = np.array(None)
        if array.size and array.dtype.kind not in _ACCEPTED[self.kind]:
            raise self._refusal(value)
        array = array.astype(self.kind)
        if self.kind == "f8" and not np.all(np.isfinite(array)):
            raise self._refusal(value)
        array.flags.writeable = False
        return array

    def _refusal(self, value: Any) -> Exception:
        """Return an error that names the position of the first wrong item."""
        from pydantic_core import PydanticCustomError

        at, given = _first_wrong(value, _ITEMS[self.kind], [])
        reason = "rows must have one length" if at is None else f"must be {_WORDS[self.kind]}"
        where = {"at": at or [], "given": given}
        return PydanticCustomError("array", reason, where)


def _holds_text(value: Any) -> bool:
    """Return whether a text is among items, however deep."""
    return isinstance(value, str) or (isinstance(value, list) and any(map(_holds_text, value)))


def _first_wrong(
    value: Any, kinds: tuple[type, ...], at: list[int]
) -> tuple[list[int] | None, Any]:
    """Return the position of the first item of a wrong type; None if only the lengths differ."""
    if not isinstance(value, list):
        fits = type(value) in kinds and (type(value) is not float or np.isfinite(value))
        return (None if fits else at), value
    for index, item in enumerate(value):
        found, given = _first_wrong(item, kinds, [*at, index])
        if found is not None:
            return found, given
    return None, value


_ACCEPTED = {"f8": "fiu", "i8": "iu", "?": "b"}
_ITEMS = {"f8": (float, int), "i8": (int,), "?": (bool,)}
_WORDS = {"f8": "a finite number", "i8": "a whole number", "?": "true or false"}

FloatArray = Annotated[NDArray[np.float64], _ArrayField("f8")]
IndexArray = Annotated[NDArray[np.intp], _ArrayField("i8")]
BoolArray = Annotated[NDArray[np.bool_], _ArrayField("?")]

Triple = tuple[float, float, float]
"""A vector of three in a record, whose file holds plain numbers."""


def as_numbers(value: object, name: str) -> FloatArray:
    """Return an argument of a public function as an array of floats.

    Raises
    ------
    TypeError
        If it is no array of real numbers. The message names the argument and what it is.
    """
    try:
        array = np.asarray(value)
        if not np.iscomplexobj(array):
            return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        pass
    raise TypeError(f"{name} is {described_type(value)} (allowed: real numbers, in an array)")


def triple(vector: FloatArray) -> Triple:
    """Return a vector, shape (3,), as plain numbers."""
    x, y, z = map(float, vector)
    return x, y, z


def are_multiples(values: FloatArray, step: float, within: float) -> bool:
    """Return whether values, one at least, miss multiples of a step by less than a part of it."""
    steps = values / step
    return bool(np.abs(steps - np.round(steps)).max() < within)


def longest_run(values: FloatArray) -> slice:
    """Return the most rows, one after the other, that hold the same number."""
    ends = np.concatenate([[0], np.flatnonzero(np.diff(values) != 0.0) + 1, [len(values)]])
    longest = int(np.argmax(np.diff(ends)))
    return slice(int(ends[longest]), int(ends[longest + 1]))
