"""What a user may choose about a fit."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError
from elastocal.identification.losses import check_loss

Weights = Literal["none", "sigma"]
WEIGHTS: tuple[Weights, ...] = get_args(Weights)


@dataclass(frozen=True)
class Prior:
    """What is known of the compliances before the data, e.g. from last year's calibration.

    Adds the rows ``noise / sigma * (c - mean)`` to the least-squares system.
    """

    mean: ArrayLike
    """Expected compliances, shape (spring,), in rad/(N·m) or m/N."""
    sigma: ArrayLike
    """Their standard deviations, same shape and unit."""
    noise: float
    """Standard deviation of one component of a deflection that the prior is weighed against,
    in m."""


@dataclass(frozen=True)
class FitOptions:
    """Options of the identification; the defaults are the paper's (Eq. 19, `lsqlin`)."""

    lower: ArrayLike = 0.0
    """Lower bound, a number or shape (parameter,). The number zero, the default, means what each
    parameter's kind of spring says: zero for compliances, since on few poses an unbounded fit of
    18 springs is worse than one of 6."""
    upper: ArrayLike = np.inf
    """Upper bound, likewise."""
    weights: Weights = "none"
    """``sigma``: weigh by the measured standard deviations of the dataset."""
    loss: str = "linear"
    """One of `losses.LOSSES`; anything but ``linear`` is solved by reweighting."""
    prior: Prior | None = None
    set_blunders_aside: bool = True
    """Leave readings out of the fit that cannot be measurements of this robot (see
    `suspicious`); they are always named."""
    trust_conventions: bool = False
    """Fit also data that would fit far better with a sign or frame read otherwise."""
    draws: int = 200
    """Number of pose-block bootstrap draws."""

    def __post_init__(self) -> None:
        check_loss(self.loss)
        if self.weights not in WEIGHTS:
            raise IdentificationError(
                f"unknown weights {self.weights!r} (allowed: {', '.join(WEIGHTS)})"
            )
        if not self.draws >= MINIMUM_DRAWS or self.draws != int(self.draws):
            raise IdentificationError(
                f"{self.draws} bootstrap draws: at least {MINIMUM_DRAWS} make a 95 % interval"
            )


MINIMUM_DRAWS = 40
"""Fewest draws that leave one beyond each end of a 95 % interval."""


def bounds(
    options: FitOptions, parameters: int, natural: ArrayLike = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper bounds, each of shape (parameter,).

    Parameters
    ----------
    options : FitOptions
        What the user chose.
    parameters : int
        Number of parameters.
    natural : array_like, shape (parameter,), optional
        Smallest values that make sense to each: what a lower bound of zero means.

    Raises
    ------
    IdentificationError
        If a bound has another shape, is NaN, or a lower bound exceeds the upper one.
    """
    zero = np.ndim(options.lower) == 0 and options.lower == 0.0
    wanted = (natural if zero else options.lower, options.upper)
    try:
        lower, upper = (
            np.broadcast_to(np.asarray(each, dtype=float), (parameters,)) for each in wanted
        )
    except ValueError as error:
        raise IdentificationError(
            f"bounds must be a number or one number for each of the {parameters} springs"
        ) from error
    bad = np.flatnonzero(~((lower <= upper) & (lower < np.inf) & (upper > -np.inf)))
    if len(bad):
        raise IdentificationError(
            f"bounds exclude everything: spring {bad[0] + 1} of {parameters} would have to lie"
            f" between {lower[bad[0]]:g} and {upper[bad[0]]:g}"
        )
    return lower, upper
