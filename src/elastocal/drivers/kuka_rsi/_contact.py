"""What one connection to a controller knows of contact and place.

Nothing is known at its beginning: the program may have been started where the tool presses, and
then the place where the correction is zero is the surface.
"""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell, CollisionWatch, WrenchFeed
from elastocal.drivers.kuka_rsi._cycle import Cycle
from elastocal.drivers.kuka_rsi.force_control import ForceReader
from elastocal.drivers.kuka_rsi.motions import ContactGuard
from elastocal.drivers.kuka_rsi.settings import RsiSettings
from elastocal.errors import DeviceError
from elastocal.robot import inverse_transform

_LET_GO = 0.3
"""Part of the contact force below which the tool has left the surface at the end of a retract."""
_SAME_ZERO = 1e-4
"""How far the programmed place may be from where the last ``PTP`` ended, in m."""


class ContactMemory:
    """Remembers what was felt and where a joint move has ended."""

    def __init__(self) -> None:
        self.guard: ContactGuard | None = None
        """What felt the contact that has not been left yet."""
        self.touched_at: FloatArray = np.zeros(3)
        """Correction there, base, shape (3,), in m."""
        self._is_free = False
        self._free_place: FloatArray | None = None

    @property
    def in_contact(self) -> bool | None:
        """Whether the tool touches; None: nothing has been felt or left."""
        return True if self.guard is not None else (False if self._is_free else None)

    def approached(self, guard: ContactGuard, cycle: Cycle) -> None:
        """Note how a guarded move ended."""
        self._is_free = not guard.felt
        if guard.felt:
            self.guard, self.touched_at = guard, cycle.offset

    def retracted(self, reader: ForceReader | None) -> None:
        """Note the end of a retract; without a force nothing is known then."""
        if self.guard is None or reader is None:
            return
        if reader.problem() is not None:
            self.guard, self._is_free = None, False
            return
        left = float(np.linalg.norm(reader.force_tcp))
        if left <= _LET_GO * self.guard.contact_force:
            self.guard, self._is_free = None, True

    def arrived(self, cycle: Cycle) -> None:
        """Note the end of a joint move, which nothing was felt on."""
        self._is_free, self._free_place = True, _programmed(cycle)

    def forget_place(self) -> None:
        """Note that the programmed place may become another one."""
        self._is_free, self._free_place = False, None

    def is_zero_free(self, cycle: Cycle) -> bool:
        """Return whether the place where the correction is zero is known to be free.

        A joint move of this connection has ended there. RSol is compared: a program that was
        restarted elsewhere gives itself away even where its start was not seen.
        """
        if self._free_place is None:
            return False
        return float(np.linalg.norm(_programmed(cycle) - self._free_place)) <= _SAME_ZERO


def _programmed(cycle: Cycle) -> FloatArray:
    """Return the programmed place, base, shape (3,), in m."""
    place: FloatArray = cycle.T_base_tcp[:3, 3] - cycle.offset
    return place


def feeling(
    cell: Cell, settings: RsiSettings, feed: WrenchFeed | None
) -> tuple[ForceReader | None, CollisionWatch | None]:
    """Return what an arm that presses feels by; nothing where it does not press."""
    if settings.mode != "contact":
        return None, None
    T_sensor_tcp = cell.T_sensor_tcp
    if feed is None or T_sensor_tcp is None:
        raise DeviceError(
            f"{cell.path}: devices.arm: mode contact needs a force sensor whose driver"
            " feeds the arm (section sensor, and devices.sensor)"
        )
    reader = ForceReader(feed, inverse_transform(T_sensor_tcp), settings.cycle)
    weight = cell.file.tool.mass * cell.gravity_base
    return reader, CollisionWatch(weight, settings.collision_force)
