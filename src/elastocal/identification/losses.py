"""Loss functions as weights for iterative reweighting (Huber, *Robust Statistics*, 1981).

A loss sees the norm ``u`` of a reading's three residual components in units of one component's
robust standard deviation, so that for normal noise ``u`` follows a chi distribution with three
degrees of freedom. The constants are quantiles of that distribution.
"""

from collections.abc import Callable

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError, nearest

MEDIAN_NORM = 1.5381722544550522
"""Median of the chi distribution with three degrees of freedom."""
_HUBER_CORNER = 2.5
"""About the 90 % quantile (2.500): every tenth reading of normal noise loses weight."""
_CAUCHY_SCALE = 2.5


def linear(u: FloatArray) -> FloatArray:
    """Least squares: weight 1."""
    return np.ones_like(u)


def huber(u: FloatArray) -> FloatArray:
    """Huber: weight ``min(1, k / u)``; a blunder keeps a bounded pull."""
    return _HUBER_CORNER / np.maximum(u, _HUBER_CORNER)


def cauchy(u: FloatArray) -> FloatArray:
    """Cauchy: weight ``1 / (1 + (u / k)^2)``; the pull of a blunder fades out."""
    return np.asarray(1.0 / (1.0 + np.square(u / _CAUCHY_SCALE)))


LOSSES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "linear": linear,
    "huber": huber,
    "cauchy": cauchy,
}


def check_loss(name: str) -> None:
    """Refuse an unknown loss by name.

    Raises
    ------
    IdentificationError
        With the known ones.
    """
    if name not in LOSSES:
        raise IdentificationError(
            f"unknown loss {name!r}{nearest(name, LOSSES)} (allowed: {', '.join(LOSSES)})"
        )
