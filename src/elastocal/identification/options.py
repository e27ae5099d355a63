"""Choices of a user about a fit: bounds, weights, loss, prior.

A loss is a weight for iterative reweighting (Huber, *Robust Statistics*, 1981). It sees the norm
``u`` of a reading's three residual components in units of one component's robust standard
deviation, so that for normal noise ``u`` follows a chi distribution with three degrees of freedom;
the constants are quantiles of that. A new one is a function and an entry in `LOSSES`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.errors import IdentificationError, nearest
from elastocal.identification.contact import Contact
from elastocal.options import Exclude, Marker, Option
from elastocal.plugins import Registry
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.units import parse_number

Weights = Literal["none", "sigma"]
_WEIGHTS: tuple[Weights, ...] = get_args(Weights)
FreeFrame = Literal["none", "load_case", "campaign"]
_FREE_FRAMES: tuple[FreeFrame, ...] = get_args(FreeFrame)


@brief_repr
@dataclass(frozen=True)
class Prior:
    """Knowledge of the compliances before the data, e.g. from last year's calibration.

    Adds the rows ``noise / sigma * (rows c - mean)`` to the least-squares system.
    """

    mean: ArrayLike
    """Expected compliances, shape (spring,), in rad/(N·m) or m/N."""
    sigma: ArrayLike
    """Their standard deviations, same shape and unit."""
    noise: float
    """Standard deviation of one component of a deflection that the prior is weighed against,
    in m."""
    rows: ArrayLike | None = None
    """Sums of compliances to which mean and sigma refer, shape (sum, spring); None: single ones."""


@brief_repr
@dataclass(frozen=True)
class FitOptions:
    """Options of the identification; the defaults are the paper's (Eq. 19, `lsqlin`)."""

    lower: ArrayLike = 0.0
    """Lower bound, a number or shape (parameter,). The number zero, the default, means what each
    parameter's kind of spring says: zero for compliances, since on few poses an unbounded fit of
    18 springs is worse than one of 6."""
    upper: ArrayLike = np.inf
    """Upper bound, of the same shape and unit."""
    weights: Weights = "none"
    """``sigma``: weigh by the measured standard deviations of the dataset."""
    loss: str = "linear"
    """One of `LOSSES`; anything but ``linear`` is solved by reweighting."""
    prior: Prior | None = None
    set_blunders_aside: bool = True
    """Leave readings out of the fit that cannot be measurements of this robot (see
    `suspicious`); they are always named."""
    trust_conventions: bool = False
    """Fit also data that would fit far better with a sign or frame read otherwise."""
    free_frame: FreeFrame = "none"
    """Sessions whose frames of tracker and marker are estimated with the springs; see
    `elastocal.identification.frames`."""
    contact: Contact | None = None
    """What is known of the contact that holds the tool where no tracker measured; None: nothing,
    and readings without metrology are refused. See `elastocal.identification.contact`."""
    encoders: bool = True
    """Whether positions of the links by secondary encoders are rows of the fit; see
    `elastocal.identification.encoders`."""
    draws: int = 200
    """Number of pose-block bootstrap draws."""

    def __post_init__(self) -> None:
        LOSSES.named(self.loss)
        if self.weights not in _WEIGHTS:
            raise IdentificationError(
                f"unknown weights {self.weights!r} (allowed: {', '.join(_WEIGHTS)})"
            )
        if self.free_frame not in _FREE_FRAMES:
            raise IdentificationError(
                f"unknown free frame {self.free_frame!r}{nearest(self.free_frame, _FREE_FRAMES)}"
                f" (allowed: {', '.join(_FREE_FRAMES)})"
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
    try:
        # The coupling of two axes is in either sense at most the larger compliance about one of
        # them.
        least = np.maximum(natural, -np.asarray(options.upper, dtype=float))
        wanted = (least if zero else options.lower, options.upper)
        lower, upper = (
            np.broadcast_to(np.asarray(each, dtype=float), (parameters,)) for each in wanted
        )
    except ValueError as error:
        raise IdentificationError(
            f"bounds must be a number or one number for each of the {parameters} parameters"
        ) from error
    bad = np.flatnonzero(~((lower <= upper) & (lower < np.inf) & (upper > -np.inf)))
    if len(bad):
        raise IdentificationError(
            f"bounds exclude everything: parameter {bad[0] + 1} of {parameters} would have to lie"
            f" between {lower[bad[0]]:g} and {upper[bad[0]]:g}"
        )
    return lower, upper


@brief_repr
@record(kw_only=True)
class FitSettings:
    """Choices of a user about springs, readings and fit; the defaults are the paper's."""

    springs: Annotated[str, Option(choices="springs", file=True)] = "auto"
    """Spring layout: a name, or a YAML file; ``auto``: the model that the readings carry."""
    loss: Annotated[str, Option(choices="loss", help="How much readings far off count.")] = "linear"
    """``linear``, ``huber`` or ``cauchy``."""
    weights: Annotated[
        Weights, Option(choices="weights", help="Weigh readings by the dataset's sigmas.")
    ] = "none"
    """``sigma``: weigh by the measured standard deviations of the dataset."""
    bounds: Annotated[
        str | tuple[float, float], Option(help="Lowest and highest compliance in SI units.")
    ] = "0,inf"
    """Lowest and highest compliance in SI units: two numbers, or a text of them; kept as a text,
    since JSON has no infinity."""
    marker: Marker = None
    """Metrology marker in the tcp frame, in m; none: the dataset's."""
    exclude: Exclude = ()
    """Readings left out by name, ``POSE`` or ``POSE:LOAD_CASE``."""
    keep_blunders: bool = False
    """Fit also what cannot be a measurement."""
    trust_conventions: bool = False
    """Fit data that fit far better with a sign read otherwise."""
    free_frame: Annotated[
        FreeFrame,
        Option(choices="free frame", help="Estimate a frame of tracker and marker for each."),
    ] = "none"
    """``load_case`` or ``campaign``: estimate a frame of tracker and marker for each."""
    contact: Contact | None = None
    """What is known of the contact that holds the tool where no tracker measured."""
    ignore_encoders: bool = False
    """Leave positions of the links by secondary encoders out of the fit."""
    draws: Annotated[int, Option(most=100_000)] = 200
    """Bootstrap draws."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of the bootstrap."""

    def __post_init__(self) -> None:
        """Refuse invalid bounds.

        Raises
        ------
        IdentificationError
            If they are not two numbers, or one is NaN.
        """
        low, high = parse_bounds(self.bounds)
        if not isinstance(self.bounds, str):
            object.__setattr__(self, "bounds", f"{low!r},{high!r}")

    def options(self, draws: int | None = None) -> FitOptions:
        """Return the options of the fit.

        Parameters
        ----------
        draws : int, optional
            Another number of bootstrap draws.

        Raises
        ------
        IdentificationError
            If one of them is not allowed.
        """
        lower, upper = parse_bounds(self.bounds)
        return FitOptions(
            lower=lower,
            upper=upper,
            weights=self.weights,
            loss=self.loss,
            set_blunders_aside=not self.keep_blunders,
            trust_conventions=self.trust_conventions,
            free_frame=self.free_frame,
            contact=self.contact,
            encoders=not self.ignore_encoders,
            draws=self.draws if draws is None else draws,
        )


def parse_bounds(bounds: str | Sequence[float]) -> tuple[float, float]:
    """Return two bounds from ``"LOW,HIGH"`` or two numbers.

    >>> parse_bounds("0,inf"), parse_bounds((0, 1))
    ((0.0, inf), (0.0, 1.0))

    Raises
    ------
    IdentificationError
        If they are not two numbers, or one is NaN.
    """
    parts = [each.strip() for each in bounds.split(",")] if isinstance(bounds, str) else bounds
    try:
        low, high = (parse_number(str(part)) for part in parts)
    except (TypeError, ValueError) as error:
        raise IdentificationError(f"bounds {bounds!r} must be two numbers, e.g. '0,inf'") from error
    for part, value in zip(parts, (low, high), strict=True):
        if math.isnan(value):
            raise IdentificationError(f"bounds {bounds!r}: {part!r} is not a number")
    return low, high


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


LOSSES: Registry[Callable[[FloatArray], FloatArray]] = Registry(
    "loss", {"linear": linear, "huber": huber, "cauchy": cauchy}, IdentificationError
)
"""Losses by name."""
