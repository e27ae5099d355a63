"""How the robot presses, how poses are searched for, and how Procedure 1 is carried out and judged.

The load cases are those of the paper's section 4.1, as force on the robot in the tcp frame. The
bounds refuse typing errors in the cell file. They are wide: a value within them may still be wrong
for a machine.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    FiniteFloat,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from elastocal import plugins
from elastocal.arrays import FloatArray
from elastocal.cell._quantities import (
    AngleBelowRight,
    AngleUpToPi,
    Distance,
    Force,
    PositiveAngleUpToPi,
    PositiveForce,
    PositiveForceRate,
    PositiveLength,
    PositiveMass,
    PositiveSpeed,
    PositiveTime,
    TranslationalCompliance,
    needed_for,
)
from elastocal.errors import UnitError, nearest
from elastocal.records import StrictModel, validate
from elastocal.units import parse_quantity

DEFAULT_POSES = 31
"""Number of poses of the paper's first case study."""
_MOST_CANDIDATES = 10_000_000
"""Largest pool; with more, no memory would hold the candidates."""
DIRECTIONS = {
    "normal": (0.0, 0.0, -1.0),
    "north": (1.0, 0.0, -1.0),
    "south": (-1.0, 0.0, -1.0),
    "east": (0.0, -1.0, -1.0),
    "west": (0.0, 1.0, -1.0),
}
"""Signs of (fx, fy, fz) in the force on the robot (paper section 4.1; docs/conventions.md says why
east is -fy)."""
_CaseName = Literal["normal", "north", "south", "east", "west"]
CONDITIONING = "conditioning"
"""Name of the full press before the reference is read."""
LIGHT_CONTACT = "light_contact"
"""Name of the press under which the reference is read; it is no load case of a dataset."""
_PERCENT = 1e-9
"""Largest distance of a level from a whole percent."""


def _whole_percent(level: float) -> float:
    if not abs(100.0 * level - round(100.0 * level)) <= 100.0 * _PERCENT:
        raise ValueError("must be a whole percent of the full load, such as 0.45")
    return level


_Level = Annotated[FiniteFloat, Field(ge=0.01, le=0.99), AfterValidator(_whole_percent)]


class LoadCases(StrictModel):
    """Amplitudes, and which cases are applied at each pose."""

    fz: PositiveForce
    """Pressing force in N."""
    fx: Force = 0.0
    """Lateral force of north and south in N."""
    fy: Force = 0.0
    """Lateral force of east and west in N."""
    friction: Annotated[FiniteFloat, Field(gt=0.0, le=10.0)]
    """Coefficient of static friction between disk and surface."""
    safety: Annotated[FiniteFloat, Field(ge=1.0, le=100.0)] = 1.5
    """Factor by which the friction must exceed the lateral force."""
    cases: Annotated[tuple[_CaseName, ...], Field(validate_default=True)] = get_args(_CaseName)
    level: _Level | None = None
    """Part of ``fz`` that is pressed before and after the cases; it separates play and stiffening
    from compliance. None: no low load."""
    check: _Level | None = None
    """Part of ``fz`` whose press is kept out of every fit, to measure the error of the model at a
    load between those fitted. None: there is no such press."""

    @field_validator("cases")
    @classmethod
    def _distinct_with_their_forces(cls, cases: tuple[str, ...], info: Any) -> tuple[str, ...]:
        if not cases:
            raise ValueError("at least one load case is needed")
        if len(set(cases)) != len(cases):
            raise ValueError("a load case is named twice")
        for axis, names in (("fx", {"north", "south"}), ("fy", {"east", "west"})):
            pushed = sorted(names & set(cases))
            if pushed and not info.data.get(axis, 1.0) > 0.0:
                raise ValueError(f"{' and '.join(pushed)} need {axis} above 0")
        return cases

    @field_validator("check")
    @classmethod
    def _not_the_level(cls, check: float | None, info: Any) -> float | None:
        if check is not None and check == info.data.get("level"):
            raise ValueError("must differ from level: what the fit has seen is no check")
        return check

    @property
    def force_tcp(self) -> FloatArray:
        """Force on the robot in each case, tcp frame, shape (load_case, 3), in N."""
        signs = np.array([DIRECTIONS[name] for name in self.cases])
        return signs * (self.fx, self.fy, self.fz)

    @property
    def check_case(self) -> str | None:
        """Name of the load case that is kept out of every fit."""
        return None if self.check is None else _level_name(self.check)

    @property
    def levels(self) -> dict[str, FloatArray]:
        """Force on the robot in each load case, tcp frame, shape (3,), in N, in order in time.

        The level, the cases, the check, the level again: the load comes up to the full cases and
        goes down from them.
        """
        pressed = dict(zip(self.cases, self.force_tcp, strict=True))
        full = np.array([0.0, 0.0, -self.fz])
        if self.check is not None:
            pressed[_level_name(self.check)] = self.check * full
        if self.level is not None:
            name, force = _level_name(self.level), self.level * full
            pressed = {name: force, **pressed, f"{name}_back": force}
        return pressed


