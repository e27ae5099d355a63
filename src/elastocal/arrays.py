"""Names for the arrays that pass between modules, and how a record's file holds them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

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
            array = np.array(value)
        except ValueError as error:
            raise ValueError("rows must have one length") from error
        if array.size and array.dtype.kind not in _ACCEPTED[self.kind]:
            raise ValueError(f"must be {_WORDS[self.kind]}")
        array = array.astype(self.kind)
        if self.kind == "f8" and not np.all(np.isfinite(array)):
            raise ValueError("must be finite numbers")
        array.flags.writeable = False
        return array


_ACCEPTED = {"f8": "fiu", "i8": "iu", "?": "b"}
_WORDS = {"f8": "numbers", "i8": "whole numbers", "?": "true or false"}

FloatArray = Annotated[NDArray[np.float64], _ArrayField("f8")]
IndexArray = Annotated[NDArray[np.intp], _ArrayField("i8")]
BoolArray = Annotated[NDArray[np.bool_], _ArrayField("?")]
