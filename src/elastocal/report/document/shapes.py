"""What the report needs of files whose form is free: checked, so that no section stumbles.

Keys that are not used here may be there; those that are must be of the right kind.
"""

from typing import Any

from pydantic import ConfigDict, FiniteFloat

from elastocal.errors import SchemaError
from elastocal.records import StrictModel, validate

Number = FiniteFloat | None
Numbers = tuple[Number, ...]


class _Loose(StrictModel):
    """A part of a file of which other keys are left alone."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class _Suspicious(_Loose):
    pose: int
    load_case: str
    score: float
    residual: float
    leverage: float
    set_aside: bool


class _Split(_Loose):
    mean: float
    max: float
    readings: int
    folds: int


class _Difference(_Loose):
    mean: float
    low: float
    high: float


class _Comparison(_Loose):
    springs: str
    held_out: _Split
    difference: _Difference


class _Residual(_Loose):
    mean: float


class _Settings(_Loose):
    springs: str = "bearing"
    loss: str = "linear"
    weights: str = "none"
    bounds: str = "0,inf"
    marker: tuple[float, float, float] | None = None
    exclude: tuple[str, ...] = ()
    keep_blunders: bool = False
    trust_conventions: bool = False


class _Figures(_Loose):
    """Of a calibration; all may be missing, as a program may write a model without them."""

    suspicious: tuple[_Suspicious, ...] = ()
    warnings: tuple[str, ...] = ()
    held_out: _Split | None = None
    comparison: _Comparison | None = None
    residual: _Residual | None = None
    rank_attainable: int | None = None
    settings: _Settings | None = None


class _Reading(_Loose):
    pose: int
    load_case: str
    status: str
    note: str


class _Readings(_Loose):
    counts: dict[str, int]
    not_ok: tuple[_Reading, ...]


class _Station(_Loose):
    station: str
    poses: tuple[int, ...]
    residual: tuple[tuple[float, float, float], ...]
    residual_rms: float
    residual_max: float
    rotation_sigma: float
    displacement_sigma: float


class _Move(_Loose):
    station: str
    from_pose: int
    distance: float


class _Registration(_Loose):
    stations: tuple[_Station, ...]
    unregistered: dict[str, str]
    lever_arm: Numbers
    lever_arm_of_cell: Numbers
    scatter: Number
    moves: tuple[_Move, ...]


class _Scalar(_Loose):
    value: Number
    half_width_95: Number
    cell: Number


class _Vector(_Loose):
    value: Numbers
    half_width_95: Numbers
    cell: Numbers


class _Tool(_Loose):
    unloaded_references: int
    mass_kg: _Scalar
    centre_of_mass: _Vector
    not_determined: tuple[str, ...]


class _Drift(_Loose):
    largest_N: Number
    pose: int | None


class _Moment(_Loose):
    median_Nm: Number
    largest_Nm: Number


class _Noise(_Loose):
    force_sigma_median_N: Number
    marker_sigma_median: Number


class _Attempts(_Loose):
    given_up: tuple[int, ...]


class _Times(_Loose):
    started: str | None
    total: Number


class _Summary(_Loose):
    """Of a run; see `elastocal.procedure.derive.summary`."""

    readings: _Readings
    registration: _Registration
    tool: _Tool
    drift: _Drift
    contact_moment: _Moment
    noise: _Noise
    attempts: _Attempts
    times: _Times
    warnings: tuple[str, ...]


def checked_figures(figures: dict[str, Any], what: str) -> dict[str, Any]:
    """Return the figures of a calibration, or refuse them by the path of what is wrong.

    Raises
    ------
    SchemaError
        If a key that the report needs is of another kind.
    """
    settings = validate(figures, _Figures, what).settings
    if settings is not None:
        _check_bounds(settings.bounds, what)
    return figures


def checked_summary(summary: dict[str, Any], what: str) -> dict[str, Any]:
    """Return the summary of a run, or refuse it by the path of what is wrong.

    Raises
    ------
    SchemaError
        If a key that the report needs is missing or of another kind.
    """
    validate(summary, _Summary, what)
    return summary


def _check_bounds(text: str, what: str) -> None:
    try:
        _, _ = (float(part) for part in text.split(","))
    except ValueError as error:
        raise SchemaError(f"{what}: settings.bounds must be two numbers, got {text!r}") from error
