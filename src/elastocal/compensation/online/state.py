"""State of the compensator: what goes into a step, what it remembers, and what comes out.

Plain tuples of floats: a step takes microseconds, and an array of three costs one.
"""

from collections.abc import Sequence
from enum import IntFlag
from typing import NamedTuple

Triple = tuple[float, float, float]


class Status(IntFlag):
    """Flags that a correction is to be read with; the C header has the same numbers."""

    OK = 0
    HELD = 1
    """No usable reading in this cycle: the last correction is held."""
    FADED = 2
    """No reading for longer than the hold: the correction fades to zero, or has faded."""
    LIMITED = 4
    """The deflection asks for more than the largest correction."""
    RATE = 8
    """The correction is still approaching its target."""
    DEADBAND = 16
    """The deflection is so small that it is not corrected, or not fully."""
    UNCERTAIN = 32
    """The interval of the predicted deflection is wider than the settings allow."""
    STALE = 64
    """The time of the last reading did not advance, went back, or jumped ahead."""
    SATURATED = 128
    """The last reading is beyond the sensor's range."""
    INVALID = 256
    """The last reading holds a NaN or an infinity, or a joint far beyond any travel."""
    SENSOR = 512
    """The sensor called the last reading bad."""
    OFFSET = 1024
    """The reading at the start of the course was not taken: its offset stays what it was."""
    ENCODER = 2048
    """A position of a link was missing, no joint's, or farther from the model than any gear turns:
    what the encoders saw last counts."""


class Reading(NamedTuple):
    """A reading of arm and sensor."""

    time: float
    """Time of the reading by the sensor's clock, in s; it must advance."""
    q: Sequence[float]
    """Joint positions, measured, in rad or m."""
    force: Sequence[float]
    """Raw, in the sensor's frame, in N."""
    moment: Sequence[float]
    """Raw, in the sensor's frame, about its origin, in N·m."""
    ok: bool = True
    """Whether the sensor calls it good."""
    links: Sequence[float] | None = None
    """Positions of the links by secondary encoders, in the order of the settings, in rad or m;
    None: none were read."""


class State(NamedTuple):
    """The memory of a compensator from one step to the next."""

    time: float
    """Time of the last reading, in s."""
    fresh: bool
    """Whether a usable reading came since the last correction."""
    problem: int
    """Status flags of the last reading."""
    missed: int
    """Corrections since a usable reading, at most one more than are held."""
    window: tuple[tuple[float, ...], ...]
    """The last wrenches, newest first, one fewer than the median takes."""
    memory: tuple[tuple[list[float], list[float]], ...]
    """z1 and z2 of each section, by component; never changed in place."""
    wrench: tuple[float, ...]
    """Conditioned wrench in the tcp frame: force in N, moment in N·m."""
    correction: Triple
    """Last correction, in m."""
    deflection: Triple
    """Last predicted deflection, in base, in m."""
    half_width: float
    """Half its 95 % interval, in m."""
    friction: tuple[float, ...] = ()
    """State of the friction memory, in the order of the kernel; empty: none."""
    unloaded: int = 0
    """Corrections in a row without a load, at most as many as wear the memory off."""
    offset: Triple = (0.0, 0.0, 0.0)
    """Offset of the course, in base, in m: the tool's error beyond deflection and growth."""
    refused: int = 0
    """`Status.OFFSET` where the last reading of a course was not taken, else 0."""
    beyond: tuple[float, ...] = ()
    """What the secondary encoders see beyond the model, smoothed, in rad or m; empty: nothing yet,
    or there are none."""
    zero: tuple[float, ...] = ()
    """The same when they were zeroed; empty: they were not, and the model alone corrects."""


class Correction(NamedTuple):
    """The correction of a cycle, for the controller."""

    correction: Triple
    """Change of the commanded position, in the settings' frame, in m."""
    deflection: Triple
    """Predicted deflection, in base, in m; the last one while the correction is held."""
    half_width: float
    """Half the 95 % interval of its most uncertain component, in m."""
    status: int
    """`Status` flags."""


def rkorr(correction: Triple) -> tuple[float, float, float, float, float, float]:
    """Return a correction as RKorr: X, Y, Z in mm, A, B, C in degrees.

    For an absolute correction (``RSI_ON(#ABSOLUTE)``, ``HOLDON="1"``); the object POSCORR must
    name the frame that the compensator corrects in: ``base`` is its ``RobRoot`` where the model
    begins at the robot's root, ``tcp`` its ``Tool``. The orientation is not corrected.

    >>> rkorr((1e-3, 0.0, -2.5e-4))
    (1.0, 0.0, -0.25, 0.0, 0.0, 0.0)
    """
    x, y, z = correction
    return 1e3 * x, 1e3 * y, 1e3 * z, 0.0, 0.0, 0.0
