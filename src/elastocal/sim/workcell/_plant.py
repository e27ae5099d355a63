"""The plant that all simulated devices share: time, robot, tooling, faults, current segment."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell, Motion
from elastocal.errors import DeviceError, nearest
from elastocal.robot import inverse_transform
from elastocal.sim.truth import Fault, faults_of, truth_of
from elastocal.sim.workcell._contact import Contact, ContactLaw, TrueSurface
from elastocal.sim.workcell._imperfections import DRAWS, VisitChance
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._robot import TrueRobot
from elastocal.sim.workcell._timeline import (
    Ripple,
    RobotPath,
    RobotState,
    Segment,
    SimClock,
    TimeLaw,
    Uniform,
    generator,
    posture_key,
    to_microseconds,
)

FOREVER = 1 << 62
"""Later than any time, in µs."""
SPANS = (
    *("beam_break", "ft_dropout", "ft_frozen", "ft_saturation", "soft_collision", "stale_clock"),
)
"""Faults that last for a while, whatever the arm does."""
_COLLISION_RISE = 100_000
"""Time in which the force of a soft collision comes, in µs."""
_DONE = 1.0 - 1e-3
"""Part of a change of force beyond which it counts as made for the gears' memory."""


@dataclass(frozen=True)
class FaultSpan:
    """Period in which a device has a fault."""

    kind: str
    begin: int
    """In µs."""
    end: int
    """End in µs, exclusive."""
    station: str | None
    """Tracker station; None: all."""
    force: float = 0.0
    """Force of a soft collision, in N."""

    def holds(self, now: int) -> bool:
        """Return whether a time in µs lies in it."""
        return self.begin <= now < self.end


