"""Readings that a user leaves out by name."""

from collections.abc import Sequence

import numpy as np

from elastocal.dataset.readings import Readings
from elastocal.errors import DatasetError, nearest


def without(readings: Readings, excluded: Sequence[str]) -> Readings:
    """Return the readings without those named ``POSE`` or ``POSE:LOAD_CASE``.

    Raises
    ------
    DatasetError
        If a name matches no reading, or none is left.
    """
    keep = np.ones(len(readings), dtype=bool)
    for name in excluded:
        keep &= ~_named(readings, name)
    if not np.any(keep):
        raise DatasetError(f"--exclude {' '.join(excluded)} leaves no reading")
    return readings.take(keep)


def _named(readings: Readings, name: str) -> np.ndarray:
    pose, _, load_case = name.partition(":")
    try:
        mask = readings.pose == int(pose)
    except ValueError as error:
        raise DatasetError(f"--exclude {name!r} must be POSE or POSE:LOAD_CASE") from error
    if not np.any(mask):
        raise DatasetError(f"--exclude {name!r}: there is no usable reading at pose {pose}")
    if load_case:
        cases = sorted(set(readings.load_case[mask].tolist()))
        mask &= readings.load_case == load_case
        if not np.any(mask):
            raise DatasetError(
                f"--exclude {name!r}: pose {pose} has no load case {load_case!r}"
                f"{nearest(load_case, cases)} (it has {', '.join(cases)})"
            )
    return np.asarray(mask)
