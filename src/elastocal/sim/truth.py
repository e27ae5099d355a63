"""The sections `simulation` and `faults` of a cell file: the hidden truth of the simulated cell.

Planning, procedure and calibration do not know them; `elastocal.cell` finds them by name
(`SECTIONS_OF_OTHERS`). The difficulty of a cell is in the table of `presets`, each figure with its
source; all other defaults are plausible assumptions.

The presets `kind`, `typical` and `harsh` state the size of the imperfections of the simulated cell.

One table gives the defaults of the section ``simulation`` and the page on the simulated cell. A
figure that is not in it is the same in all presets.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast, get_args

from pydantic import Field, FiniteFloat, field_validator, model_validator

from elastocal.cell import (
    AngleUpToPi,
    Distance,
    Force,
    Mass,
    Moment,
    Point,
    PositiveForce,
    PositiveLength,
    PositiveSpeed,
    PositiveTime,
    RotationalStiffness,
    SampleRate,
    Scale,
    Share,
    ShareBelowHalf,
    StiffnessOrNone,
    Time,
    TranslationalStiffness,
)
from elastocal.records import StrictModel
from elastocal.results import brief_repr

if TYPE_CHECKING:
    from elastocal.cell import Cell

Preset = Literal["kind", "typical", "harsh"]
"""Names of the presets: a well-kept small arm, what published arms show, and about twice that."""
PRESETS: tuple[Preset, ...] = get_args(Preset)
"""Names of the presets, from the least imperfections to the most."""

_Value = str | float | tuple[str | float, ...] | None


@brief_repr
@dataclass(frozen=True)
class PresetFigure:
    """One figure of the simulated truth in every preset."""

    key: str
    """Place in the section ``simulation``, such as ``gears.growth``."""
    effect: str
    """Description of the figure."""
    kind: _Value
    """Value as in a cell file: a quantity with its unit."""
    typical: _Value
    harsh: _Value
    source: str
    """Origin of the magnitude: "assumption" where no published value was found, † where a data
    sheet is cited from memory."""

    def of(self, preset: Preset) -> _Value:
        """Return the figure of a preset."""
        values: dict[Preset, _Value] = {
            "kind": self.kind, "typical": self.typical, "harsh": self.harsh,
        }  # fmt: skip
        return values[preset]


PRESET_FIGURES = (
    PresetFigure(
        "gears.growth",
        "gears: 1 - K1/K3, stiffness missing at rest",
        0.2,
        0.3,
        0.4,
        "catalogues of strain-wave gears state K1, K2, K3 by zones of torque: K1/K3 about 0.55"
        " (Harmonic Drive CSG †); RV gears are straighter, 0.8 is an assumption",
    ),
    PresetFigure(
        "gears.lost_motion",
        "gears: lost motion of each joint, all in",
        None,
        ("0.005 deg", "0.005 deg", "0.006 deg", "0.008 deg", "0.009 deg", "0.01 deg"),
        ("0.01 deg", "0.01 deg", "0.012 deg", "0.016 deg", "0.018 deg", "0.02 deg"),
        "Nabtesco RV-E, RV-N catalogues †: at most 1 arc min new; 0.3' to 0.6' is half of it,"
        " smaller on the large gears; harsh: the limit, and a little worn at the wrist",
    ),
    PresetFigure(
        "gears.presliding",
        "gears: twist until the friction is at its full height",
        "60e-6 rad",
        "100e-6 rad",
        "150e-6 rad",
        "assumption: of the size of the lost motion, as in Ruderman, Hoffmann, Bertram 2009 †",
    ),
    PresetFigure(
        "gears.residual",
        "gears: friction strain left by a free move, over `presliding`",
        0.0,
        0.5,
        1.0,
        "assumption: a gear stops somewhere in its loop (He, Guo, Sun 2023 see the way of arrival"
        " in the position error)",
    ),
    PresetFigure(
        "bearings.ratio",
        "bearings: stiffness of the two tilts over that of the gear",
        (4.0, 6.0),
        (3.0, 7.0),
        (2.5, 8.0),
        "assumption: a housing is softer across its ribs; mean as in kind",
    ),
    PresetFigure(
        "bearings.turn",
        "bearings: tilt axes turned about the joint's",
        "0 deg",
        "30 deg",
        "45 deg",
        "assumption: principal axes of a casting are no axes of a drawing; 45 deg is farthest",
    ),
    PresetFigure(
        "bearings.offset",
        "bearings: their middle beside the joint's origin, along the axis",
        "0 mm",
        "60 mm",
        "120 mm",
        "assumption: half the length of a main bearing with its gear",
    ),
    PresetFigure(
        "truth.links",
        "links: factor on the bending stiffness",
        1.0,
        1.0,
        0.7,
        "assumption: walls of 10 mm; harsh 7 mm",
    ),
    PresetFigure(
        "balancer.seal_friction",
        "gravity compensator: friction of its seals",
        "0 N",
        "300 N",
        "600 N",
        "assumption: 1.5 and 3 % of its force of some 20 kN",
    ),
    PresetFigure(
        "contact.tilt",
        "contact: disk not flat on the tooling, standard deviation of a visit",
        "0 deg",
        "0.2 deg",
        "0.4 deg",
        "assumption: a fifteenth of `engagement.normal_tolerance` (3 deg)",
    ),
    PresetFigure(
        "contact.wander",
        "contact: point of attack on the disk, standard deviation of a load case",
        "0 mm",
        "2 mm",
        "4 mm",
        "assumption: a tenth of the disk's radius (25 mm)",
    ),
    PresetFigure(
        "contact.process_stiffness",
        "process: force per shift along the surface's normal",
        "0 N/mm",
        "100 N/mm",
        "200 N/mm",
        "assumption: a soft roller yields by 5 to 10 mm under 1 kN; a milling force changes as much"
        " by a tenth of a millimetre of depth",
    ),
    PresetFigure(
        "controller.repeatability",
        "controller: error of a stop, each axis",
        "0.01 mm",
        "0.02 mm",
        "0.04 mm",
        "data sheets of KR QUANTEC †: pose repeatability 0.05 to 0.06 mm (ISO 9283: mean distance"
        " and three standard deviations)",
    ),
    PresetFigure(
        "sensor.cross_talk",
        "force sensor: cross-talk, over the ranges",
        0.001,
        0.01,
        0.02,
        "data sheets of ATI Omega †: uncertainty of 1 to 1.5 % of full scale; Humanetics"
        " (hitec.humaneticsgroup.com): cross-talk of 1 to 5 % before it is calibrated away",
    ),
    PresetFigure(
        "sensor.hysteresis",
        "force sensor: way up against way down, over the load",
        0.0,
        0.005,
        0.01,
        "part of the uncertainty above; Koike, Sakaino, Tsuji 2019 correct for it; share assumed",
    ),
    PresetFigure(
        "geometry.tcp",
        "geometry: length of the tool's error",
        "0 mm",
        "1 mm",
        "2 mm",
        "four-point teaching of a tool is good to about 1 mm (assumption)",
    ),
    PresetFigure(
        "geometry.links",
        "geometry: error of each link's length and offset",
        "0 mm",
        "0.5 mm",
        "1 mm",
        "a KR 210 off by 1.2 mm in the mean before its calibration (doi 10.1177/1729881420921644):"
        " six links of 0.5 mm",
    ),
    PresetFigure(
        "thermal.drift",
        "temperature: tool at HOME, warm against cold",
        "0 um",
        "50 um",
        "100 um",
        "Vocetka et al. 2021 (doi 10.3390/app112210813): cold against warm up to ten times the"
        " repeatability; 50 um is a warmed-up robot",
    ),
)
"""Every figure of the simulated truth, in every preset, with its origin."""
_BY_KEY = {figure.key: figure for figure in PRESET_FIGURES}
_INSTEAD = {"gears.lost_motion": ("hysteresis", "reference_angle")}
"""Figures that are left out where a file says the same in other words."""


def kind_default(key: str) -> Any:
    """Return the field of a section whose default is the figure of the preset `kind`."""
    return Field(default=_BY_KEY[key].kind, validate_default=True)


def with_preset(data: dict[str, Any], preset: Preset) -> dict[str, Any]:
    """Return a section ``simulation`` with the figures of a preset where it says nothing else.

    Parameters
    ----------
    data : dict
        The section as in a file.
    preset : str
        Which.
    """
    filled = dict(data)
    for figure in PRESET_FIGURES:
        section, name = figure.key.split(".")
        own = filled.get(section, {})
        if not isinstance(own, dict) or {name, *_INSTEAD.get(figure.key, ())} & own.keys():
            continue  # Set otherwise, or no section at all: refused later with its path
        filled[section] = own | {name: figure.of(preset)}
    return filled


_SIX = Field(min_length=6, max_length=6)
_SmallAngle = Annotated[AngleUpToPi, Field(le=0.01)]


class TruthScale(StrictModel):
    """Factors on the stiffness of parts; 2 makes them twice as stiff."""

    gears: Scale = 1.0
    bearings: Scale = 1.0
    links: Scale = kind_default("truth.links")
    balancer: Scale = 1.0
    floor: Scale = 1.0
    external: Scale = 1.0
    end_effector: Scale = 1.0


class Gears(StrictModel):
    """Gears of the six arm joints (`elastocal.sim.workcell`)."""

    stiffness: Annotated[tuple[RotationalStiffness, ...], _SIX] | None = None
    """At high torque, in N·m/rad; by default that of a 1.1 t arm, scaled with the moved mass."""
    growth: ShareBelowHalf = kind_default("gears.growth")
    """Loss of stiffness of a gear at rest, over its stiffness at high torque."""
    growth_angle: Annotated[AngleUpToPi, Field(gt=0.0)] = 3e-4
    """Twist at which it is half-way between the two, in rad."""
    backlash: AngleUpToPi = 3e-5
    """Twist that is lost between a torque and its opposite, in rad; there the gear is soft, not
    free."""
    lost_motion: Annotated[tuple[_SmallAngle, ...], _SIX] | None = kind_default("gears.lost_motion")
    """Width of the loop at no torque after a load there and back, backlash and friction together,
    in rad; None: what `hysteresis` makes of it."""
    hysteresis: Annotated[FiniteFloat, Field(ge=0.0, lt=0.3)] = 0.03
    """Friction in the gear over its torque at `reference_angle`: half the height of its loop. Not
    looked at where there is a `lost_motion`."""
    reference_angle: Annotated[AngleUpToPi, Field(gt=0.0)] = 5e-4
    """In rad."""
    presliding: Annotated[AngleUpToPi, Field(gt=0.0)] = kind_default("gears.presliding")
    """Twist from rest after which the friction is at its full height, in rad."""
    residual: Annotated[FiniteFloat, Field(ge=0.0, le=10.0)] = kind_default("gears.residual")
    """Standard deviation of the last stroke of a gear before it stops, over `presliding`: it sets
    the friction that a free move leaves."""


class Bearings(StrictModel):
    """Tilt of the bearings."""

    ratio: tuple[Scale, Scale] = kind_default("bearings.ratio")
    """Stiffness of the two tilts over that of the joint's gear."""
    turn: AngleUpToPi = kind_default("bearings.turn")
    """Rotation of the axes of the tilts about the joint's, in rad."""
    offset: Distance = kind_default("bearings.offset")
    """Distance along the axis from the joint's origin to the tilts, in m."""


