"""How the controller takes the place where the arm stands for the programmed one."""

import numpy as np

from elastocal.drivers.kuka_rsi._cycle import AMISS, ANSWERS, Cycle, Motion, Step, guided
from elastocal.drivers.kuka_rsi.messages import MoveTarget, Order, ProgramState
from elastocal.errors import DeviceError

ADOPTS = 5.0
"""Longest time that the controller may take to switch RSI off and on again, in s."""


def adopt(cycle: Cycle, number: int) -> Motion:
    """Yield the steps by which the controller takes the present place for the programmed one.

    It sends nothing while RSI is off. A program that does not know the order stands by.

    Parameters
    ----------
    cycle : Cycle
        State at the beginning.
    number : int
        Of the command.

    Raises
    ------
    DeviceError
        If the controller does not do it, or the arm is somewhere else after it.
    """
    told, before = cycle.time, cycle.T_base_tcp[:3, 3]
    taken = False
    while cycle.command != number:
        taken |= cycle.state == ProgramState.MOVING
        if not taken and cycle.time - told > ANSWERS:
            raise DeviceError(
                f"the arm stands {1e3 * float(np.linalg.norm(cycle.offset)):.1f} mm from the"
                " programmed place, which may be the surface, and the program on the controller"
                " cannot take the present place for it: move the arm off by the pendant, or load"
                " the new elcal_run (`elastocal krc-config`)"
            )
        if not cycle.time - told <= ADOPTS:
            raise DeviceError(f"the controller did not switch RSI off and on in {ADOPTS:g} s")
        cycle = yield Step(order=Order.ADOPT, target=MoveTarget(number))
    cycle = yield from guided(cycle)
    away = float(np.linalg.norm(cycle.T_base_tcp[:3, 3] - before))
    left = float(np.linalg.norm(cycle.offset))
    if not (away <= AMISS and left <= AMISS):
        raise DeviceError(
            f"RSI was switched off and on: the arm moved {1e3 * away:.2f} mm and has a correction"
            f" of {1e3 * left:.2f} mm, limit {1e3 * AMISS:g} mm"
        )
