"""The paths of the robot to where a command leads it, and force control at the surface.

Straight moves to the surface are guarded by the force; on one away from it the force fades.

In force control the force that the wrist sensor shows follows the wanted one along a straight ramp
with a first-order lag; what is commanded moves so that robot, disk and tooling are in equilibrium
under it. A lateral force beyond the friction limit is not reached: the contact slides.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Motion
from elastocal.errors import DeviceError, of_kind, present
from elastocal.sim.truth import Fault, truth_of
from elastocal.sim.workcell._contact import Contact
from elastocal.sim.workcell._imperfections import ForceGain
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._timeline import (
    Ripple,
    RobotPath,
    RobotState,
    Segment,
    SettlingRamp,
    TimeLaw,
    Uniform,
    generator,
)

CLOSED = 1e-8
"""Largest distance of the tool from the position that the contact gives, in m: 0.03 N of the
disk."""
_STEPS = 8
"""Pieces of a free movement between knots."""
_ROUNDS = 8
_BEYOND = 0.02
"""Distance beyond its end to which a move searches the surface, in m, since the arm sags."""
_LAST_TOUCH = 1e-4
"""Shortest path on which a force fades when the tool leaves, in m."""


def joint_path(statics: Quasistatics, start: RobotState, end: RobotState) -> RobotPath:
    """Return the straight path in joint space; the small deviations change evenly."""
    progress = np.linspace(0.0, 1.0, _STEPS + 1)
    q = _between(start.q, end.q, progress)
    twist, none = _between(start.twist, end.twist, progress), np.zeros((len(q), 3))
    return RobotPath(statics.knots(progress, q, twist, none, none), start, end)


def straight_path(statics: Quasistatics, states: list[RobotState]) -> RobotPath:
    """Return the straight path of the tool through some states, by its length.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    states : list of RobotState
        All with the same commanded orientation, on one line; those where nothing moves are left
        out, but for the last.
    """
    T = statics.robot.forward(np.stack([state.q for state in states]))
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    at = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(states))
    fine = np.unique(np.concatenate([at, np.linspace(0.0, 1.0, _STEPS + 1)]))
    names = ("twist", "force", "moment", "q")
    columns = (np.stack([getattr(state, name) for state in states]) for name in names)
    twist, force, moment, coarse = (_interpolated(at, column, fine) for column in columns)
    points = _interpolated(at, T[:, :3, 3], fine)
    q = statics.along(states[0].q, T[0, :3, :3], points[1:-1])
    q = np.concatenate([coarse[:1], q, coarse[-1:]])
    return RobotPath(statics.knots(fine, q, twist, force, moment), states[0], states[-1])


@dataclass(frozen=True, eq=False)
class GuardedMove:
    """End of a guarded move."""

    path: RobotPath
    contact: Contact | None
    """The tooling that is touched."""
    felt: bool
    """Whether the contact force was reached."""
    length: float
    """In m."""
    fault: str | None = None


def guarded_move(
    plant: Plant,
    start: RobotState,
    direction: FloatArray,
    distance: float,
    guard: tuple[float, float],
) -> GuardedMove:
    """Return a straight move that ends at a distance or when a force is felt.

    The arm stops a reaction time after the force is felt, so that the force overshoots by what
    robot, disk and tooling build up meanwhile.

    Parameters
    ----------
    plant : Plant
        The cell.
    start : RobotState
        Present state of the robot.
    direction : ndarray, shape (3,)
        Unit vector in base.
    distance : float
        Longest path, in m.
    guard : tuple of float
        Speed in m/s, and the force to stop at, in N.
    """
    statics, error = plant.statics, plant.stop_error()
    found = _touch(plant, start, direction, distance, error)
    if found is None:
        end = _moved(plant, start, distance * direction, error)
        return GuardedMove(straight_path(statics, [start, end]), None, False, distance)
    contact, touch = found
    entry = truth_of(plant.cell).controller
    speed, limit = guard[0], min(guard[1], entry.collision_force)

    def press(force: float) -> RobotState:
        return pressed_state(statics, touch, contact, lambda _: -force * direction, error)

    to_touch = _advance(plant, start, touch, direction)
    stiffness = limit / (_advance(plant, start, press(limit), direction) - to_touch)
    felt = to_touch + limit / stiffness <= distance
    force = limit + stiffness * speed * entry.reaction if felt else 0.0
    force = force or stiffness * max(distance - to_touch, 0.0)
    end = press(force) if force > 0.0 else touch
    on_the_way = [touch] if to_touch > 0.0 and end is not touch else []
    fault = None
    if felt and guard[1] > entry.collision_force:
        fault = f"collision: {entry.collision_force:g} N on a straight move"
    length = max(_advance(plant, start, end, direction), 0.0)
    path = straight_path(statics, [start, *on_the_way, end])
    return GuardedMove(path, contact, felt, length, fault)


def retract_path(
    plant: Plant, start: RobotState, direction: FloatArray, distance: float
) -> tuple[RobotPath, Contact | None]:
    """Return a straight move away from the surface, and the contact that is left.

    The force fades evenly until the tool is where it touched.

    Parameters
    ----------
    plant : Plant
        The cell.
    start : RobotState
        Present state of the robot.
    direction : ndarray, shape (3,)
        Unit vector in base, away from the surface.
    distance : float
        In m.
    """
    statics, error, contact = plant.statics, plant.stop_error(), plant.contact
    fades = 0.0
    if contact is not None and np.any(start.force):
        touched = replace(start, q=contact.q_touch)
        fades = max(_advance(plant, start, touched, direction), _LAST_TOUCH)
    if fades > distance:
        left = (1.0 - distance / fades) * start.force
        q = _moved(plant, start, distance * direction, error).q
        end = statics.loaded(start, q, left, error, contact.attack(left) if contact else None)
        return straight_path(statics, [start, end]), contact
    states = [start]
    if fades > 0.0:
        states.append(_moved(plant, start, fades * direction, error))
    states.append(_moved(plant, states[-1], (distance - fades) * direction, error))
    return straight_path(statics, states), None


def pressed_state(
    statics: Quasistatics,
    start: RobotState,
    contact: Contact,
    force: Callable[[FloatArray], FloatArray],
    stop_error: FloatArray,
) -> RobotState:
    """Return the equilibrium of robot, disk and tooling under a force.

    The commanded pose moves, orientation kept, until the tool is where disk and tooling hold it;
    the robot gives a little differently there, so it is done in rounds.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    start : RobotState
        Where it comes from, with its memory.
    contact : Contact
        The disk on the tooling.
    force : callable
        Returns the force on the robot in base, shape (3,), in N, from the true orientation of the
        sensor in base, shape (3, 3).
    stop_error : ndarray, shape (3,)
        Error of the stop, in base, in m.
    """
    q, reached = start.q, start
    for _ in range(_ROUNDS):
        wanted = force(statics.R_base_sensor(q, reached.twist))
        before, attack = replace(start, theta=reached.theta), contact.attack(wanted)
        reached = statics.loaded(before, q, wanted, stop_error, attack)
        goal = contact.tool_position(wanted)
        if np.linalg.norm(goal - statics.tool_position(reached)) < CLOSED:
            break
        q = statics.along(q, contact.R_base_tcp, (goal - reached.twist[:3])[None])[0]
    return reached


def touching_state(
    statics: Quasistatics, start: RobotState, at: FloatArray, error: FloatArray
) -> RobotState:
    """Return the robot with its tool truly at a point, without force, orientation kept.

    Parameters
    ----------
    statics : Quasistatics
        The robot.
    start : RobotState
        Where it comes from.
    at : ndarray, shape (3,)
        In base, in m.
    error : ndarray, shape (3,)
        Error of the stop, in base, in m.
    """
    R = statics.robot.forward(start.q)[:3, :3]
    reached = start
    for _ in range(_ROUNDS):
        q = statics.along(reached.q, R, (at - reached.twist[:3])[None])[0]
        reached = statics.free(q, error, reached.theta)
        if np.linalg.norm(at - statics.tool_position(reached)) < CLOSED:
            break
    return reached


def _touch(
    plant: Plant, start: RobotState, direction: FloatArray, distance: float, error: FloatArray
) -> tuple[Contact, RobotState] | None:
    """Return contact and robot state where the tool touches the tooling; None if it does not."""
    statics = plant.statics
    if plant.contact is not None:
        return plant.contact, statics.free(plant.contact.q_touch, error, start.theta)
    if any(fault.kind == "contact_missed" for fault in plant.schedule.at(plant.visit)):
        return None
    tool = statics.tool_position(start)
    hit = plant.surface.hit(tool, direction, distance + _BEYOND)
    if hit is None:
        return None
    point = tool + (hit.distance - plant.stacked) * direction
    touch = touching_state(statics, start, point, error)
    if _advance(plant, start, touch, direction) > distance:
        return None
    place = (point, statics.robot.forward(start.q)[:3, :3], hit.normal, touch.q)
    law = plant.contact_law_at(tool + hit.distance * direction)
    return Contact(law, *place, plant.chance.load(0)), touch


def _moved(plant: Plant, start: RobotState, shift: FloatArray, error: FloatArray) -> RobotState:
    """Return the robot free, its tool commanded elsewhere, orientation kept."""
    T = plant.statics.robot.forward(start.q)
    q = plant.statics.along(start.q, T[:3, :3], (T[:3, 3] + shift)[None])[0]
    return plant.statics.free(q, error, start.theta)


def _advance(plant: Plant, start: RobotState, end: RobotState, direction: FloatArray) -> float:
    """Return the motion of the commanded tool along a direction, in m."""
    T = plant.statics.robot.forward(np.stack([start.q, end.q]))
    return float((T[1, :3, 3] - T[0, :3, 3]) @ direction)


def _between(start: FloatArray, end: FloatArray, progress: FloatArray) -> FloatArray:
    between: FloatArray = start + progress[:, None] * (end - start)
    between[-1] = end
    return between


def _interpolated(at: FloatArray, values: FloatArray, fine: FloatArray) -> FloatArray:
    return np.stack([np.interp(fine, at, column) for column in values.T], axis=1)


SLIP_TIME = 0.1
"""Time that an injected slip takes, in s."""
_UNREST = (7.3, 11.9)
"""Frequencies of the unrest of a held force, in Hz. An assumption."""
_NEVER_AT_REST = (0.9, 1.7)
"""Frequencies of a force that never comes to rest, in Hz."""


class ForceControl:
    """The controller in force control."""

    def __init__(self, plant: Plant, gain: ForceGain) -> None:
        """Control with a sensor of such a gain; its hysteresis is not looked at."""
        self._plant, self._gain = plant, gain
        self.load = -1
        self._wanted: FloatArray = np.zeros(3)
        self._rate = 1.0
        self.begin_visit()

    def begin_visit(self) -> None:
        """Zero the sensor and count load cases from 0."""
        state = self._plant.robot_state()
        self.load = -1
        self._R_zeroed = self._plant.statics.R_base_sensor(state.q, state.twist)

    def hold(self, wanted_tcp: FloatArray, rate: float) -> None:
        """Build up and hold a reading of the sensor, tcp frame, in N, at a rate in N/s."""
        plant, contact = self._plant, self._plant.contact
        if contact is None:
            raise DeviceError("simulated arm: no contact to hold a force in")
        self.load += 1
        self._wanted, self._rate = contact.law.held(wanted_tcp), rate
        slides = contact.law.effort(wanted_tcp) > 1.0
        slip = plant.slip(self.load) * contact.law.slip_sigma(wanted_tcp)
        segment = self._press(slip)
        if slides:
            ramp = of_kind(segment.law, SettlingRamp, "law of the ramp")
            after = segment.begin + round(1e6 * (ramp.ramp + 5.0 * ramp.tau))
            plant.later(after, lambda: self._slide(segment))

    def release(self, rate: float) -> None:
        """Ramp the force to zero."""
        plant, contact = self._plant, self._plant.contact
        if contact is None:
            raise DeviceError("simulated arm: no contact to release")
        start = plant.robot_state()
        end = pressed_state(
            plant.statics, start, contact, lambda _: np.zeros(3), plant.stop_error()
        )
        law = Uniform(float(np.linalg.norm(start.force)) / rate)
        plant.run(plant.statics.path(start, end), law, (Motion.RELEASING, Motion.IDLE))

    def let_slip(self, fault: Fault, held: Segment) -> None:
        """Let the contact slip along the lateral force, unless the load case is over."""
        if self._plant.segment is held:
            self._press(fault.distance * self._away(), SLIP_TIME)

    def _press(self, slip: FloatArray, least: float = 0.0) -> Segment:
        """Return the slip while the force is built up, tcp frame, shape (2,), in m."""
        plant, contact = self._plant, self._plant.contact
        contact = present(contact, "contact")
        start = plant.robot_state()
        contact = replace(contact.slipped(slip), chance=plant.chance.load(self.load))
        end = self._equilibrium(start, contact)
        plant.contact = contact
        ramp = max(float(np.linalg.norm(end.force - start.force)) / self._rate, least)
        law: TimeLaw = SettlingRamp(ramp, truth_of(plant.cell).controller.settling)
        path, holding = plant.statics.path(start, end), (Motion.HOLDING, Motion.HOLDING)
        return plant.run(path, law, holding, ripple=self._ripple())

    def _slide(self, held: Segment) -> None:
        """Slide at a steady speed until the controller has had enough."""
        plant, entry = self._plant, truth_of(self._plant.cell)
        contact = plant.contact
        if plant.segment is not held or contact is None:
            return
        start, slide = plant.robot_state(), entry.controller.travel_limit
        plant.contact = contact = contact.slipped(slide * self._away())
        end = self._equilibrium(start, contact)
        plant.run(
            plant.statics.path(start, end),
            Uniform(slide / entry.contact.slide_speed),
            (Motion.HOLDING, Motion.STOPPED),
            fault=f"force control gave up: the contact slid by {1e3 * slide:g} mm",
        )

    def _equilibrium(self, start: RobotState, contact: Contact) -> RobotState:
        """Return the robot where the sensor reads the wanted force."""
        plant, statics = self._plant, self._plant.statics
        R_sensor_tcp = statics.robot.T_tcp_sensor[:3, :3].T
        lever = statics.lever(contact.law.attack(self._wanted, contact.chance))
        # The sensor turns with the arm, so that it sees another part of the weight than before.
        felt = np.linalg.solve(self._gain.beside(R_sensor_tcp @ lever), R_sensor_tcp @ self._wanted)
        felt = felt + self._R_zeroed.T @ statics.weight

        def force(R_base_sensor: FloatArray) -> FloatArray:
            true_force: FloatArray = R_base_sensor @ felt - statics.weight
            return true_force

        return pressed_state(statics, start, contact, force, plant.stop_error())

    def _away(self) -> FloatArray:
        """Return the direction in which the contact slips, tcp frame, shape (2,)."""
        lateral = self._wanted[:2]
        length = float(np.linalg.norm(lateral))
        return -lateral / length if length else np.array([1.0, 0.0])

    def _ripple(self) -> Ripple:
        plant = self._plant
        amplitude, frequency = truth_of(plant.cell).controller.ripple, _UNREST
        for fault in plant.schedule.at(plant.visit):
            if fault.kind == "never_stable" and fault.load == self.load:
                amplitude, frequency = fault.amplitude, _NEVER_AT_REST
        phase = generator(plant.seed, "ripple", plant.key, self.load).uniform(0.0, 2 * np.pi, 2)
        return Ripple(amplitude, frequency, (float(phase[0]), float(phase[1])))
