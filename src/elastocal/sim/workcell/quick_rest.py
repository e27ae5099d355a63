"""The simulated robot at rest in many postures side by side; see `elastocal.sim.workcell.robot`.

The same energy and the same laws as one posture at a time: a tenth of the time for fifty.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.sim.arm.statics import DeadLoads, LoadedMechanism, minimise
from elastocal.sim.workcell.robot import BALANCE, TrueRobot
from elastocal.sim.workcell.springs import RobotSprings


class Rests(NamedTuple):
    """The robot in many postures."""

    theta: FloatArray
    """Spring positions, shape (place, spring), in rad or m."""
    slider: FloatArray
    """Where the sliders of the gears stand from now on, shape (place, gear, stop), in rad."""
    twist: FloatArray
    """Deviation from the undeformed robot; see `quasistatics.Knots.twist`, shape (place, 9)."""


def rest_side_by_side(
    robot: TrueRobot,
    q: FloatArray,
    force: FloatArray,
    slider: FloatArray | None,
    start: FloatArray | None,
) -> Rests:
    """Return where the robot rests in each posture.

    Parameters
    ----------
    robot : TrueRobot
        The robot.
    q : ndarray, shape (place, joint)
        Positions that the motors hold, in rad or m.
    force : ndarray, shape (place, 3)
        Force on the robot at its tool centre point, in base, in N.
    slider : ndarray, shape (place, gear, stop), optional
        Where the sliders of the gears stand; None: free motion has shaken the friction off.
    start : ndarray, shape (place, spring), optional
        Spring positions near the result.

    Raises
    ------
    EquilibriumError
        If the robot cannot carry a load.
    """
    layout, springs = robot.layout, robot.springs
    skeleton = layout.skeleton
    held = np.zeros((len(q), skeleton.ends[-1]))
    held[:, skeleton.motor_elements] = q
    angle = q[:, layout.external + 1]
    bank = _Bank(replace(springs, slider=slider, balancer=None), springs, angle)
    loads = _loads(robot, force)
    mechanism = LoadedMechanism(skeleton.screws, skeleton.spring_elements, bank, held, loads)
    theta = np.zeros((len(q), len(springs.stiffness))) if start is None else start
    points = mechanism.load_points(mechanism.motions(theta))
    reach = np.linalg.norm(points, axis=-1).T
    scale = np.sum(np.linalg.norm(loads.force, axis=-1) * (1.0 + reach), axis=1)
    theta, _ = minimise(lambda at: mechanism.evaluate(at, points), theta, BALANCE * scale)
    total = mechanism.motions(theta)
    twist = _twist(robot, q, total[-1], total[layout.sensor_after])
    return Rests(theta, _drawn_along(springs, slider, theta), twist)


@dataclass(frozen=True, eq=False)
class _Bank:
    """`RobotSprings` in many postures: the balancer of each has an angle of its own."""

    plain: RobotSprings
    """Without balancer."""
    full: RobotSprings
    angle: FloatArray
    """Motor of the balanced joint, shape (place,), in rad."""

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return energy (place,), torques and stiffnesses (place, spring)."""
        energy, torque, stiffness = self.plain.evaluate(theta)
        if self.full.balancer is not None:
            which = self.full.balanced
            stored, moment, rate = self.full.balancer.evaluate(self.angle + theta[:, which])
            energy = energy + stored
            torque[:, which] += moment
            stiffness[:, which] += rate
        return energy, torque, stiffness


def _loads(robot: TrueRobot, force: FloatArray) -> DeadLoads:
    """Return the force at the tool, and the weights of links and tool."""
    linkage, ends = robot.layout.linkage, robot.layout.skeleton.ends
    T = linkage.T_base_tip
    points = [T[:3, 3], *(body.centre for body in linkage.masses)]
    points.append(T[:3, :3] @ robot.tool_centre_tcp + T[:3, 3])
    after = [ends[-1], *(ends[body.joint - 1] for body in linkage.masses), ends[-1]]
    masses = [*(body.mass for body in linkage.masses), robot.tool_mass]
    weights = np.multiply.outer(masses, robot.gravity)
    forces = np.concatenate([force[:, None], np.repeat(weights[None], len(force), axis=0)], axis=1)
    return DeadLoads(np.array(points), np.array(after, dtype=np.intp), forces)


def _drawn_along(springs: RobotSprings, slider: FloatArray | None, theta: FloatArray) -> FloatArray:
    """Return the sliders where the equilibria leave them."""
    travel, twist = springs.gears.stop_travel, theta[:, springs.gears.which, None]
    way = np.zeros((len(theta), *travel.shape)) if slider is None else twist - slider
    drawn: FloatArray = twist - np.clip(way, -travel, travel)
    return drawn


def _twist(robot: TrueRobot, q: FloatArray, tool: FloatArray, sensor: FloatArray) -> FloatArray:
    """Return the deviation from the undeformed robot, from motions of shape (place, 4, 4)."""
    T, T_base_tip = robot.forward(q), robot.layout.linkage.T_base_tip
    R_sensor = T[:, :3, :3] @ robot.T_tcp_sensor[:3, :3]
    true_tool = tool @ T_base_tip
    true_sensor = sensor @ T_base_tip @ robot.T_tcp_sensor
    turns = (
        true_tool[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1),
        true_sensor[:, :3, :3] @ R_sensor.transpose(0, 2, 1),
    )
    shift = true_tool[:, :3, 3] - T[:, :3, 3]
    return np.hstack([shift, *(Rotation.from_matrix(turn).as_rotvec() for turn in turns)])
