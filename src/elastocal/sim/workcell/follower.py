"""The robot following a commanded pose each cycle, and the resulting contact force.

A segment of the simulated cell is planned from a given force; a robot that is corrected from
outside is given a pose, and the force follows from the compliance of arm, disk and tooling. With
the commanded pose ``p``, the twist ``t`` of the arm and the position ``c`` that the contact gives
the tool (`elastocal.sim.workcell._contact`), the force on the robot solves

    p + t(F, gears) = c(F),    torque(gears) = J_g^T F + weight

by Newton's method from the force of the cycle before. The twist is *linearised* in the springs
about the last exact equilibrium (`Quasistatics.loaded`), except for the six gears, whose laws and
memory are evaluated in every cycle. The exact equilibrium is solved again when the force or the
pose has moved away from it, and at standstill; a difference from the linearised one is faded in.

Assumptions: the tool's rotation does not influence the contact; the robot is at rest at every
instant. Random values of each stop (error of the stop, point of attack, slip of the ring) change
over the first part of the path from one standstill to the next.

The elastic arm about one equilibrium is fast enough for every cycle of a controller.

All springs except the gears are linear and keep their positions of the equilibrium; the gears keep
their laws and their memory (`elastocal.sim.arm.gears`). Vectors of three are multiplied by hand:
NumPy's own cross product takes ten times as long.
"""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Motion
from elastocal.robot import inverse_transform
from elastocal.sim.arm import RobotSprings, Screws, motions, moved_axes
from elastocal.sim.truth import Fault
from elastocal.sim.workcell._contact import LIMIT, Contact, Hit
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._timeline import Knots, RobotPath, RobotState, Uniform

_END_EFFECTOR = 6
"""Springs behind the sensor; see `elastocal.sim.workcell._robot`."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """The elastic arm about one exact equilibrium."""

    state: RobotState
    """The equilibrium; its twist without the error of a stop."""
    R: FloatArray
    """Commanded orientation, shape (3, 3)."""
    point: FloatArray
    """Commanded position, shape (3,), in m."""
    J_inverse: FloatArray
    """Joint speeds of the arm per velocity over rotation of the tool, shape (joint, 6)."""
    attack: FloatArray
    """Point of attack of the force on the tool, tcp frame, shape (3,), in m."""
    compliance: FloatArray
    """Twist per force and moment, of all springs but the gears, shape (9, 6)."""
    gears_twist: FloatArray
    """Twist per turn of the gears, shape (9, gear)."""
    gears_torque: FloatArray
    """Torque about the gears per force and moment, shape (gear, 6)."""
    torque: FloatArray
    """Torque of the gears at the equilibrium, shape (gear,), in N·m."""

    @classmethod
    def at(cls, statics: Quasistatics, state: RobotState, attack: FloatArray) -> "Tangent":
        """Return the arm about an equilibrium whose force acts at ``attack`` (tcp frame, (3,))."""
        robot, springs = statics.robot, state.springs
        chain, which = robot.chain, springs.gears.which
        held = chain.held(state.q[None])
        held[:, chain.spring_elements] = state.theta
        total = motions(chain.screws, held)
        elements = chain.spring_elements
        axes = chain.screws
        screws = Screws(axes.axis[elements], axes.point[elements], axes.revolute[elements])
        axis, point = (each[:, 0] for each in moved_axes(screws, total[elements]))
        tool = total[-1, 0] @ robot.built.T_base_tip
        turns = screws.revolute[:, None]

        def moves(where: FloatArray) -> FloatArray:
            return np.where(turns, np.cross(axis, where - point), axis)

        tilted = np.where(turns, axis, 0.0)
        sensed = tilted.copy()
        sensed[-_END_EFFECTOR:] = 0.0
        twist = np.concatenate([moves(tool[:3, 3]), tilted, sensed], axis=1)
        load = np.concatenate([moves(tool[:3, 3] + tool[:3, :3] @ attack), tilted], axis=1)
        gives = 1.0 / springs.stiffness
        gives[which] = 0.0
        laws = GearCurves.of(springs)
        T = robot.forward(state.q)
        J = robot.linkage.jacobian(state.q[None])[0, :, robot.external :]
        inverse = np.zeros((len(state.q), 6))
        inverse[robot.external :] = np.linalg.pinv(J, rcond=1e-9)
        return cls(
            state, T[:3, :3], T[:3, 3], inverse, attack,
            twist.T @ (gives[:, None] * load), twist[which].T, load[which],
            laws.torque(state.theta[which])[0],
        )  # fmt: skip


class GearCurves:
    """Torques of the gears over their twists, with sliders that are drawn along."""

    def __init__(self, springs: RobotSprings, balance: FloatArray) -> None:
        laws = springs.gears
        self._k, self._loss, self._angle = springs.stiffness[laws.which], laws.loss, laws.angle
        self._stop, self._travel, self._balance = laws.stop_stiffness, laws.stop_travel, balance
        slider = springs.slider
        self.slider = np.zeros_like(laws.stop_travel) if slider is None else slider

    @classmethod
    def of(cls, springs: RobotSprings) -> "GearCurves":
        """Return the curves of a robot at rest; its balancer counts as one straight line."""
        balance = np.zeros(len(springs.gears.which))
        if springs.balancer is not None:
            rate = springs.balancer.evaluate(np.asarray(springs.joint_angle))[2]
            balance[springs.gears.which == springs.balanced] = rate
        return cls(springs, balance)

    def torque(self, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return torques in N·m and stiffnesses in N·m/rad at twists, shape (gear,) each."""
        ratio = twist[:, None] / self._angle
        drawn = twist[:, None] - self.slider
        held = np.minimum(np.maximum(drawn, -self._travel), self._travel)
        straight = self._k + self._balance
        lost = (self._loss * self._angle * np.arctan(ratio)).sum(axis=1)
        torque = straight * twist - lost + (self._stop * held).sum(axis=1)
        stiffness = straight - (self._loss / (1.0 + ratio * ratio)).sum(axis=1)
        return torque, stiffness + (self._stop * (held == drawn)).sum(axis=1)

    def draw_along(self, twist: FloatArray) -> None:
        """Leave the sliders where twists have brought them."""
        drawn = twist[:, None] - self.slider
        held = np.minimum(np.maximum(drawn, -self._travel), self._travel)
        self.slider = twist[:, None] - held


