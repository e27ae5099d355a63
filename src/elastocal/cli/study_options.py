"""Options of ``study`` that a person types."""

from collections.abc import Sequence

from elastocal.cell import Cell
from elastocal.cell.description import DEFAULT_POSES
from elastocal.codec.study import Condition, make_conditions, read_variations
from elastocal.errors import CodecError, UnitError
from elastocal.units import parse_quantity

DEFAULT_VARIATION = "poses=6,10,15,20,31"
"""What is varied when nothing is said."""


def study_conditions(cell: Cell, vary: Sequence[str]) -> tuple[Condition, ...]:
    """Return the conditions of a study; what is not varied is as the cell file has it.

    Raises
    ------
    CodecError, PlanningError
        If a factor or a value is unknown.
    """
    search = cell.file.search
    base = Condition(poses=search.most or DEFAULT_POSES, search=search.technique)
    return make_conditions(read_variations(vary or [DEFAULT_VARIATION]), base)


def parse_target(text: str | None) -> float | None:
    """Return a target in m from a length with its unit.

    >>> parse_target("0.05 mm")
    5e-05

    Raises
    ------
    CodecError
        If the text is not a length above 0.
    """
    if text is None:
        return None
    try:
        length = parse_quantity(text, "length")
    except UnitError as error:
        raise CodecError(f"--target: {error}") from error
    if not length > 0.0:
        raise CodecError(f"--target {text!r}: must be above 0")
    return length
