"""The summary of a run, ``summary.json``: findings on the way to its dataset.

Numbers are in SI units; the key states the unit where it is not that of a length in m, an angle in
rad, a time in s. None marks an unknown number.
"""

from pathlib import Path

from elastocal.cell import LineCounts
from elastocal.errors import SchemaError
from elastocal.findings import Finding
from elastocal.procedure.record import ReadingStatus
from elastocal.procedure.registration import Blunder
from elastocal.records import read_json, record
from elastocal.results import Result, brief_repr

Number = float | None
Vector = tuple[Number, Number, Number]


@brief_repr
@record()
class PoseCounts:
    """Poses of the plan, and those that the run has committed."""

    planned: int
    committed: int
    missing: tuple[int, ...]
    """Ids of those that are not committed."""


@record()
class LostReading:
    """A reading that is not ok."""

    pose: int
    load_case: str
    status: ReadingStatus
    note: str
    """The reason."""


@brief_repr
@record()
class ReadingCounts:
    """Readings by their status."""

    counts: dict[str, int]
    not_ok: tuple[LostReading, ...]


@brief_repr
@record()
class StationSummary:
    """A registered station; see `elastocal.procedure.registration.StationFit`."""

    station: str
    poses: tuple[int, ...]
    T_base_tracker: tuple[tuple[float, ...], ...]
    rotation_sigma: float
    position_sigma: Vector
    residual: tuple[Vector, ...]
    residual_rms: float
    robot_accuracy: float
    residual_max: float
    displacement_sigma: float
    """Effect of the rotation's uncertainty on the run's median displacement."""


@record()
class MoveSummary:
    """A station that moved between two poses."""

    station: str
    from_pose: int
    distance: float
    angle: float
    log10_probability_of_chance: float
    distance_sigma: Number = None
    """Standard deviation of the distance, in m; not known of runs derived by older versions."""


@brief_repr
@record()
class RegistrationSummary:
    """Stations, marker and what is odd about them."""

    stations: tuple[StationSummary, ...]
    unregistered: dict[str, str]
    """Stations without a transform, and why."""
    lever_arm: Vector
    """Marker in the tcp frame."""
    lever_arm_sigma: Vector
    lever_arm_of_cell: Vector
    lever_arm_from_cell_along: tuple[str, ...]
    """Axes along which the orientations say nothing: there it is the cell file's."""
    scatter: Number
    moves: tuple[MoveSummary, ...]
    blunders: tuple[Blunder, ...]
    detectable_move: Number = None
    """Smallest jump of a station midway that would have been found, in m; see
    `elastocal.procedure.registration.Registration`."""


@record()
class ScalarEstimate:
    """A number with half its 95 % interval, beside the cell file's."""

    value: Number
    half_width_95: Number
    cell: Number


@brief_repr
@record()
class VectorInterval:
    """A vector with half its 95 % interval along each axis."""

    value: Vector
    half_width_95: Vector


@brief_repr
@record()
class VectorEstimate(VectorInterval):
    """A vector with half its 95 % interval, beside the cell file's."""

    cell: Vector


@record()
class ToolStep:
    """A change of the tool's mass in the middle of a run."""

    from_pose: int
    mass_kg: float


@brief_repr
@record()
class ToolSummary:
    """Tool and sensor by the unloaded references; vectors are in the sensor's frame."""

    unloaded_references: int
    mass_kg: ScalarEstimate
    centre_of_mass: VectorEstimate
    force_bias_N: VectorInterval
    moment_bias_Nm: VectorInterval
    force_drift_N_per_s: VectorInterval
    moment_drift_Nm_per_s: VectorInterval
    force_scatter_N: Number
    moment_scatter_Nm: Number
    not_determined: tuple[str, ...]
    changed: ToolStep | None


@record()
class DriftSummary:
    """Deviation of the sensor from its tare when the tool was free again, at the worst pose."""

    released_windows: int
    largest_N: Number
    pose: int | None
    seconds: Number
    """Time between the two windows."""


@record()
class MomentSummary:
    """Moments about the tcp, which the dataset leaves out."""

    readings: int
    median_Nm: Number
    largest_Nm: Number


@record()
class NoiseSummary:
    """Standard deviations of the readings that are ok."""

    readings: int
    force_sigma_median_N: Number
    marker_sigma_median: Number


@record()
class FaultSummary:
    """A fault of the journal."""

    pose: int | None
    attempt: int | None
    step: str | None
    text: str


@brief_repr
@record()
class AttemptSummary:
    """Attempts, faults and sessions beyond the first of each."""

    retried: dict[str, int]
    """Attempts of each pose that needed more than one."""
    given_up: tuple[int | None, ...]
    resumed: int
    faults: tuple[FaultSummary, ...]


@record()
class TimeSummary:
    """Times of the run."""

    started: str | None
    measuring_per_pose_median: Number
    total: Number


@record("elastocal.run-summary/2", sealed=True, reads=("elastocal.run-summary/1",))
class RunSummary(Result):
    """Findings on the way to the dataset of a run."""

    elastocal: str
    """Version that derived it."""
    poses: PoseCounts
    readings: ReadingCounts
    registration: RegistrationSummary | None
    """None of a run without tracker."""
    tool: ToolSummary
    drift: DriftSummary
    contact_moment: MomentSummary
    noise: NoiseSummary
    attempts: AttemptSummary
    times: TimeSummary
    warnings: tuple[Finding, ...]
    """Warnings for the user; sentences alone in files of version 1."""
    lines: tuple[LineCounts, ...] = ()
    """Counts on the lines of the devices, over all sessions; none for simulated devices and in
    older runs."""
    dataset_sha256: str = ""
    """SHA-256 of the file ``dataset.nc`` that it was written with; empty before it was."""

    @property
    def stations(self) -> tuple[StationSummary, ...]:
        """Registered stations; none of a run without tracker."""
        return () if self.registration is None else self.registration.stations

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        counts = ", ".join(f"{n} {status}" for status, n in self.readings.counts.items() if n)
        return (
            ("poses", f"{self.poses.committed} of {self.poses.planned} committed"),
            ("readings", counts),
            ("stations", ", ".join(each.station for each in self.stations) or "none: no tracker"),
            *(("line", each.sentence()) for each in self.lines),
            *(("warning", warning) for warning in self.warnings),
        )


def read_summary(path: Path) -> RunSummary:
    """Return the summary in a file.

    Raises
    ------
    SchemaError
        If it is not JSON, of another schema, or damaged.
    FileAccessError
        If it cannot be read.
    """
    found = read_json(path, RunSummary)
    for each in found.stations:
        if len(each.residual) != len(each.poses):
            raise SchemaError(
                f"{path}: station {each.station!r} has {len(each.residual)} residuals for"
                f" {len(each.poses)} poses"
            )
    return found