@dataclass(frozen=True, eq=False)
class View:
    """Quantities of one robot that instruments measure; see `Quasistatics.knots`."""

    R_tcp_sensor: FloatArray
    marker: FloatArray
    tip: FloatArray
    centre: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, statics: Quasistatics) -> "View":
        """Return the view of a robot with its tool."""
        robot = statics.robot
        T_sensor_tcp = inverse_transform(robot.T_tcp_sensor)
        tip = T_sensor_tcp[:3, 3]
        centre = T_sensor_tcp[:3, :3] @ robot.tool_centre_tcp + tip
        return cls(robot.T_tcp_sensor[:3, :3], statics.marker_tcp, tip, centre, statics.weight)

    def seen(
        self, T: FloatArray, twist: FloatArray, force: FloatArray, moment: FloatArray
    ) -> FloatArray:
        """Return marker in base, and wrench at the sensor in its frame, shape (9,)."""
        R_sensor = T[:3, :3] @ self.R_tcp_sensor
        back = -twist[6:]
        felt, weight, about = (
            turned(back, vector) @ R_sensor for vector in (force, self.weight, moment)
        )
        marker = T[:3, 3] + twist[:3] + turned(twist[3:6], T[:3, :3] @ self.marker)
        about = about + cross(self.tip, felt) + cross(self.centre, weight)
        return np.concatenate([marker, felt + weight, about])


