"""State of the arm in one cycle, and what is to be done until the next."""

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.drivers.kuka_rsi.messages import MoveTarget, Order, ProgramState
from elastocal.errors import DeviceError
from elastocal.results import brief_repr

EXACT = 2e-5
"""How near to its goal a straight move has to end, in m."""
AMISS = 1e-3
"""How far from it the arm may be left, in m; more, and the controller did not follow."""
ANSWERS = 3.0
"""Time in which the program on the controller does as it is told, and a sensor speaks, in s."""


def _zero() -> FloatArray:
    return np.zeros(3)


@brief_repr
@dataclass(frozen=True, eq=False)
class Cycle:
    """State of the arm in one cycle, in SI."""

    time: float
    """In s of the clock."""
    q: FloatArray
    """Shape (joint,), in rad or m."""
    T_base_tcp: FloatArray
    """Shape (4, 4)."""
    offset: FloatArray
    """Correction that is in effect, RIst less RSol, base, shape (3,), in m."""
    state: int
    """A `ProgramState`."""
    command: int
    """Number of the last ``PTP`` that is over."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Step:
    """What is to be done until the next cycle."""

    shift: FloatArray = field(default_factory=_zero)
    """Movement of the tool, base, shape (3,), in m."""
    order: Order = Order.GUIDE
    target: MoveTarget | None = None


Motion = Generator[Step, Cycle, None]
Phase = Generator[Step, Cycle, Cycle]


@dataclass(frozen=True)
class Pace:
    """How straight moves go."""

    cycle: float
    """In s."""
    delay: float
    """From command to motion, in s."""
    acceleration: float
    """In m/s²."""


def guided(cycle: Cycle) -> Phase:
    """Wait until corrections act."""
    told = cycle.time
    while cycle.state != ProgramState.GUIDED:
        if not cycle.time - told <= ANSWERS:
            raise does_not_answer("RSI_MOVECORR", cycle)
        cycle = yield Step()
    return cycle


def does_not_answer(what: str, cycle: Cycle) -> DeviceError:
    """Return the error of a program that does not do as it is told."""
    known = [state.name.lower() for state in ProgramState if state == cycle.state]
    return DeviceError(
        f"the program on the controller does not begin {what}: it is"
        f" {known[0] if known else cycle.state} for {ANSWERS:g} s"
    )
