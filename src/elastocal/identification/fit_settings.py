"""The settings of a calibration that decide its figures, as a model file keeps them.

With these and the dataset, anybody can make the calibration again and see whether it comes out
the same.
"""

from elastocal.errors import IdentificationError
from elastocal.identification.options import FitOptions, Weights
from elastocal.records import record


@record(kw_only=True)
class FitSettings:
    """What a user chose about springs, readings and fit; the defaults are the paper's."""

    springs: str = "bearing"
    """Spring layout: a name, or a YAML file."""
    loss: str = "linear"
    """``linear``, ``huber`` or ``cauchy``."""
    weights: Weights = "none"
    """``sigma``: weigh by the measured standard deviations of the dataset."""
    bounds: str = "0,inf"
    """Lowest and highest compliance in SI units."""
    marker: tuple[float, float, float] | None = None
    """Metrology marker in the tcp frame, in m; none: the dataset's."""
    exclude: tuple[str, ...] = ()
    """Readings left out by name, ``POSE`` or ``POSE:LOAD_CASE``."""
    keep_blunders: bool = False
    """Fit also what cannot be a measurement."""
    trust_conventions: bool = False
    """Fit data that fit far better with a sign read otherwise."""
    draws: int = 200
    """Bootstrap draws."""
    seed: int = 0
    """Seed of the bootstrap."""

    def __post_init__(self) -> None:
        """Refuse bounds that are none.

        Raises
        ------
        IdentificationError
            If they are not two numbers.
        """
        parse_bounds(self.bounds)

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
            draws=self.draws if draws is None else draws,
        )


def parse_bounds(text: str) -> tuple[float, float]:
    """Return two bounds from ``"LOW,HIGH"``.

    >>> parse_bounds("0,inf")
    (0.0, inf)

    Raises
    ------
    IdentificationError
        If the text is not two numbers.
    """
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError as error:
        raise IdentificationError(f"bounds {text!r} must be two numbers, e.g. '0,inf'") from error
    return low, high
