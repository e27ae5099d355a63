"""Numbers in the report's own form."""

import math
from collections.abc import Sequence


def mm(metres: float, digits: int = 3) -> str:
    """Return a length in mm.

    >>> mm(0.0001234)
    '0.123 mm'
    """
    return f"{1e3 * metres:.{digits}f} mm" if math.isfinite(metres) else "not known"


def um(metres: float) -> str:
    """Return a length in µm.

    >>> um(17.2e-6)
    '17.2 µm'
    """
    return f"{1e6 * metres:.1f} µm"


def counted(number: int, name: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "pose"), counted(3, "pose")
    ('1 pose', '3 poses')
    """
    return f"{number} {name}{'' if number == 1 else 's'}"


def point(values: Sequence[float | None], scale: float = 1e3, digits: int = 1) -> str:
    """Return coordinates, in mm unless scaled otherwise.

    >>> point([0.1, 0.0, -0.0905])
    '100.0, 0.0, -90.5'
    """
    return ", ".join(
        "?" if v is None else f"{round(scale * v, digits) + 0.0:.{digits}f}" for v in values
    )


def spans(numbers: Sequence[int]) -> str:
    """Return whole numbers with runs shortened.

    >>> spans([0, 1, 2, 5])
    '0 to 2, 5'
    """
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    said = (f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)
    return ", ".join(said)
