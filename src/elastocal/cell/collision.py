"""Finds that a tool which moves freely has hit something, by the force that it feels."""

import math
from collections import deque

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import DeviceError


class CollisionWatch:
    """Holds the force that is measured on a free move against the tool's weight.

    In free air the sensor feels the tool's weight, which turns with the tool, and a bias, which
    stays. What is left when the weight is taken off hardly changes while the arm moves slowly: a
    change of it within a short time by more than the limit is a collision, and so is a slow one
    that grows beyond the largest. Accelerating the tool counts too, so that the limit must be above
    mass times acceleration of the fastest free move.

    Parameters
    ----------
    weight_base : ndarray, shape (3,)
        Weight of the tool, in base, in N.
    limit : float
        Change within the window, in N.
    largest : float
        Change since `restart`, in N; by default none counts.
    window : float
        In s.
    """

    def __init__(
        self,
        weight_base: FloatArray,
        limit: float,
        largest: float = math.inf,
        window: float = 0.05,
    ) -> None:
        if not limit > 0.0:
            raise DeviceError(f"collision force is {limit:g} N: must be above 0 N")
        self._weight_base, self._window = weight_base, window
        self._limit, self._largest = limit, largest
        self._rest: deque[tuple[float, FloatArray]] = deque()
        self._first: FloatArray | None = None

    def restart(self) -> None:
        """Forget what was felt before: something else moves now."""
        self._rest.clear()
        self._first = None

    def departure(self, force_sensor: FloatArray, R_base_sensor: FloatArray) -> float:
        """Return the deviation of a force from its initial value, weight removed, in N."""
        if self._first is None:
            return math.inf
        rest = force_sensor - R_base_sensor.T @ self._weight_base
        return float(np.linalg.norm(rest - self._first))

    def look(self, time: float, force_sensor: FloatArray, R_base_sensor: FloatArray) -> str | None:
        """Return the collision in words; None when there was none.

        Parameters
        ----------
        time : float
            In s.
        force_sensor : ndarray, shape (3,)
            As measured, in N.
        R_base_sensor : ndarray, shape (3, 3)
            Orientation of the sensor.
        """
        # In the sensor's axes, where its bias stays.
        rest = force_sensor - R_base_sensor.T @ self._weight_base
        if self._first is None:
            self._first = rest
        while self._rest and time - self._rest[0][0] > self._window:
            self._rest.popleft()
        self._rest.append((time, rest))
        change = float(np.linalg.norm(rest - self._rest[0][1]))
        if not change <= self._limit:
            return (
                f"the force changed by {change:.0f} N within {1e3 * self._window:.0f} ms"
                f" while moving freely, limit {self._limit:.0f} N"
            )
        grown = float(np.linalg.norm(rest - self._first))
        if not grown <= self._largest:
            return (
                f"the force is {grown:.0f} N off the tool's weight while moving freely,"
                f" limit {self._largest:.0f} N"
            )
        return None