def _level_name(level: float) -> str:
    return f"normal_{round(100.0 * level)}"


class Engagement(StrictModel):
    """Contact disk and approach to the surface."""

    disk_radius: PositiveLength
    """In m."""
    normal_tolerance: PositiveAngleUpToPi = math.radians(3.0)
    """Largest angle between the disk's axis and the surface's normal under it, in rad."""
    edge_margin: Distance = 5e-3
    """Least distance from the rim of the disk to an edge of the surface, in m."""
    near_contact: PositiveLength = 3e-3
    """Distance from the surface at which the unloaded readings are taken, in m."""
    approach_distance: PositiveLength = 0.1
    """Distance of the approach pose A_i from the surface, along the normal, in m."""
    disk_thickness: Annotated[PositiveLength, Field(le=0.1)] | None = None
    """Thickness of a disk of which two can be stacked, in m; by default there is none. A plan
    without a tracker presses on two at some places."""

    @field_validator("approach_distance")
    @classmethod
    def _behind_near_contact(cls, value: float, info: Any) -> float:
        near = info.data.get("near_contact", 0.0)
        if not value > near:
            raise ValueError(f"must be above near_contact ({near:g} m)")
        return value


class TorqueLimits(StrictModel):
    """Continuous torques of the actuators (paper 4.1).

    Catalogues give one figure, mostly without saying whether it is peak or continuous.
    """

    factor: Annotated[FiniteFloat, Field(gt=0.0, le=1.0)] = 1.0
    """Part of the figure that may be used for seconds on end."""
    values: dict[str, str] = Field(default_factory=dict)
    """Figure of each joint, by name; those of the robot's description by default."""
    provenance: Annotated[
        str | None,
        needed_for("values", "say where the torque values are from"),
        Field(validate_default=True),
    ] = None
    """Source of the figures; required if any are given."""

    @field_validator("values")
    @classmethod
    def _positive(cls, values: dict[str, str]) -> dict[str, str]:
        for joint, text in values.items():
            if not _torque_or_force(text) > 0.0:
                raise ValueError(f"{joint} must be above 0")
        return values

    def figure(self, joint: str, revolute: bool) -> float:
        """Return the figure of a joint that has one.

        Parameters
        ----------
        joint : str
            One of `values`.
        revolute : bool
            Whether it turns (a moment in N·m) or slides (a force in N).

        Raises
        ------
        UnitError
            If the figure is of the other kind.
        """
        text = self.values[joint]
        try:
            return parse_quantity(text, "moment" if revolute else "force")
        except UnitError as error:
            kind = "turns and has a moment" if revolute else "slides and has a force"
            raise UnitError(f"{joint} {kind}: {error}") from error


class Limits(StrictModel):
    """Margins that every pose keeps.

    The limit of a new check is a field that is None by default: a cell that does not give it is
    not judged by it, and keeps its fingerprint and its plans.
    """

    joint_margin: AngleUpToPi = 0.0873
    """Least distance of a revolute joint to its limits, in rad."""
    rail_margin: Distance = 0.0
    """Least distance of a prismatic joint to its limits, in m."""
    singular_value: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.05
    """Least singular value of the length-scaled Jacobian, without dimension."""
    wrist_angle: AngleBelowRight = 0.1745
    """Least angle between the lines of axes 4 and 6, in rad: |A5|, folded back above 90°."""
    clearance: Distance = 0.0
    """Least distance between solids that must not touch, in m."""
    payload: PositiveMass | None = None
    """Largest mass that the flange may carry, in kg."""
    torque: TorqueLimits = TorqueLimits()
    checks: Mapping[str, Any] | None = None
    """Checks of other packages that every pose passes, too, by name: settings of each, of the class
    that it names. One that is not named here does not judge."""

    @field_validator("checks")
    @classmethod
    def _known_with_their_settings(cls, named: Mapping[str, Any] | None) -> Any:
        return named and {name: _settings_of_check(name, each) for name, each in named.items()}


