"""The driver of KUKA arms, as `elastocal run` finds it by its name ``kuka_rsi``."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

from elastocal.cell import (
    Cell,
    DeviceSet,
    DeviceSettings,
    LineCounts,
    PathLimits,
    PathSource,
    RigContext,
    refused_telegrams,
)
from elastocal.drivers.kuka_rsi._listener import KukaListener
from elastocal.drivers.kuka_rsi.arm import KukaArm
from elastocal.drivers.kuka_rsi.corrections import CorrectedKuka
from elastocal.drivers.kuka_rsi.link import LinkAddress, RsiLink
from elastocal.drivers.kuka_rsi.settings import RsiSettings, bounds_of
from elastocal.errors import DeviceError, of_kind, present
from elastocal.results import brief_repr

_TO_THE_LOOP = 1.0
"""From RSI_ON to the loop of the controller's program, at most, in s of the wall."""
_LIMITS = ("largest_correction", "correction_speed")
"""Keys without which no path is corrected."""


def connect_arm(cell: Cell, settings: RsiSettings, context: RigContext) -> KukaArm:
    """Return the arm of a cell once its controller has spoken; its `link` is to be closed.

    Raises
    ------
    DeviceError
        If the port cannot be had, or the controller sends nothing in time.
    """
    if settings.mode == "compensation":
        raise DeviceError(
            f"{cell.path}: devices.arm.mode is compensation: such an arm follows its own program,"
            " and carries out no procedure; mode must be measure or contact"
        )
    clock, (port,) = context.clock, settings.own_ports()
    arm = KukaArm(cell, settings, clock, context.feed)
    place = LinkAddress(
        settings.address, settings.port, settings.robot, settings.cycle, settings.mode != "measure"
    )
    link = RsiLink(place, arm, clock, listener=context.listener(port))
    arm.link = link
    link.start()
    if not link.wait(settings.wait):
        statistics = link.statistics()
        link.close()
        raise DeviceError(
            f"kuka_rsi: nothing from {settings.robot} at {settings.address}:{link.port} for"
            f" {settings.wait:g} s ("
            f"{refused_telegrams(statistics.malformed, statistics.refused, statistics.foreign)}):"
            " start the program on the controller now, while elastocal listens"
        )
    # The first messages come before the program is in its loop.
    end = time.monotonic() + _TO_THE_LOOP
    while settings.mode == "contact" and not arm.listens() and time.monotonic() < end:
        time.sleep(settings.cycle)
    return arm


@brief_repr
@dataclass(frozen=True)
class KukaRsiDriver:
    """Makes arms; see `elastocal.cell.Driver`."""

    kinds: frozenset[str] = frozenset({"arm"})
    real: bool = True

    def settings(self, kind: str) -> type[DeviceSettings]:  # noqa: ARG002 - there is one kind
        """Return the model of what stands under an arm."""
        return RsiSettings

    def connect(
        self, cell: Cell, wanted: Mapping[str, DeviceSettings], context: RigContext
    ) -> DeviceSet:
        """Return the arm."""
        settings = of_kind(wanted["arm"], RsiSettings, "settings")
        if context.watches:
            return KukaListener(cell, settings, context).devices()
        arm = connect_arm(cell, settings, context)
        link = present(arm.link, "link")

        def lines() -> tuple[LineCounts, ...]:
            return (link.statistics().counts(arm.guard.saturated, link.source),)

        return DeviceSet(arm=arm, close=link.close, lines=lines)

    def path_limits(self, cell: Cell, settings: DeviceSettings) -> PathLimits:
        """Return the limits of corrections; see `elastocal.cell.PathDriver`."""
        settings = of_kind(settings, RsiSettings, "settings")
        place = f"{cell.path}: devices.arm"
        if settings.mode != "compensation":
            raise DeviceError(
                f"{place}.mode is {settings.mode}: must be compensation to correct a path"
            )
        missing = [key for key in _LIMITS if getattr(settings, key) is None]
        missing += [key for key in _LIMITS if key not in settings.model_fields_set]
        if missing:
            raise DeviceError(
                f"{place} states no {' and no '.join(dict.fromkeys(missing))}: corrections of a"
                " path need limits that somebody has chosen, and no default is one"
            )
        bounds = bounds_of(cell, settings)
        return PathLimits(bounds.correction, bounds.speed, settings.cycle, "base")

    def correct_path(
        self, cell: Cell, settings: DeviceSettings, context: RigContext, source: PathSource
    ) -> CorrectedKuka:
        """Return the arm, listened to and answered; see `elastocal.cell.PathDriver`."""
        settings = of_kind(settings, RsiSettings, "settings")
        return CorrectedKuka(cell, settings, context, source)


DRIVER = KukaRsiDriver()
