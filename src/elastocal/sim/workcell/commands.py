"""Checks of what a simulated device is asked for."""

import math

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError

_UNIT = 1e-6
"""How far the length of a direction may be from 1."""


def require(holds: bool, what: str, value: object, allowed: str) -> None:
    """Refuse a value.

    Raises
    ------
    DeviceError
        Naming it and what is allowed.
    """
    if not holds:
        raise DeviceError(f"simulated arm: {what} is {value}: must be {allowed}")


def check_vector(what: str, values: FloatArray, size: int, *, unit: bool = False) -> FloatArray:
    """Return numbers as an array of their own.

    Parameters
    ----------
    what : str
        How the message names them.
    values : ndarray, shape (size,)
        Finite.
    size : int
        How many there must be.
    unit : bool
        Whether they must be a unit vector; it is then made one exactly.

    Raises
    ------
    DeviceError
        If they are not as they must be.
    """
    array = np.array(values, dtype=float)
    fits = array.shape == (size,) and bool(np.all(np.isfinite(array)))
    require(fits, what, array.tolist(), f"{size} finite numbers")
    if unit:
        length = float(np.linalg.norm(array))
        require(abs(length - 1.0) <= _UNIT, f"length of the {what}", length, "1")
        array /= length
    return array


def check_distance(what: str, distance: float, speed: float) -> None:
    """Refuse a way or a speed that is not above 0 and finite.

    Raises
    ------
    DeviceError
        Naming it.
    """
    require(0.0 < distance < math.inf, f"{what} distance", distance, "above 0 m and finite")
    require(0.0 < speed < math.inf, f"{what} speed", speed, "above 0 m/s and finite")