class Links(StrictModel):
    """Bending of the two long links."""

    bending: RotationalStiffness | None = None
    """Stiffness of a hinge in the middle of the link, in N·m/rad; by default that of a 1.1 t arm,
    scaled with the moved mass."""


class Balancer(StrictModel):
    """Spring between carousel and arm, beside the gear of axis 2."""

    rate: TranslationalStiffness | None = None
    """Rate of the spring, in N/m; by default one that carries about 3 kN·m of a 1.1 t arm stretched
    out, scaled with the moved mass."""
    free_length: PositiveLength = 0.3
    """In m."""
    anchor: PositiveLength = 0.6
    """Distance of its end on the carousel from axis 2, in m."""
    lever: PositiveLength = 0.18
    """Distance of its end on the arm from axis 2, in m; below ``anchor``."""
    seal_friction: Force = kind_default("balancer.seal_friction")
    """Friction of the seals of its cylinder, in N."""
    fitted: bool = True
    """Whether the robot has one."""

    @field_validator("lever")
    @classmethod
    def _below_anchor(cls, value: float, info: Any) -> float:
        anchor = info.data.get("anchor", math.inf)
        if not value < anchor:
            raise ValueError(f"must be below anchor ({anchor:g} m)")
        return value


class Floor(StrictModel):
    """Foot of the robot: foundation, rail carriage, base frame."""

    tilt: RotationalStiffness = 4e7
    """About each of three axes through the foot, in N·m/rad."""


