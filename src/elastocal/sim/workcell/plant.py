"""What the simulated devices share: time, the robot, the tooling, and what is going on."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.cell.devices import Motion
from elastocal.robot import (
    inverse_transform,
)
from elastocal.sim.workcell.clock import SimClock
from elastocal.sim.workcell.contact import Contact, ContactLaw
from elastocal.sim.workcell.keys import generator, posture_key
from elastocal.sim.workcell.quasistatics import Quasistatics, Stand
from elastocal.sim.workcell.robot import TrueRobot
from elastocal.sim.workcell.schedule import Schedule
from elastocal.sim.workcell.segment import Ripple, Segment
from elastocal.sim.workcell.surface import TrueSurface
from elastocal.sim.workcell.time_laws import TimeLaw, Uniform
from elastocal.sim.workcell.ways import Way

_DRAWS = 64
"""Random stops and slips of a visit; more begin anew."""
_DONE = 1.0 - 1e-3
"""A change of force this far along counts as made when the gears' memory is asked."""


class Instrument(Protocol):
    """A device that samples what goes on."""

    def catch_up(self, now: int) -> None:
        """Take the samples that are due at a time in µs."""
        ...

    def restart(self, now: int, key: str) -> None:
        """Begin to count samples, with the noise that belongs to a key."""
        ...


class Plant:
    """The cell as it really is. Devices look into it; nothing else does."""

    def __init__(self, cell: Cell, seed: int, clock: SimClock) -> None:
        """Set the cell up, the arm at HOME."""
        self.cell, self.seed, self.clock = cell, seed, clock
        self._weighed = self.statics = Quasistatics.of(cell, TrueRobot.of(cell))
        self.surface = TrueSurface.of(cell)
        self.contact_law = ContactLaw.of(cell)
        self.schedule = Schedule(cell)
        self.contact: Contact | None = None
        self.instruments: list[Instrument] = []
        self._pressing = _unit_wrench(self.statics.robot)
        self.visit = -1
        self.key = posture_key(cell.home)
        self._stops, self._slips = np.zeros((_DRAWS, 3)), np.zeros((_DRAWS, 2))
        self._drawn = 0
        self._draw()
        self._events: list[tuple[int, Callable[[], None]]] = []
        stand = self.statics.free(cell.home, self.stop_error(), None)
        self.segment = self.standing(stand, Motion.DISARMED)
        self._sag = stand.sag
        clock.on_wake(self.wake)

    @property
    def now(self) -> int:
        """The time in µs; while something due is done, the time at which it was due."""
        return self._now if self._now is not None else self.clock.microseconds

    _now: int | None = None

    def wake(self, now: int) -> None:
        """Do what was due until a time in µs, in its order."""
        while self._events and self._events[0][0] <= now:
            self._now, act = self._events.pop(0)
            act()
        self._now = None

    def later(self, time: int, act: Callable[[], None]) -> None:
        """Have something done at a time in µs."""
        self._events.append((time, act))
        self._events.sort(key=lambda event: event[0])

    def begin_journey(self, target: FloatArray) -> None:
        """Set out for a posture: stop errors and slips are those that belong to it."""
        self.key = posture_key(target)
        self._draw()
        self._restart_instruments("on the way to")

    def begin_visit(self) -> None:
        """Begin to approach the surface from the posture that the arm was last sent to."""
        self.visit += 1
        more = sum(fault.mass for fault in self.schedule.lasting("tool_weight", self.visit))
        self.statics = self._weighed.heavier(more) if more else self._weighed
        self._drawn = 1
        self._restart_instruments("from")

    def _draw(self) -> None:
        entry = self.cell.file.simulation.controller
        stops = generator(self.seed, "stops", self.key).standard_normal((_DRAWS, 3))
        self._stops = entry.repeatability * stops
        self._slips = generator(self.seed, "slips", self.key).standard_normal((_DRAWS, 2))
        self._drawn = 0

    def _restart_instruments(self, what: str) -> None:
        for instrument in self.instruments:
            instrument.catch_up(self.now)
            instrument.restart(self.now, f"{what} {self.key}")

    def stop_error(self) -> FloatArray:
        """Return the error of the next stop, shape (3,), in m."""
        self._drawn += 1
        error: FloatArray = self._stops[self._drawn % _DRAWS]
        return error

    def slip(self, load: int) -> FloatArray:
        """Return the random slip of a load case in standard deviations, shape (2,)."""
        slip: FloatArray = self._slips[load % _DRAWS]
        return slip

    def switch(self, segment: Segment) -> None:
        """Go over to another segment now."""
        for instrument in self.instruments:
            instrument.catch_up(self.now)
        self.segment = segment

    def run(
        self,
        way: Way,
        law: TimeLaw,
        motions: tuple[Motion, Motion],
        start: Stand,
        *,
        fault: str | None = None,
        ripple: Ripple | None = None,
    ) -> Segment:
        """Set out on a way and return the segment.

        Parameters
        ----------
        way : Way
            From ``start`` on.
        law : TimeLaw
            How the time goes.
        motions : tuple of Motion
            What the arm does on the way, and at its end.
        start : Stand
            Where it is.
        fault : str, optional
            What the controller says at the end.
        ripple : Ripple, optional
            Unrest of the force.
        """
        theta = way.end.theta
        assert theta is not None
        segment = Segment(
            begin=self.now,
            law=law,
            knots=way.knots,
            motion=motions[0],
            motion_after=motions[1],
            springs=(start.springs, way.end.springs),
            theta=theta,
            fault_after=fault,
            ripple=ripple,
            ripple_wrench=self._pressing,
        )
        self.switch(segment)
        return segment

    def stand(self) -> Stand:
        """Return where the robot is now, with the memory that it has gathered so far."""
        segment, progress = self.segment, self.segment.progress(self.now)
        knots, where = segment.knots, np.array([progress])
        columns = (knots.q, knots.twist, knots.force)
        q, twist, force = (knots.at(column, where)[0] for column in columns)
        done = progress >= _DONE
        springs, theta = segment.springs[int(done)], segment.theta
        if not done and self.contact is not None:
            rest = self.statics.robot.rest(q, force, springs, theta)
            springs, theta = rest.springs, rest.theta
        return Stand(q, twist, force, springs, theta, self._sag)

    def note_sag(self, stand: Stand) -> None:
        """Remember the sag of the last free stand, which the controller partly takes out."""
        self._sag = stand.sag

    def standing(self, stand: Stand, motion: Motion, fault: str | None = None) -> Segment:
        """Return a segment in which nothing moves."""
        both = np.array([0.0, 1.0])
        columns = (np.stack([c, c]) for c in (stand.q, stand.twist, stand.force))
        theta = stand.theta
        return Segment(
            begin=self.now,
            law=Uniform(0.0),
            knots=self.statics.knots(both, *columns),
            motion=motion,
            motion_after=motion,
            springs=(stand.springs, stand.springs),
            theta=np.zeros(len(stand.springs.stiffness)) if theta is None else theta,
            fault_after=fault,
        )


def _unit_wrench(robot: TrueRobot) -> FloatArray:
    """Return the wrench of 1 N that presses on the tool, sensor frame, shape (6,)."""
    T_sensor_tcp = inverse_transform(robot.T_tcp_sensor)
    force = -T_sensor_tcp[:3, 2]
    return np.concatenate([force, np.cross(T_sensor_tcp[:3, 3], force)])
