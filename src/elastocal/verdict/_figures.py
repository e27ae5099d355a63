"""Figures in the summary of a run that a verdict needs, each of the right kind.

Keys that are not used here may be there; those that are must be of the right kind, so that no
section of a report stumbles.
"""

from pydantic import ConfigDict, FiniteFloat

from elastocal.records import StrictModel

Number = FiniteFloat | None
Numbers = tuple[Number, ...]


class _Figures(StrictModel):
    """A part of a file of which other keys are left alone."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class UnusableReading(_Figures):
    """A reading that was taken and cannot be used."""

    pose: int
    load_case: str
    status: str
    note: str


class ReadingFigures(_Figures):
    """Readings by status."""

    counts: dict[str, int]
    not_ok: tuple[UnusableReading, ...]


class StationFigures(_Figures):
    """Registration of one tracker station, in m and rad."""

    station: str
    poses: tuple[int, ...]
    residual: tuple[tuple[float, float, float], ...]
    residual_rms: float
    residual_max: float
    rotation_sigma: float
    displacement_sigma: float


class StationMove(_Figures):
    """A station that moved during the run."""

    station: str
    from_pose: int
    distance: float


class RegistrationFigures(_Figures):
    """Stations and marker."""

    stations: tuple[StationFigures, ...]
    unregistered: dict[str, str]
    lever_arm: Numbers
    lever_arm_of_cell: Numbers
    scatter: Number
    moves: tuple[StationMove, ...]


class ToolScalar(_Figures):
    """A number of the tool: measured, and by the cell file."""

    value: Number
    half_width_95: Number
    cell: Number


class ToolVector(_Figures):
    """A vector of the tool: measured, and by the cell file."""

    value: Numbers
    half_width_95: Numbers
    cell: Numbers


class ToolFigures(_Figures):
    """Weight of the tool from unloaded references."""

    unloaded_references: int
    mass_kg: ToolScalar
    centre_of_mass: ToolVector
    not_determined: tuple[str, ...]


class DriftFigures(_Figures):
    """Drift of the force sensor within a pose."""

    largest_N: Number
    pose: int | None


class MomentFigures(_Figures):
    """Moment at the contact."""

    median_Nm: Number
    largest_Nm: Number


class NoiseFigures(_Figures):
    """Standard deviations of a reading."""

    force_sigma_median_N: Number
    marker_sigma_median: Number


class AttemptFigures(_Figures):
    """Poses that were given up."""

    given_up: tuple[int, ...]


class RunTimes(_Figures):
    """Begin of the run, ISO 8601, and its length in s."""

    started: str | None
    total: Number


class RunFigures(_Figures):
    """The summary of a run; see `elastocal.procedure.RunSummary`."""

    readings: ReadingFigures
    registration: RegistrationFigures
    tool: ToolFigures
    drift: DriftFigures
    contact_moment: MomentFigures
    noise: NoiseFigures
    attempts: AttemptFigures
    times: RunTimes
    warnings: tuple[str, ...]