def contact_compliance(contact: Contact, force: FloatArray) -> FloatArray:
    """Return the compliance of the contact, in base, shape (3, 3), in m/N."""
    law, R, normal = contact.law, contact.R_base_tcp, contact.normal
    force_tcp = R.T @ force
    effort = min(law.effort(force_tcp), LIMIT)
    sideways = 1.0 / law.shear_stiffness
    give = np.diag([sideways, sideways, 1.0 / law.normal_stiffness])
    if effort > 0.0:
        growth = 1.5 * (1.0 - (1.0 - effort) ** (2.0 / 3.0)) / effort
        across = force_tcp[:2] / math.hypot(force_tcp[0], force_tcp[1])
        steeper = (1.0 - effort) ** (-1.0 / 3.0) - growth
        give[:2, :2] *= growth
        give[:2, :2] += steeper * sideways * np.multiply.outer(across, across)
    compliance: FloatArray = R @ give @ R.T
    return compliance + np.multiply.outer(normal, normal) / law.tooling_stiffness


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return a × b of two vectors; `numpy.cross` takes ten times as long."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def turned(turn: FloatArray, vector: FloatArray) -> FloatArray:
    """Return a vector turned by a small rotation vector, to its second power."""
    first = cross(turn, vector)
    return vector + first + 0.5 * cross(turn, first)


_STANDSTILL = 20e-6
"""Largest change of a commanded pose that counts as standing, in m."""
_SETTLE = 0.4
"""Time that it must stay so, in s."""
_DEPARTED = 50e-6
"""Way from a standstill that begins another movement, in m."""
_BLEND = 2e-4
"""Way on which the random part of a stop comes in, in m."""
_FORCE_STEP, _WAY_FREE, _WAY_PRESSED = 150.0, 10e-3, 2e-3
"""Change of force in N, and of pose in m, after which the equilibrium is solved again."""
_REFRESH_GAP = 10
"""Fewest cycles between two exact equilibria."""
_FADE = 0.8
"""Part of what the exact equilibrium found otherwise that is left after a cycle."""
_REFRESH_STANDING, _SMALL_CHANGE, _SMALL_WAY = 50, 0.2, 2e-6
"""The same at standstill: cycles, and changes of force in N and of pose in m that count as none."""
_TURN = 2e-3
"""Rotation of the tool after which the equilibrium is solved again."""
_SAME_PLACE = 2e-4
"""Joints so near to where they were led to have not been moved by anything else, in rad or m."""
_ENDS = np.array([0.0, 1.0])
_ROUNDS = 6
_CLOSED = 1.0
"""A Newton step below this is the last one of a cycle, in N: what it leaves is far below 0.01 N."""
_LATERAL = 5e-4
"""Way along the surface after which it is looked for again, in m."""
_REACH = 0.5
"""Distance ahead to which the surface is searched, in m."""


@dataclass
class _Chance:
    """Random values of each stop, in transition from one to the next."""

    before: FloatArray
    after: FloatArray
    """Error of the stop in m; tilt, variation of the point of attack and slip in standard
    deviations: (9,)."""
    part: float = 1.0

    @property
    def now(self) -> FloatArray:
        """Return the values now, shape (9,)."""
        return self.before + self.part * (self.after - self.before)


