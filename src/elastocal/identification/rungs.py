"""The models of the ladder, from a spring at each joint to gears that remember."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray
from elastocal.dataset import Readings
from elastocal.elastic import (
    ElasticModel,
    Gear,
    Spring,
    actuated,
    bearing,
    bearing_ends,
    layout,
    links,
    tensor,
)
from elastocal.results import brief_repr
from elastocal.robot import Robot

AUTO = "auto"
"""Name that requests the rung that the readings support."""
_KNEES = (0.3, 1.0, 3.0)
"""Knees of the gears, in typical load torques of the joint: one below, at and above it."""
_KNEES_OF_PLAYS = (0.5, 2.0)
"""Knees of gears with friction, whose elements are knees as well."""
_SLIPS = (0.15, 0.3, 0.6, 1.5)
"""Limits of the friction elements, from hardly relevant to gears that stick."""
_FINE_SLIPS = (0.05, *_SLIPS)
"""The same with one that slides under a light press already, as friction does that is small
compared with the loads of production: that of a harmonic drive, or of a strong gear."""
_SLIDES = 0.6
"""Part of the joint's largest load torque up to which a friction element is fitted. One that slid
little or never has a column near zero, and a compliance that says nothing of the arm: where
production loads the joint a little more it would bend by millimetres."""
_LOADED = 0.01
"""Part of the largest typical torque below which a joint counts as never loaded."""
_LOW_LEVEL = 0.6
"""Part of the largest force at its pose below which a load case is of low load."""
NO_LEVELS = f"no load case has less than {_LOW_LEVEL:.0%} of the largest force at its pose"
"""Reason why a rung that needs load cases of low load cannot be fitted."""


@brief_repr
@dataclass(frozen=True)
class Rung:
    """A model of the ladder."""

    name: str
    springs: Callable[[Robot, Readings], tuple[Spring, ...]]
    """Makes its springs for a robot, scaled to the loads of the readings."""
    needs_levels: bool = False
    """Whether it needs load cases of low and full load."""
    by_contact: bool = False
    """Whether it is a rung only where a contact holds the tool, whose free compliance the springs
    of links imitate: a tracker tells these apart."""


def gears(robot: Robot, readings: Readings, slips: tuple[float, ...] = ()) -> tuple[Spring, ...]:
    """Return the layout `links` with gears for axial springs.

    Parameters
    ----------
    robot : Robot
        The robot; joints that slide keep linear springs.
    readings : Readings
        Their median torque about each joint scales its gear; joints that they do not load keep
        linear springs.
    slips : tuple of float
        Limits of friction elements, in that torque; none without. Those that no load made slide
        by far are left out.
    """
    return _with_gears(links(robot), robot, readings, slips)


def bearing_gears(robot: Robot, readings: Readings) -> tuple[Spring, ...]:
    """Return the layout `bearing` with gears for axial springs, without friction; see `gears`."""
    return _with_gears(bearing(robot), robot, readings)


def _with_gears(
    springs: tuple[Spring, ...], robot: Robot, readings: Readings, slips: tuple[float, ...] = ()
) -> tuple[Spring, ...]:
    """Return springs with gears in place of the first of them, one a joint."""
    model = ElasticModel(robot, actuated(robot))
    torque = model.load_torques(readings.joint_position, readings.force, readings.moment)
    typical = dict(zip(robot.joint_names, np.median(np.abs(torque), axis=0), strict=True))
    largest = dict(zip(robot.joint_names, np.abs(torque).max(axis=0), strict=True))
    least = _LOADED * max(typical.values())

    def geared(spring: Spring, axial: bool) -> Spring:
        axis = spring.axes[0]
        size = float(typical[spring.joint])
        if not (axial and axis.revolute and size > least):
            return spring
        slides = [size * part for part in slips if size * part <= _SLIDES * largest[spring.joint]]
        parts = _KNEES_OF_PLAYS if slides else _KNEES
        knees = tuple(_rounded(size * part) for part in parts)
        limits = tuple(map(_rounded, slides))
        place = (spring.name, spring.joint, axis.axis)
        return Gear(*place, knees=knees, slips=limits, plays=bool(limits))

    count = len(robot.joint_names)
    return tuple(geared(spring, index < count) for index, spring in enumerate(springs))


RUNGS: dict[str, Rung] = {
    rung.name: rung
    for rung in (
        Rung("actuated", lambda robot, _: actuated(robot)),
        Rung("bearing", lambda robot, _: bearing(robot)),
        Rung("bearing-ends", lambda robot, _: bearing_ends(robot)),
        Rung("links", lambda robot, _: links(robot)),
        Rung("tensor", lambda robot, _: tensor(robot)),
        Rung("bearing-gears", bearing_gears, by_contact=True),
        Rung("gears", gears),
        Rung(
            "gears+friction",
            lambda robot, readings: gears(robot, readings, _SLIPS),
            needs_levels=True,
        ),
        Rung(
            "gears+fine-friction",
            lambda robot, readings: gears(robot, readings, _FINE_SLIPS),
            needs_levels=True,
        ),
    )
}
"""Rungs by name, the simplest first."""


def allowed_rungs(springs: str) -> tuple[str, ...]:
    """Return the names of the rungs that the option for springs leaves to choose from."""
    gears = tuple(name for name in RUNGS if name.startswith("gears"))
    return {AUTO: tuple(RUNGS), "gears": gears}.get(springs, (springs,))


def rung_of(robot: Robot, name: str) -> Rung:
    """Return a rung, or a layout outside the ladder as one.

    Raises
    ------
    SpringError
        If the name is neither a rung, nor a layout, nor a spring file.
    """
    if name in RUNGS:
        return RUNGS[name]
    springs = layout(robot, name, beside=(AUTO, *RUNGS))
    return Rung(name, lambda *_: springs)


def has_levels(readings: Readings) -> bool:
    """Return whether there are load cases of low load beside those of full load."""
    # The largest force at a pose is never low beside itself.
    return bool(np.any(low_loads(readings)))


def low_loads(readings: Readings) -> BoolArray:
    """Return whether each reading is of low load among those at its pose, shape (reading,)."""
    force = np.linalg.norm(readings.force, axis=1)
    labels, pose = np.unique(readings.pose, return_inverse=True)
    largest = np.zeros(len(labels))
    np.maximum.at(largest, pose, force)
    return np.asarray(force < _LOW_LEVEL * largest[pose])


def _rounded(torque: float) -> float:
    """Return a torque of two digits, which is all that its choice deserves."""
    return float(f"{torque:.2g}")