class ExternalAxes(StrictModel):
    """Drives of the axes before the arm."""

    linear: TranslationalStiffness = 4e7
    """Stiffness of a rail's drive, in N/m."""
    turning: RotationalStiffness = 8e6
    """Stiffness of a turntable's drive, in N·m/rad."""


class EndEffector(StrictModel):
    """Tool between sensor and tool centre point."""

    turn: RotationalStiffness = 2.5e6
    """About each axis of the sensor's frame, in N·m/rad."""
    shift: TranslationalStiffness = 8e7
    """Along each axis, in N/m."""


class ContactTruth(StrictModel):
    """Contact disk and tooling."""

    normal_stiffness: TranslationalStiffness = 4e6
    """Normal stiffness of the urethane disk, in N/m: 0.3 mm at 1.1 kN."""
    shear_stiffness: TranslationalStiffness = 1.5e6
    """Shear stiffness of the disk before it slips, in N/m: 0.2 mm at 280 N."""
    spread: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.0
    """Standard deviation of the compliance of a place over the mean of all, along the normal and
    across it: seat of the disk, ribs behind the surface."""
    friction: Annotated[FiniteFloat, Field(gt=0.0)] | None = None
    """True coefficient of friction; by default that of the load cases."""
    micro_slip: Distance = 8e-6
    """Standard deviation of the slip of a load case at half the friction limit, in m; it grows
    towards the limit."""
    slide_speed: PositiveSpeed = 5e-3
    """Speed at which a contact beyond its friction limit slides, in m/s."""
    tooling_stiffness: TranslationalStiffness = 2.5e7
    """Stiffness of the tooling along its normal, in N/m."""
    surface_offset: Point = (0.0, 0.0, 0.0)
    """Deviation of the tooling's position from the cell file, in base, in m."""
    tilt: AngleUpToPi = kind_default("contact.tilt")
    """Standard deviation of the disk's tilt on the tooling in a visit, about each lateral axis, in
    rad: it moves the point of attack."""
    wander: Distance = kind_default("contact.wander")
    """Standard deviation of the point of attack of a load case, along each lateral axis, in m."""
    process_stiffness: StiffnessOrNone = kind_default("contact.process_stiffness")
    """Force of a process per shift of the tool along the surface's normal, in N/m."""


