"""The hidden truth of the simulated cell, and the figures of its simulated devices.

Only the simulation reads this; nothing here is known to planning, procedure or calibration. All
defaults are assumptions of a plausible size, none is taken from a data sheet.
"""

from typing import Annotated

from pydantic import BeforeValidator, Field, FiniteFloat

from elastocal.cell.description.motion import PositiveSpeed, PositiveTime
from elastocal.cell.description.quantities import (
    Distance,
    Force,
    Point,
    PositiveForce,
    PositiveLength,
)
from elastocal.cell.description.simulation_truth import (
    Balancer,
    Bearings,
    EndEffector,
    ExternalAxes,
    Floor,
    Gears,
    Links,
    TranslationalStiffness,
    TruthScale,
)
from elastocal.records import StrictModel
from elastocal.units import parse_quantity

Share = Annotated[FiniteFloat, Field(ge=0.0, lt=1.0)]
"""From 0 to below 1, without dimension."""
Moment = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "moment")),
    Field(ge=0.0),
]
"""In N·m, 0 or above."""
Rate = Annotated[
    float,
    BeforeValidator(lambda text: parse_quantity(text, "frequency")),
    Field(ge=1.0, le=1000.0),
]
"""Samples a second, from 1 to 1000."""


class SimulatedContact(StrictModel):
    """Contact disk and tooling."""

    normal_stiffness: TranslationalStiffness = 4e6
    """Of the urethane disk, in N/m: 0.3 mm at 1.1 kN."""
    shear_stiffness: TranslationalStiffness = 1.5e6
    """Of the disk before it slips at all, in N/m: 0.2 mm at 280 N."""
    friction: Annotated[FiniteFloat, Field(gt=0.0)] | None = None
    """True coefficient of friction; by default that of the load cases."""
    micro_slip: Distance = 8e-6
    """Standard deviation of the slip of a load case at half the friction limit, in m; it grows
    towards the limit."""
    slide_speed: PositiveSpeed = 5e-3
    """Speed at which a contact beyond its friction limit slides, in m/s."""
    tooling_stiffness: TranslationalStiffness = 2.5e7
    """Of the tooling along its normal, in N/m."""
    surface_offset: Point = (0.0, 0.0, 0.0)
    """How far the tooling stands from where the cell file puts it, in base, in m."""


class SimulatedController(StrictModel):
    """Robot controller with force control."""

    settling: PositiveTime = 0.12
    """Time constant with which a force follows its ramp, in s."""
    ripple: Force = 0.7
    """Amplitude of the unrest of a held force, in N."""
    reaction: PositiveTime = 0.004
    """From the contact force to the standstill of a guarded approach, in s."""
    repeatability: Distance = 10e-6
    """Standard deviation of a stop along each axis of base, in m; the controller knows nothing
    of it."""
    gravity_compensation: Annotated[FiniteFloat, Field(ge=0.0, le=1.0)] = 0.9
    """Part of the sag under its own weight that the controller takes out."""
    collision_force: PositiveForce = 5000.0
    """Force at which the drives give up a straight move, in N."""
    travel_limit: PositiveLength = 0.03
    """Way along the surface after which force control gives up, in m."""


class SimulatedSensor(StrictModel):
    """Force/torque sensor; ranges and place stand in the section ``sensor``."""

    rate: Rate = 100.0
    force_noise: Force = 0.8
    """Standard deviation of a sample along each axis, in N."""
    moment_noise: Moment = 0.08
    """The same about each axis, in N·m."""
    bias: Share = 0.01
    """Standard deviation of the zero of each axis, over its range."""
    drift: Force = 0.3
    """Standard deviation of the drift of a force axis within a minute, in N; a moment axis drifts
    as much in proportion to its range."""
    cross_talk: Share = 0.001
    """Standard deviation of what an axis reads of each axis, itself too, over the ranges."""


class SimulatedTracker(StrictModel):
    """Laser trackers; stations stand in the section ``trackers``."""

    rate: Rate = 100.0
    noise: Distance = 15e-6
    """Error that 95 % of the samples stay within along each axis, at no distance, in m."""
    noise_per_metre: Distance = 6e-6
    """What each metre of distance adds, in m."""
    turbulence: Share = 0.3
    """Part of the noise that changes slowly, as moving air makes it, so that it averages badly."""
    placing: Distance = 0.02
    """Standard deviation of the station's true place about that of the cell file, in m."""


class Simulation(StrictModel):
    """Section ``simulation`` of the cell file."""

    seed: Annotated[int, Field(ge=0)] = 0
    """Of everything random in the simulated devices."""
    truth: TruthScale = TruthScale()
    """Factors on the stiffness of parts, without dimension."""
    gears: Gears = Gears()
    bearings: Bearings = Bearings()
    links: Links = Links()
    balancer: Balancer = Balancer()
    floor: Floor = Floor()
    external: ExternalAxes = ExternalAxes()
    end_effector: EndEffector = EndEffector()
    contact: SimulatedContact = SimulatedContact()
    controller: SimulatedController = SimulatedController()
    sensor: SimulatedSensor = SimulatedSensor()
    tracker: SimulatedTracker = SimulatedTracker()
