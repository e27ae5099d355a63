"""The driver of KUKA arms, as `elastocal run` finds it by its name ``kuka_rsi``.

It also holds the arm that is only monitored, for `elastocal watch`.

RSI has to be answered, or the controller stops by its ``Timeout``. In mode ``contact`` the answer
is the one of an arm that is not enabled: no movement, order HOLD. In mode ``compensation`` none is
given: an answer would let the program go on along its path without corrections. In mode
``measure`` the controller expects none.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastocal.cell import (
    Cell,
    DeviceReading,
    DeviceSet,
    DeviceSettings,
    LineCounts,
    PathLimits,
    PathSource,
    RigContext,
    refused_telegrams,
    three,
)
from elastocal.drivers.device_clock import DeviceClock
from elastocal.drivers.kuka_rsi.arm import KukaArm
from elastocal.drivers.kuka_rsi.corrections import CorrectedKuka
from elastocal.drivers.kuka_rsi.link import Cycle, LinkAddress, RsiLink
from elastocal.drivers.kuka_rsi.messages import (
    Arrival,
    MoveTarget,
    Order,
    ProgramState,
    RobMessage,
    SenMessage,
)
from elastocal.drivers.kuka_rsi.posture import PostureReader
from elastocal.drivers.kuka_rsi.settings import RsiSettings, bounds_of
from elastocal.errors import DeviceError, of_kind, present
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T

_SILENT = 0.5
"""Time without a message after which the controller counts as silent, in s of the wall."""
_STATES = {
    ProgramState.ABSENT: "program not in its loop",
    ProgramState.STANDING: "program stands, corrections do not act",
    ProgramState.GUIDED: "in RSI_MOVECORR, corrections act",
    ProgramState.MOVING: "on a PTP",
    ProgramState.ARRIVED: "a PTP is over",
    ProgramState.BRAKED: "a PTP was given up on the way",
    ProgramState.ENDED: "program ended",
}


class KukaListener:
    """Handler of a link that moves nothing; see `elastocal.drivers.kuka_rsi.Handler`.

    Parameters
    ----------
    settings : RsiSettings
        Settings of its arm.
    context : RigContext
        Context of the rig.

    Raises
    ------
    DeviceError
        If the port cannot be had, or the robot is none that RSI can carry.
    """

    def __init__(self, cell: Cell, settings: RsiSettings, context: RigContext) -> None:
        self._settings, self._postures = settings, PostureReader(cell.robot, settings.signs)
        self._cycle: Cycle | None = None
        self._program: int | None = None
        self._unusable = ""
        (port,) = settings.own_ports()
        answers = settings.mode == "contact"
        place = LinkAddress(
            settings.address, settings.port, settings.robot, settings.cycle, answers
        )
        self._link = RsiLink(place, self, context.clock, listener=context.listener(port))
        self._stamps = DeviceClock(self._link.source)
        self._link.start()

    def devices(self) -> DeviceSet:
        """Return the part for a rig: readings, and no arm."""
        return DeviceSet(close=self._link.close, readings=lambda: (self._reading(),))

    def step(self, message: RobMessage, arrival: Arrival, now: float) -> SenMessage:
        """Return the answer to a message, which moves nothing."""
        if arrival is not Arrival.OUT_OF_ORDER:
            self._note_time(message.ipoc, now)
        self._program = message.state
        try:
            self._cycle = self._postures.read(message, now, self._settings.mode)
            self._unusable = ""
        except DeviceError as error:
            self._unusable = str(error)
        target = MoveTarget(message.command or 0)
        return SenMessage(order=Order.HOLD, target=target, sentype=self._settings.sentype)

    def _note_time(self, ipoc: int, now: float) -> None:
        try:
            self._stamps.rig_time(1e-3 * ipoc, now)
        except DeviceError:
            # A program that restarts, or a counter that restarts from zero or one.
            self._stamps = DeviceClock(self._link.source)

    def _reading(self) -> DeviceReading:
        self._link.require()
        cycle, found, between = self._cycle, self._link.statistics(), self._link.between
        offset, drift = self._stamps.against_the_pc()
        pose = None if cycle is None else xyzabc_from_T(cycle.T_base_tcp)
        return DeviceReading(
            kind="arm",
            device=self._link.source,
            heard=self._link.silent is not None,
            problem=self._problem(),
            state=self._state(),
            counts=found.counts(0, self._link.source),
            cycle=(float(np.median(between)), max(between)) if between else None,
            delay=found.controller_delay,
            offset=offset,
            drift=drift,
            position=None if pose is None else three(pose[:3]),
            turn=None if pose is None else three(pose[3:]),
        )

    def _problem(self) -> str:
        silent, found, settings = self._link.silent, self._link.statistics(), self._settings
        if silent is None:
            refused = refused_telegrams(found.malformed, found.refused, found.foreign)
            return (
                f"nothing heard yet from {settings.robot} at {settings.address} port"
                f" {self._link.port} ({refused})"
            )
        if silent > _SILENT:
            unanswered = ", which stops by its Timeout: watch answers no compensation"
            why = unanswered if settings.mode == "compensation" else ""
            return f"nothing from the controller for {silent:.1f} s{why}"
        if self._unusable:
            return self._unusable
        try:
            if self._cycle is not None:
                self._postures.require_model(self._cycle, settings.model_tolerance)
        except DeviceError as error:
            return str(error).removeprefix("kuka_rsi: ")
        return ""

    def _state(self) -> str:
        state, cycle = self._program, self._cycle
        if self._link.silent is None:
            return f"mode {self._settings.mode}"
        known = [text for each, text in _STATES.items() if each == state]
        stated = known[0] if known else "program states nothing"
        effect = (
            "" if cycle is None else f", correction {1e3 * np.linalg.norm(cycle.offset):.3f} mm"
        )
        return f"mode {self._settings.mode}: {stated}{effect}"


_TO_THE_LOOP = 1.0
"""Largest time from RSI_ON to the loop of the controller's program, in s of wall time."""
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
        """Return the settings model of an arm."""
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
"""The driver that cell files name; see `KukaRsiDriver`."""