class ControllerTruth(StrictModel):
    """Robot controller with force control."""

    settling: PositiveTime = 0.12
    """Time constant with which a force follows its ramp, in s."""
    ripple: Force = 0.7
    """Amplitude of the unrest of a held force, in N."""
    reaction: PositiveTime = 0.004
    """Time from the contact force to the standstill of a guarded approach, in s."""
    repeatability: Distance = kind_default("controller.repeatability")
    """Standard deviation of a stop along each axis of base, in m; the controller knows nothing
    of it."""
    gravity_compensation: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.9
    """Part of the sag under its own weight that the controller takes out."""
    collision_force: PositiveForce = 5000.0
    """Force at which the drives give up a straight move, in N."""
    travel_limit: PositiveLength = 0.03
    """Way along the surface after which force control gives up, in m."""


class SensorTruth(StrictModel):
    """Force/torque sensor; ranges and position are in the section ``sensor``."""

    rate: SampleRate = 100.0
    force_noise: Force = 0.8
    """Standard deviation of a sample along each axis, in N."""
    moment_noise: Moment = 0.08
    """The same about each axis, in N·m."""
    bias: Share = 0.01
    """Standard deviation of the zero of each axis, over its range."""
    drift: Force = 0.3
    """Standard deviation of the drift of a force axis within a minute, in N; a moment axis drifts
    as much in proportion to its range."""
    cross_talk: Share = kind_default("sensor.cross_talk")
    """Standard deviation of what an axis reads of each axis, itself too, over the ranges."""
    hysteresis: Share = kind_default("sensor.hysteresis")
    """Excess reading of an axis during unloading over loading, at half of a load of a fifth of its
    range, over that load."""