class FaultSchedule:
    """Faults of a cell, and what has become of them."""

    def __init__(self, cell: Cell) -> None:
        """Take the faults of the cell file.

        Raises
        ------
        DeviceError
            If a fault names a tracker station that is not there.
        """
        names = [tracker.name for tracker in cell.file.trackers]
        for fault in faults_of(cell):
            if fault.station is not None and fault.station not in names:
                raise DeviceError(
                    f"fault {fault.kind}: there is no tracker station {fault.station!r}"
                    f"{nearest(fault.station, names)} (stations: {', '.join(names)})"
                )
        self._faults = faults_of(cell)
        self.active: list[FaultSpan] = []

    def begin(self, step: str, visit: int, load: int, now: int) -> list[tuple[int, Fault]]:
        """Note the faults that follow from the beginning of a step.

        Returns those that strike the arm, each with its time in µs.

        Parameters
        ----------
        step : str
            See `elastocal.sim.truth.Fault.step`.
        visit : int
            Number of the visit.
        load : int
            Number of the load case of the visit.
        now : int
            In µs.
        """
        moments = []
        self.active = [span for span in self.active if span.end > now]
        for fault in self.at(visit):
            if fault.step != step or (step == "hold" and fault.load != load):
                continue
            start = now + to_microseconds(fault.after)
            if fault.kind in SPANS:
                last = FOREVER if fault.duration is None else to_microseconds(fault.duration)
                place, force = fault.station, fault.amplitude
                self.active.append(FaultSpan(fault.kind, start, start + last, place, force))
            elif fault.kind in ("slip", "robot_stop"):
                moments.append((start, fault))
        return moments

    def at(self, visit: int) -> list[Fault]:
        """Return the faults of a visit."""
        return [f for f in self._faults if 0 <= visit - f.pose < f.visits]

    def lasting(self, kind: str, visit: int) -> list[Fault]:
        """Return faults of a kind that stay once they have come."""
        return [f for f in self._faults if f.kind == kind and f.pose <= visit]

    def spans(self, kind: str) -> list[FaultSpan]:
        """Return the spans of a kind of fault."""
        return [span for span in self.active if span.kind == kind]

    def collision_force(self, times: IndexArray) -> FloatArray:
        """Return the force of soft collisions along x of the sensor at times in µs, in N."""
        force = np.zeros(len(times))
        for hit in self.spans("soft_collision"):
            grown = np.clip((times - hit.begin) / _COLLISION_RISE, 0.0, 1.0)
            force += hit.force * grown * (times < hit.end)
        return force

    def struck(self, kind: str, times: IndexArray, station: str | None = None) -> IndexArray:
        """Return which samples a span of some kind of fault covers, as indices.

        Parameters
        ----------
        kind : str
            Kind of fault.
        times : ndarray of int, shape (sample,)
            In µs.
        station : str, optional
            Tracker station that measures.
        """
        covered = np.zeros(len(times), dtype=bool)
        for span in self.spans(kind):
            if span.station in (None, station):
                covered |= (times >= span.begin) & (times < span.end)
        return np.flatnonzero(covered)


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
        self.schedule = FaultSchedule(cell)
        self.contact: Contact | None = None
        self.disks = 1
        self.instruments: list[Instrument] = []
        self._pressing = _unit_wrench(self.statics.robot)
        self.visit = -1
        self.key = posture_key(cell.home)
        self._stops, self._slips = np.zeros((DRAWS, 3)), np.zeros((DRAWS, 2))
        self._drawn = 0
        self._draw()
        self._events: list[tuple[int, Callable[[], None]]] = []
        state = self.statics.free(cell.home, self.stop_error(), None)
        self.stand(state, Motion.DISARMED)
        clock.on_wake(self.wake)

    @property
    def now(self) -> int:
        """The time in µs; while something due is done, the time at which it was due."""
        return self._now if self._now is not None else self.clock.microseconds

    _now: int | None = None

    def wake(self, now: int) -> None:
        """Carry out what is due until a time in µs, in order."""
        while self._events and self._events[0][0] <= now:
            self._now, act = self._events.pop(0)
            act()
        self._now = None

    def later(self, time: int, act: Callable[[], None]) -> None:
        """Schedule a function for a time in µs."""
        self._events.append((time, act))
        self._events.sort(key=lambda event: event[0])

    def begin_journey(self, target: FloatArray) -> None:
        """Set out for a posture: stop errors and slips are those that belong to it."""
        stated = self.statics.stated_warmth
        # Cold and warm are two occasions: nothing random is the same in both.
        self.key = posture_key(target) + ("" if stated is None else f", warm by {stated:g}")
        self._draw()
        self._restart_instruments("on the way to")

    def begin_visit(self) -> None:
        """Begin to approach the surface from the posture that the arm was last sent to."""
        self.visit += 1
        more = sum(fault.mass for fault in self.schedule.lasting("tool_weight", self.visit))
        weighed = self._weighed.heavier(more) if more else self._weighed
        self.statics = weighed.visited(self.chance)
        self._drawn = 1
        self._restart_instruments("from")

    def _draw(self) -> None:
        entry = truth_of(self.cell).controller
        stops = generator(self.seed, "stops", self.key).standard_normal((DRAWS, 3))
        self._stops = entry.repeatability * stops
        self._slips = generator(self.seed, "slips", self.key).standard_normal((DRAWS, 2))
        self._drawn = 0
        self.chance = VisitChance.of(self.seed, self.key)
        self.statics = self.statics.visited(self.chance)

    def _restart_instruments(self, what: str) -> None:
        for instrument in self.instruments:
            instrument.catch_up(self.now)
            instrument.restart(self.now, f"{what} {self.key}")

    def stack(self, disks: int) -> None:
        """Let so many disks be stacked between tool and tooling, from the next contact on."""
        self.disks = disks

    @property
    def stacked(self) -> float:
        """Height of the disks beyond the first, in m."""
        thickness = self.cell.file.engagement.disk_thickness or 0.0
        return (self.disks - 1) * thickness

    def contact_law_at(self, point: FloatArray) -> ContactLaw:
        """Return the law of the disks at a point of the tooling, shape (3,), in base, in m."""
        return self.contact_law.at(point, self.disks)

    def stop_error(self) -> FloatArray:
        """Return the error of the next stop, shape (3,), in m."""
        self._drawn += 1
        error: FloatArray = self._stops[self._drawn % DRAWS]
        return error

    def slip(self, load: int) -> FloatArray:
        """Return the random slip of a load case in standard deviations, shape (2,)."""
        slip: FloatArray = self._slips[load % DRAWS]
        return slip

    def run(
        self,
        path: RobotPath,
        law: TimeLaw,
        motions: tuple[Motion, Motion],
        *,
        fault: str | None = None,
        ripple: Ripple | None = None,
    ) -> Segment:
        """Set out on a path and return the segment.

        Parameters
        ----------
        path : RobotPath
            From where it is.
        law : TimeLaw
            How the time goes.
        motions : tuple of Motion
            Motion of the arm on the path, and at its end.
        fault : str, optional
            What the controller says at the end.
        ripple : Ripple, optional
            Unrest of the force.
        """
        for instrument in self.instruments:
            instrument.catch_up(self.now)
        self.segment = Segment(self.now, law, path, *motions, fault, ripple, self._pressing)
        return self.segment

    def stand(self, state: RobotState, motion: Motion, fault: str | None = None) -> None:
        """Stand still in a state."""
        self.run(self.statics.path(state, state), Uniform(0.0), (motion, motion), fault=fault)

    def robot_state(self) -> RobotState:
        """Return the robot's present state, with the friction memory of its history."""
        path, progress = self.segment.path, self.segment.progress(self.now)
        knots, where = path.knots, np.array([progress])
        columns = (knots.q, knots.twist, knots.force, knots.moment)
        q, twist, force, moment = (knots.at(column, where)[0] for column in columns)
        done = progress >= _DONE
        springs, theta = (path.end if done else path.start).springs, path.end.theta
        if not done and self.contact is not None:
            attack = self.contact.attack(force)
            rest = self.statics.robot.rest(q, force, springs, theta, attack)
            springs, theta = rest.springs, rest.theta
        return RobotState(q, twist, force, moment, springs, theta, path.end.sag)


def _unit_wrench(robot: TrueRobot) -> FloatArray:
    """Return the wrench of 1 N that presses on the tool, sensor frame, shape (6,)."""
    T_sensor_tcp = inverse_transform(robot.T_tcp_sensor)
    force = -T_sensor_tcp[:3, 2]
    return np.concatenate([force, np.cross(T_sensor_tcp[:3, 3], force)])
