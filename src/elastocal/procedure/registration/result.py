"""What a registration finds."""

from dataclasses import dataclass

from elastocal.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class StationFit:
    """A station over the poses between which it did not move."""

    station: str
    poses: tuple[int, ...]
    """Ids in the order of time, those set aside included."""
    T_base_tracker: FloatArray
    """Shape (4, 4), in m."""
    rotation_sigma: float
    """Standard deviation of the rotation about its least certain axis, in rad. A marker
    displacement of 1 mm is turned by it into one that is off by 1 mm times this."""
    position_sigma: FloatArray
    """Standard deviation of the marker's place that the transform gives, at the centre of the
    poses, in base, shape (3,), in m."""
    residual: FloatArray
    """Measured minus expected marker position of each pose, likely errors of the robot taken
    out, in base, shape (pose, 3), in m."""
    accuracy: float
    """Root mean square distance of the marker from where the controller has it, after the best
    rigid fit of all poses that were not set aside, in m: what the robot's own errors make."""


@dataclass(frozen=True)
class StationMove:
    """A station that stood elsewhere from some pose on."""

    station: str
    before: int
    """Last pose that it measured from the old place."""
    pose: int
    """First pose that it measured from the new one."""
    distance: float
    """How far the marker seems to have jumped, at the centre of the poses, in m."""
    angle: float
    """How far the station turned, in rad."""
    improbability: float
    """Decimal logarithm of the probability that chance alone looks like this (F-test)."""


@dataclass(frozen=True)
class Blunder:
    """An unloaded reading that does not belong to the others; it is not fitted."""

    pose: int
    station: str
    distance: float
    """How far the marker was from where it had to be, in m."""


@dataclass(frozen=True, eq=False)
class Registration:
    """Stations, marker and what is odd about them."""

    stations: tuple[StationFit, ...]
    lever_arm: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    lever_sigma: FloatArray
    """Its standard deviation, the cell file's value included as a weak prior, shape (3,), in m."""
    lever_prior: FloatArray
    """Value of the cell file, shape (3,), in m."""
    undetermined_lever: tuple[str, ...]
    """Axes of the tcp frame along which the orientations say nothing about the lever arm: there
    it is the cell file's."""
    scatter: float
    """What is left in one coordinate when station, lever arm and the robot's likely errors are
    fitted, tracker noise taken out, in m."""
    moves: tuple[StationMove, ...]
    blunders: tuple[Blunder, ...]
    unregistered: dict[str, str]
    """Stations without a transform, and why."""

    def station_of(self, station: str, pose: int) -> StationFit | None:
        """Return where a station stood at a pose; None where that is not known."""
        for fit in self.stations:
            if fit.station == station and pose in fit.poses:
                return fit
        return None