class TrackerTruth(StrictModel):
    """Laser trackers; stations are in the section ``trackers``."""

    rate: SampleRate = 100.0
    noise: Distance = 15e-6
    """Error that 95 % of the samples stay within along each axis, at no distance, in m."""
    noise_per_metre: Distance = 6e-6
    """Error that each metre of distance adds, in m."""
    turbulence: Share = 0.3
    """Part of the noise that changes slowly, as moving air makes it, so that it averages badly."""
    placing: Distance = 0.02
    """Standard deviation of the station's true place about that of the cell file, in m."""


class EncoderTruth(StrictModel):
    """Secondary encoders behind the gears of the arm's joints, which see their links."""

    noise: AngleUpToPi | None = None
    """Standard deviation of a sample, in rad; None: the arm has no such encoders."""
    eccentricity: AngleUpToPi = 2e-5
    """Amplitude of an error once a turn, in rad: a ring that is not centred."""
    rate: SampleRate = 250.0


class Geometry(StrictModel):
    """Errors of the robot's geometry against its description."""

    tcp: Distance = kind_default("geometry.tcp")
    """Length of the error of the tool centre point, in a random direction, in m."""
    links: Distance = kind_default("geometry.links")
    """Length of the error of each joint's position relative to the joint before, in m."""


class Thermal(StrictModel):
    """Growth of the arm by its own warmth."""

    drift: Distance = kind_default("thermal.drift")
    """Drift of the tool at HOME between cold and warm, away from the foot, in m. In a visit of the
    calibration the arm is in between; in a process it is warm."""
    warmth: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] | None = None
    """How warm every visit finds the arm, from 0 to 1; None: somewhere between, drawn anew for each
    visit. A run of touches has it as cold or as warm as it is said to be."""


class Simulation(StrictModel):
    """Section ``simulation`` of the cell file."""

    preset: Preset = "typical"
    """Gives the figures that the file leaves out; see `elastocal.sim.truth`."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of everything random in the simulated devices."""
    truth: TruthScale = TruthScale()
    """Factors on the stiffness of parts, without dimension."""
    gears: Gears = Gears()
    bearings: Bearings = Bearings()
    links: Links = Links()
    balancer: Balancer = Balancer()
    floor: Floor = Floor()
    external: ExternalAxes = ExternalAxes()
    end_effector: EndEffector = EndEffector()
    geometry: Geometry = Geometry()
    thermal: Thermal = Thermal()
    contact: ContactTruth = ContactTruth()
    controller: ControllerTruth = ControllerTruth()
    sensor: SensorTruth = SensorTruth()
    tracker: TrackerTruth = TrackerTruth()
    encoders: EncoderTruth = EncoderTruth()

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, data: Any) -> Any:
        """Fill in what the preset says and the file does not."""
        if not isinstance(data, dict):
            return data
        preset = data.get("preset", "typical")
        return with_preset(data, preset) if preset in PRESETS else data


