"""Statements as text: sums of products read the same in C and in Python."""

from collections.abc import Callable

from elastocal.compensation.kernel.program import Assignment, Value

Naming = Callable[[str], str]
"""From the name of a value to how it is written."""


def sum_text(assignment: Assignment, naming: Naming = str) -> str:
    """Return the right side of an assignment, every product in parentheses, left to right."""
    parts: list[str] = []
    for sign, factors in assignment.terms:
        product = " * ".join(map(naming, factors)) or "1.0"
        alone = len(assignment.terms) == 1
        term = product if len(factors) < 2 or (alone and sign > 0) else f"({product})"
        if not parts:
            parts.append(term if sign > 0 else f"-{term}")
        else:
            parts.append(f"{'+' if sign > 0 else '-'} {term}")
    return " ".join(parts)


def value_text(value: Value, naming: Naming = str) -> str:
    """Return a value by itself."""
    if not value.name:
        return repr(float(value.sign))
    return naming(value.name) if value.sign > 0 else f"-{naming(value.name)}"
