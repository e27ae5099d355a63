"""Several arrays with a row for each of the same things, such as postures or points."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike


class Rows:
    """Base of frozen dataclasses whose fields are arrays of equal length."""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self._columns()[0])

    def take(self, index: ArrayLike) -> Self:
        """Return some of the rows (a mask or numbers)."""
        rows = np.asarray(index)
        rows = rows.astype(np.intp) if rows.size == 0 else rows
        return type(self)(*(column[rows] for column in self._columns()))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of several, one after the other."""
        columns = zip(*(part._columns() for part in parts), strict=True)
        return cls(*map(np.concatenate, columns))

    def _columns(self) -> tuple[Any, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))  # type: ignore[arg-type]