FaultKind = Literal[
    "beam_break",
    "ft_dropout",
    "ft_frozen",
    "ft_saturation",
    "slip",
    "never_stable",
    "contact_missed",
    "robot_stop",
    "soft_collision",
    "stale_clock",
    "station_bumped",
    "tool_weight",
]
_Step = Literal["approach", "reference", "engage", "hold", "release", "retract"]

_ALWAYS = {"kind", "pose", "visits"}
_WHEN = {"step", "load", "after"}
_KEYS: dict[str, set[str]] = {
    "beam_break": {*_WHEN, "duration", "station"},
    "ft_dropout": {*_WHEN, "duration"},
    "ft_frozen": {*_WHEN, "duration"},
    "ft_saturation": {*_WHEN, "duration"},
    "slip": {"load", "after", "distance"},
    "never_stable": {"load", "amplitude"},
    "contact_missed": set(),
    "robot_stop": {*_WHEN, "duration"},
    "soft_collision": {*_WHEN, "duration", "amplitude"},
    "stale_clock": {*_WHEN, "duration"},
    "station_bumped": {"station", "offset"},
    "tool_weight": {"mass"},
}


class Fault(StrictModel):
    """One fault: what goes wrong, and when."""

    kind: FaultKind
    pose: Annotated[int, Field(ge=0)]
    """Visit at which it happens, from 0. A visit begins with the first straight approach after a
    joint move or a retract; a pose that is tried again is another visit."""
    visits: Annotated[int, Field(ge=1)] = 1
    """Number of consecutive visits in which it happens. Not used by `station_bumped` and
    `tool_weight`, which are permanent."""
    step: _Step = "hold"
    """Step of the visit from whose beginning `after` counts: `approach` the first approach,
    `reference` when it has ended, `engage` the second approach, `hold` a load case."""
    load: Annotated[int, Field(ge=0)] = 0
    """Load case of the visit, from 0, if the step is `hold`."""
    after: Time = 0.0
    """In s."""
    duration: PositiveTime | None = None
    """Duration, in s; permanent by default."""
    station: str | None = None
    """Tracker station; all by default."""
    distance: PositiveLength = 1e-3
    """Length of the contact's slip, in m."""
    amplitude: Force = 40.0
    """Amplitude of the force that never comes to rest; force of a soft collision; in N."""
    offset: Point = (0.5e-3, 0.0, 0.0)
    """Displacement of the station, in base, in m."""
    mass: Annotated[Mass, Field(le=1e3)] = 2.0
    """Mass that is put on the tool, in kg."""

    @model_validator(mode="before")
    @classmethod
    def _only_its_keys(cls, data: Any) -> Any:
        """Refuse a key that has no meaning for this kind of fault."""
        if isinstance(data, dict) and str(data.get("kind")) in _KEYS:
            allowed = _KEYS[str(data["kind"])]
            for key in data:
                if key in cls.model_fields and key not in _ALWAYS | allowed:
                    raise ValueError(
                        f"{key!r} means nothing for {data['kind']}"
                        f" (its keys: {', '.join(sorted(allowed)) or 'none'})"
                    )
        return data


Faults = tuple[Fault, ...]
"""Section ``faults``: in any order."""


def truth_of(cell: "Cell") -> Simulation:
    """Return the section ``simulation`` of a cell's file."""
    return cell.file.section("simulation", Simulation)


def faults_of(cell: "Cell") -> Faults:
    """Return the section ``faults`` of a cell's file."""
    return cast("Faults", cell.file.section("faults", tuple))