class PoseFollower:
    """The robot of a plant, led by commanded poses of its tool; see the module."""

    q: FloatArray
    """Joints of the controller, shape (joint,), in rad or m."""
    T: FloatArray
    """Pose of the undeformed tool at these joints, in base, shape (4, 4)."""
    _tangent: Tangent
    _curves: GearCurves
    _gears: FloatArray
    _load_now: FloatArray
    _row: tuple[FloatArray, ...]

    def __init__(self, plant: Plant) -> None:
        """Set up; `begin` takes the robot over."""
        self._plant = plant
        self._led = False
        self.contact: Contact | None = None
        """Contact, if the tool touches."""
        self.force: FloatArray = np.zeros(3)
        """Force on the robot in base, shape (3,), in N."""
        self.stopped: str | None = None
        """Why the safety controller has stopped the arm; a fault of the cell file."""

    def begin(self) -> None:
        """Take over the free robot at its present position; a visit begins when it leaves it.

        If nothing else has moved it since, the visit continues instead.
        """
        plant = self._plant
        here = plant.segment.path.end.q
        if self._led and np.abs(here - self.q).max() < _SAME_PLACE:
            return
        stands, self._statics = plant.robot_state(), plant.statics
        free = self._statics.free(stands.q, np.zeros(3), stands.theta)
        self.contact, self.force, self.stopped = None, np.zeros(3), None
        # At standstill the deviation is the error of the last stop.
        error = (stands.twist - free.twist)[:3]
        values = np.concatenate([error, plant.chance.load(0), np.zeros(2)])
        self._chance, self._load = _Chance(values, values), -1
        self._view = View.of(self._statics)
        self.q, self.T = free.q, self._statics.robot.forward(free.q)
        self._rest, self._still, self._way, self._standing = self.T[:3, 3], 0.0, 0.0, True
        self._fade: FloatArray = np.zeros(9)
        self._ahead: tuple[FloatArray, Hit | None] | None = None
        self._take(free)
        self._row = self._see()
        self._steps = ["approach", "reference", "engage"]
        self._missed, self._led = False, True

    def _begin_visit(self) -> None:
        """Begin the visit of the present posture."""
        plant = self._plant
        plant.begin_visit()
        self._statics = plant.statics
        self._view = View.of(self._statics)
        faults = plant.schedule.at(plant.visit)
        self._missed = any(fault.kind == "contact_missed" for fault in faults)
        self._begin_step("approach")

    def follow(self, T_base_tcp: FloatArray, duration: float) -> None:
        """Move uniformly to a commanded pose of the tool within a time.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (4, 4)
            Of the undeformed robot; near the one before.
        duration : float
            In s.
        """
        way = T_base_tcp[:3, 3] - self.T[:3, 3]
        self._lead(T_base_tcp)
        self._note_standstill(duration)
        self._fade = _FADE * self._fade
        if self.contact is None and not self._missed:
            self._touch(way)
        if self.contact is not None:
            self._balance(self.contact)
        self._since += 1
        if self._since >= _REFRESH_GAP and self._is_far():
            self._refresh()
        self._run(duration)

    @property
    def gear_torque(self) -> FloatArray:
        """Torque of the gears, shape (gear,), in N·m."""
        torque: FloatArray = self._tangent.torque + self._tangent.gears_torque @ self._load_now
        return torque

    def _lead(self, T_goal: FloatArray) -> None:
        """Move the joints: one Newton step from the pose that the last one has reached."""
        turn = T_goal[:3, :3] @ self.T[:3, :3].T
        error = np.empty(6)
        error[:3] = T_goal[:3, 3] - self.T[:3, 3]
        error[3:] = (
            0.5 * (turn[2, 1] - turn[1, 2]),
            0.5 * (turn[0, 2] - turn[2, 0]),
            0.5 * (turn[1, 0] - turn[0, 1]),
        )
        self.q = self.q + self._tangent.J_inverse @ error
        self.T = self._statics.robot.forward(self.q)

    def _note_standstill(self, duration: float) -> None:
        """Draw new random values of the stop each time that the robot starts to move."""
        here = self.T[:3, 3]
        way = math.dist(here.tolist(), self._rest.tolist())
        if self._standing:
            if way > _DEPARTED:
                self._standing, self._way = False, 0.0
                self._depart()
        elif way > _STANDSTILL:
            self._way += way
            self._chance.part = min(1.0, self._way / _BLEND)
            self._rest, self._still = here, 0.0
        else:
            self._still += duration
            self._standing = self._still >= _SETTLE
            if self._standing and self.contact is None:
                self._begin_step("reference")

    def _depart(self) -> None:
        plant, chance, slips = self._plant, self._chance, np.zeros(2)
        if self._steps[:1] == ["approach"]:
            self._begin_visit()
        elif self.contact is None:
            self._begin_step("engage")
        if self.contact is not None:
            # Slip so far is kept.
            self.contact = self.contact.slipped(self._slipped(self.contact))
            self._load += 1
            slips = plant.slip(self._load)
        load = plant.chance.load(max(self._load, 0))
        chance.before = np.concatenate([chance.now[:7], np.zeros(2)])
        chance.after, chance.part = np.concatenate([plant.stop_error(), load, slips]), 0.0
        if self.contact is not None:
            self._fail(self._plant.schedule.begin("hold", plant.visit, self._load, plant.now))

    def _slipped(self, contact: Contact) -> FloatArray:
        """Return the random slip of the ring, tcp frame, shape (2,), in m."""
        sigma = contact.law.slip_sigma(contact.R_base_tcp.T @ self.force)
        slipped: FloatArray = sigma * self._chance.now[7:]
        return slipped

    def _begin_step(self, step: str) -> None:
        """Begin a step of the visit, in its turn: the cell's faults count from there."""
        if self._steps and self._steps[0] == step:
            del self._steps[0]
            plant = self._plant
            self._fail(plant.schedule.begin(step, plant.visit, 0, plant.now))

    def _fail(self, faults: list[tuple[int, Fault]]) -> None:
        """Start faults at their times."""
        for time, fault in faults:
            act = self._slip if fault.kind == "slip" else self._stop
            self._plant.later(time, partial(act, fault.distance))

    def _stop(self, _: float) -> None:
        self.stopped = "stopped by the safety controller"

    def _slip(self, distance: float) -> None:
        """Let the contact slip along the lateral force, by a length in m."""
        if self.contact is not None:
            lateral = (self.contact.R_base_tcp.T @ self.force)[:2]
            size = float(np.linalg.norm(lateral))
            away = -lateral / size if size > 0.0 else np.array([1.0, 0.0])
            self.contact = self.contact.slipped(distance * away)

    def _touch(self, way: FloatArray) -> None:
        """Notice that the tool has come to the surface."""
        tool = self.T[:3, 3] + self._twist()[:3]
        outward = self.T[:3, 2]
        if self._ahead is not None:
            off = tool - self._ahead[0]
            if np.linalg.norm(off - outward * (outward @ off)) > _LATERAL:
                self._ahead = None
        if self._ahead is None:
            self._ahead = (tool, self._plant.surface.hit(tool, outward, _REACH))
        origin, hit = self._ahead
        if hit is None:
            return
        gap = float((tool - origin - hit.distance * outward) @ hit.normal)
        if gap > 0.0:
            return
        steep = float(way @ hit.normal)
        anchor = tool - gap * (way / steep if steep < 0.0 else hit.normal)
        place = (anchor, self.T[:3, :3].copy(), hit.normal, self.q)
        self._refresh()
        self.contact = Contact(self._plant.contact_law, *place, self._chance.now[3:7])

    def _balance(self, contact: Contact) -> None:
        """Find the force at which robot, disk and tooling are where each holds the tool."""
        self.contact = contact = replace(contact, chance=self._chance.now[3:7])
        anchor = contact.anchor + contact.R_base_tcp[:, :2] @ self._slipped(contact)
        held = replace(contact, anchor=anchor)
        R, law, tangent, curves = contact.R_base_tcp, contact.law, self._tangent, self._curves
        force = self.force
        for _ in range(_ROUNDS):
            load = self._load_change(force)
            torque, stiffness = curves.torque(self._gears)
            turn = (tangent.torque + tangent.gears_torque @ load - torque) / stiffness
            self._gears = self._gears + turn
            give = tangent.gears_twist[:3] @ (tangent.gears_torque[:, :3] / stiffness[:, None])
            yielding = tangent.compliance[:3, :3] + give + contact_compliance(held, force)
            self._load_now = load
            tool = self.T[:3, 3] + self._twist()[:3]
            step = np.linalg.solve(yielding, held.tool_position(force) - tool)
            force = force + step
            if max(abs(value) for value in step.tolist()) < _CLOSED:
                break
        force_tcp = R.T @ force
        if force_tcp[2] >= 0.0:
            force = np.zeros(3)
        slides = force_tcp[2] < 0.0 and law.effort(force_tcp) > LIMIT
        if slides:
            force = R @ law.held(force_tcp)
        self._load_now = self._load_change(force)
        torque, stiffness = curves.torque(self._gears)
        demand = tangent.torque + tangent.gears_torque @ self._load_now
        self._gears = self._gears + (demand - torque) / stiffness
        curves.draw_along(self._gears)
        self.force = force
        off = self.T[:3, 3] + self._twist()[:3] - held.tool_position(force)
        if slides:
            # The disk comes along with the tool.
            self.contact = contact.slipped((R.T @ off)[:2])
        elif force_tcp[2] >= 0.0 and float(off @ contact.normal) > _STANDSTILL:
            self.contact = self._ahead = None
            self._refresh()

    def _load_change(self, force: FloatArray) -> FloatArray:
        """Return force and moment beyond those of the equilibrium, at its point, shape (6,)."""
        load = np.zeros(6)
        load[:3] = force - self._tangent.state.force
        attack = self._attack(force)
        if attack is not None:
            load[3:] = cross(self.T[:3, :3] @ (attack - self._tangent.attack), force)
        return load

    def _attack(self, force: FloatArray) -> FloatArray | None:
        return None if self.contact is None else self.contact.attack(force)

    def _twist(self) -> FloatArray:
        """Return the deviation of the robot now, shape (9,); see `Knots.twist`."""
        tangent = self._tangent
        turned = self._gears - self._gears_then
        twist: FloatArray = tangent.state.twist + self._fade + tangent.gears_twist @ turned
        if self.contact is not None:
            twist = twist + tangent.compliance @ self._load_now
        twist[:3] += self._chance.now[:3]
        return twist

    def _is_far(self) -> bool:
        """Return whether it is time for an exact equilibrium."""
        change = math.dist(self.force.tolist(), self._tangent.state.force.tolist())
        way = math.dist(self.T[:3, 3].tolist(), self._tangent.point.tolist())
        if self._standing and self._since >= _REFRESH_STANDING:
            return change > _SMALL_CHANGE or way > _SMALL_WAY
        turn = float(np.abs(self.T[:3, :3] - self._tangent.R).max())
        longest = _WAY_FREE if self.contact is None else _WAY_PRESSED
        return change > _FORCE_STEP or way > longest or turn > _TURN

    def _refresh(self) -> None:
        """Find the exact equilibrium, and fade in what it has otherwise than foretold."""
        foretold, nothing, force = self._twist(), np.zeros(3), self.force
        before = self._tangent.state
        if self.contact is not None:
            springs = replace(before.springs, slider=self._curves.slider)
            before = replace(before, springs=springs)
            attack = self._attack(force)
            state = self._statics.loaded(before, self.q, force, nothing, attack)
        else:
            state = self._statics.free(self.q, nothing, before.theta)
        self._take(state)
        self._fade = np.zeros(9)
        self._fade = foretold - self._twist()

    def _take(self, state: RobotState) -> None:
        attack = self._attack(state.force)
        attack = np.zeros(3) if attack is None else attack
        self._tangent = Tangent.at(self._statics, state, attack)
        self._curves, self._since = GearCurves.of(state.springs), 0
        self._gears = self._gears_then = state.theta[state.springs.gears.which]
        self._load_now = np.zeros(6)

    def _see(self) -> tuple[FloatArray, ...]:
        """Return joints, twist, force, moment, and what instruments see; see `Knots`."""
        twist, lever = self._twist(), self._statics.lever(self._attack(self.force))
        moment = cross(self.T[:3, :3] @ lever, self.force)
        return self.q, twist, self.force, moment, self._view.seen(self.T, twist, self.force, moment)

    def _run(self, duration: float) -> None:
        """Move the cell there uniformly."""
        plant, row, memory = self._plant, self._see(), self._tangent.state
        before, segment = self._row, plant.segment
        if plant.now < segment.end:
            knots, where = segment.path.knots, np.array([segment.progress(plant.now)])
            columns = (knots.q, knots.twist, knots.force, knots.moment, knots.seen)
            before = tuple(knots.at(column, where)[0] for column in columns)

        def state(row: tuple[FloatArray, ...]) -> RobotState:
            return replace(memory, q=row[0], twist=row[1], force=row[2], moment=row[3])

        both = [np.stack(pair) for pair in zip(before, row, strict=True)]
        path = RobotPath(Knots(_ENDS, *both), state(before), state(row))
        plant.run(path, Uniform(duration), (Motion.IDLE, Motion.IDLE))
        self._row = row
