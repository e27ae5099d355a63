"""The elastic arm about one equilibrium: quick enough to be asked every cycle of a controller.

All springs but the gears count as linear, and as sitting where they sit at the equilibrium; the
gears keep their laws and their memory (`elastocal.sim.arm.gears`). Vectors of three are multiplied
by hand: NumPy's own cross product takes ten times as long.
"""

import math
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.robot import inverse_transform
from elastocal.sim.arm import RobotSprings, Screws, motions, moved_axes
from elastocal.sim.workcell._contact import LIMIT, Contact
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._timeline import RobotState

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
    """Where the force acts on the tool, tcp frame, shape (3,), in m."""
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
    """What instruments see of one robot; see `Quasistatics.knots`."""

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
    """Return how far the contact gives way per force, in base, shape (3, 3), in m/N."""
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