def _settings_of_check(name: str, given: object) -> object:
    """Return the settings of a plug-in's check, validated."""
    known = plugins.entries("check")
    if name not in known:
        allowed = ", ".join(known) or "none is installed"
        raise ValueError(f"unknown check {name!r}{nearest(name, known)} (allowed: {allowed})")
    kind = plugins.load("check", name)
    return validate({} if given is None else given, kind.settings, f"check {name}")


def _torque_or_force(text: str) -> float:
    """Return a moment in N·m or a force in N: which one a joint has, only the robot knows."""
    return parse_quantity(text, "force" if text.rstrip().endswith("N") else "moment")


class Search(StrictModel):
    """Pool and technique; ends at ``poses`` or at ``d_max``, whichever comes first."""

    technique: str = "cover"
    """Name of a search technique (`elastocal.planning.search`); `Cell.technique` says which is
    taken where the file names none."""
    metric: Literal["euclidean", "geodesic"] = "euclidean"
    """Distance between contact points that COVER uses."""
    poses: Annotated[int, Field(ge=1, le=_MOST_CANDIDATES)] | None = None
    """Largest number of poses N."""
    d_max: PositiveLength | None = None
    """Cover distance at which COVER may stop, in m."""
    accuracy: PositiveLength | None = None
    """Error on production that is wanted, in m: as few poses as it is expected from."""
    sigma: PositiveLength | None = None
    """Standard deviation of a measured coordinate of a deflection that errors are expected with, in
    m; by default that of a laser tracker at some metres."""
    floor: PositiveLength | None = None
    """Error that the model leaves however many poses there are, in m, as `elastocal study` finds
    it; not known by default."""
    pool: Annotated[int, Field(ge=1, le=_MOST_CANDIDATES)] = 3000
    """Number of candidates."""
    sampling: Literal["blue_noise", "uniform"] = "blue_noise"
    """Whether candidate points keep a distance from one another or are drawn independently."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """Seed of everything random."""

    @field_validator("pool")
    @classmethod
    def _holds_the_poses(cls, pool: int, info: Any) -> int:
        poses = info.data.get("poses")
        if poses is not None and not poses <= pool:
            raise ValueError(f"must be at least the {poses} poses that are to be chosen")
        return pool

    @property
    def pose_limit(self) -> int | None:
        """Largest number of poses; None when only ``d_max`` ends the search."""
        if self.poses is None and self.d_max is None:
            return DEFAULT_POSES
        return self.poses


class ProcedureSettings(StrictModel):
    """Settings of `elastocal run`. Joint moves go at the speeds of the section ``motion``."""

    cycle: Annotated[PositiveTime, Field(ge=1e-3, le=0.1)] = 0.04
    """Interval at which the devices are read, in s."""
    approach_speed: Annotated[PositiveSpeed, Field(ge=1e-4, le=0.25)] = 0.02
    """Between approach pose and near contact, and back, in m/s."""
    contact_speed: Annotated[PositiveSpeed, Field(ge=1e-4, le=0.02)] = 0.005
    """Speed of the guarded approach from near contact to the surface, in m/s, in `elastocal run`.
    ``motion.contact_speed`` is another: the limit of the KRL program on the whole straight path."""
    contact_force: PositiveForce = 60.0
    """Force at which the guarded approach stops, in N."""
    ramp: Annotated[PositiveForceRate, Field(ge=1.0, le=2e3)] = 400.0
    """Fastest change of the force, in N/s."""
    force_limit: PositiveForce | None = None
    """Largest force that is let happen, in N; by default 1.3 times the largest load case, and
    never more than the sensor's range allows."""
    collision_force: Annotated[PositiveForce, Field(le=5e3)] | None = None
    """Change of the force beyond that of the tool's weight, within 0.1 s of a free move, that is a
    collision, in N; by default 50 N and a fifth of the tool's weight. A slow one is found when it
    is as much and a third of the weight more."""
    travel_limit: Annotated[PositiveLength, Field(le=50e-3)] = 15e-3
    """Largest travel of the tool beyond the expected contact, or sideways, in m."""
    contact_compliance: Annotated[TranslationalCompliance, Field(le=10e-6)] = 0.5e-6
    """Lateral movement of the marker under load that is expected without slip (disk, tooling,
    tilt of the tool), in m/N of the load case."""
    force_tolerance: Annotated[PositiveForce, Field(le=50.0)] | None = None
    """Largest deviation of the mean force from the load case, in N; by default 1 % of the largest
    load case, at least 5 N. The fit uses the measured force, so the deviation is no error of the
    reading; a large one shows that the arm does not follow its commands."""
    force_drift: Annotated[PositiveForceRate, Field(le=50.0)] = 5.0
    """Largest drift of the force over the dwell, in N/s."""
    force_spread: Annotated[PositiveForce, Field(le=50.0)] = 8.0
    """Largest width of the force about its drift that holds 95 % of the samples, each axis, in N;
    counted as four standard deviations."""
    reference: Literal["unloaded", "light_contact"] = "unloaded"
    """State in which the zero of the displacements is read: near contact without load, or pressed
    with ``contact_force``, so that settling of disk and tooling does not count as displacement."""
    conditioning: bool = False
    """Whether a full press precedes the reference, so that the friction of the gears starts from a
    known load at every pose instead of an unknown one."""
    dwell: Annotated[PositiveTime, Field(le=60.0)] = 0.5
    """Time for which the force must be stable before it is averaged, in s."""
    average: Annotated[PositiveTime, Field(le=60.0)] = 1.0
    """Time over which a loaded reading is averaged, in s."""
    unloaded_average: Annotated[PositiveTime, Field(le=60.0)] = 1.0
    """Time over which the unloaded reference is averaged, in s."""
    marker_sigma: Annotated[PositiveLength, Field(le=1e-3)] = 50e-6
    """Largest standard deviation of the marker during the unloaded reference, each axis, in m."""
    slip_limit: Annotated[PositiveLength, Field(le=5e-3)] = 0.2e-3
    """Largest lateral movement of the marker that is not expected, in m."""
    timeout: Annotated[PositiveTime, Field(le=600.0)] = 20.0
    """Largest time from the end of the ramp until a load case is stable, in s; also the time that
    every other step may take beyond its expected duration."""
    beam_timeout: Annotated[PositiveTime, Field(le=600.0)] = 5.0
    """Largest time for which a tracker searches the marker, in s."""
    stale: Annotated[PositiveTime, Field(le=1.0)] = 0.3
    """Oldest data that are trusted, in s."""
    retries: Annotated[int, Field(ge=0, le=5)] = 1
    """Further attempts at a pose after one that failed."""

    @model_validator(mode="after")
    def _no_contradiction(self) -> "ProcedureSettings":
        # Not a validator of a field: that is not asked where the field keeps its default.
        for key, reason in self._contradictions():
            error = PydanticCustomError("contradiction", "{reason}", {"reason": reason})
            detail = InitErrorDetails(type=error, loc=(key,), input=getattr(self, key))
            raise ValidationError.from_exception_data(type(self).__name__, [detail])
        return self

    def _contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield keys whose values do not go with others."""
        if not self.stale > 2.0 * self.cycle:
            yield "stale", f"must be above two cycles ({2.0 * self.cycle:g} s)"
        for key in ("dwell", "average", "unloaded_average"):
            if not getattr(self, key) >= 4.0 * self.cycle:
                yield key, f"must be at least four cycles ({4.0 * self.cycle:g} s)"
        if not self.contact_speed <= self.approach_speed:
            yield "contact_speed", f"must be at most approach_speed ({self.approach_speed:g} m/s)"
        if not self.contact_force > self.force_spread:
            least_felt = f"must be above force_spread ({self.force_spread:g} N)"
            yield "contact_force", f"{least_felt}: less is felt without contact"
        if self.conditioning and self.reference != "light_contact":
            needed = "needs reference: light_contact"
            yield "conditioning", f"{needed}: a tool that is lifted wipes out what the press did"
        least = self.dwell + self.average
        if not self.timeout >= least:
            yield "timeout", f"must be at least dwell and average together ({least:g} s)"
        if not self.beam_timeout >= self.stale:
            yield "beam_timeout", f"must be at least stale ({self.stale:g} s)"


class Acceptance(StrictModel):
    """Limits that the report and the comparison of two calibrations hold their figures against."""

    tolerance: PositiveLength | None = None
    """Largest error of a predicted deflection at a pose that the fit has not seen, in m."""
    drift: PositiveLength | None = None
    """Largest change of a predicted deflection between two calibrations of the cell, in m."""
