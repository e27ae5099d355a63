"""The simulated robot at rest: a nonlinear equilibrium with a memory.

The potential energy of the deformed robot under its own weight, the tool's and the contact force
is least (`elastocal.sim.arm.statics`, with the laws of `elastocal.sim.workcell.springs`).
"""

from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.robot import (
    inverse_transform,
)
from elastocal.sim.arm.statics import DeadLoads, EnergyState, LoadedMechanism, minimise
from elastocal.sim.workcell.robot_layout import RobotLayout, lay_out_robot
from elastocal.sim.workcell.springs import RobotSprings

BALANCE = 1e-11
"""Torque imbalance that counts as none, over the largest torque that the loads can exert."""


@dataclass(frozen=True, eq=False)
class RobotEquilibrium:
    """The robot where it comes to rest; the leading axes are those of the joints given."""

    theta: FloatArray
    """Spring positions, shape (..., spring), in rad or m."""
    springs: RobotSprings
    """With what the gears remember from now on."""
    T_base_tcp: FloatArray
    """True tool frame, shape (..., 4, 4)."""
    T_base_sensor: FloatArray
    """True sensor frame, shape (..., 4, 4)."""
    imbalance: FloatArray
    """Largest torque left over at any spring, shape (...), in N·m."""


@dataclass(frozen=True, eq=False)
class TrueRobot:
    """A robot on its floor with its tool; make one with `of`."""

    layout: RobotLayout
    gravity: FloatArray
    """Acceleration in base, shape (3,), in m/s²."""
    tool_mass: float
    """In kg."""
    tool_centre_tcp: FloatArray
    """Shape (3,), in m."""
    T_tcp_sensor: FloatArray
    """Sensor in the tcp frame of the undeformed robot, shape (4, 4)."""
    _points: FloatArray = field(init=False, repr=False)
    _after: IndexArray = field(init=False, repr=False)
    _weights: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        linkage, ends = self.layout.linkage, self.layout.skeleton.ends
        T = linkage.T_base_tip
        tool = T[:3, :3] @ self.tool_centre_tcp + T[:3, 3]
        bodies = [(b.centre, ends[b.joint - 1], b.mass) for b in linkage.masses]
        bodies.append((tool, ends[-1], self.tool_mass))
        points, after, masses = zip(*bodies, strict=True)
        object.__setattr__(self, "_points", np.array([T[:3, 3], *points]))
        object.__setattr__(self, "_after", np.array([ends[-1], *after], dtype=np.intp))
        object.__setattr__(self, "_weights", np.multiply.outer(masses, self.gravity))

    @classmethod
    def of(cls, cell: Cell) -> "TrueRobot":
        """Return the robot of a cell.

        Raises
        ------
        DeviceError, RobotError
            If the simulator has no arm for it.
        """
        sensor = cell.T_sensor_tcp
        T_tcp_sensor = cell.T_tcp_flange if sensor is None else inverse_transform(sensor)
        return cls(
            lay_out_robot(cell),
            cell.gravity_base,
            cell.file.tool.mass,
            cell.tool_centre_tcp,
            T_tcp_sensor,
        )

    @property
    def springs(self) -> RobotSprings:
        """The springs, without friction and memory."""
        return self.layout.springs

    def forward(self, q: FloatArray) -> FloatArray:
        """Return T_base_tcp of the undeformed robot: what its controller believes.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m.
        """
        return self.layout.linkage.forward(q)

    def rest(
        self,
        q: FloatArray,
        force_base: FloatArray,
        springs: RobotSprings,
        start: FloatArray | None = None,
    ) -> RobotEquilibrium:
        """Return where the robot rests, in one posture or in many side by side.

        Fifty postures side by side take a tenth of the time of one after the other.

        Parameters
        ----------
        q : ndarray, shape (joint,) or (posture, joint)
            Positions that the motors hold, in rad or m.
        force_base : ndarray, shape (3,) or (posture, 3)
            Force on the robot at its tool centre point, in N.
        springs : RobotSprings
            The springs, with what they remember; see `RobotSprings.frictionless`.
        start : ndarray, shape (spring,) or (posture, spring), optional
            Spring positions near the result.

        Raises
        ------
        EquilibriumError
            If the robot cannot carry the load.
        """
        springs = springs.at_joint(q[..., self.layout.external + 1])
        batch = q.shape[:-1]
        mechanism = self._mechanism(np.atleast_2d(q), np.atleast_2d(force_base), springs)
        theta = np.zeros((*batch, len(springs.stiffness))) if start is None else start
        theta, state = _minimum(mechanism, np.atleast_2d(theta))
        total = mechanism.motions(theta)
        T_base_tip = self.layout.linkage.T_base_tip
        tool = total[-1] @ T_base_tip
        sensor = total[self.layout.sensor_after] @ T_base_tip @ self.T_tcp_sensor
        theta = theta.reshape(*batch, -1)
        return RobotEquilibrium(
            theta=theta,
            springs=springs.drawn_along(theta),
            T_base_tcp=tool.reshape(*batch, 4, 4),
            T_base_sensor=sensor.reshape(*batch, 4, 4),
            imbalance=np.abs(state.gradient).max(axis=1).reshape(batch),
        )

    def _mechanism(
        self, q: FloatArray, force_base: FloatArray, springs: RobotSprings
    ) -> LoadedMechanism:
        """Return the robot with its loads in postures of shape (posture, joint)."""
        chain = self.layout.skeleton
        held = np.zeros((len(q), chain.ends[-1]))
        held[:, chain.motor_elements] = q
        weights = np.repeat(self._weights[None], len(q), axis=0)
        forces = np.concatenate([force_base[:, None], weights], axis=1)
        loads = DeadLoads(self._points, self._after, forces)
        return LoadedMechanism(chain.screws, chain.spring_elements, springs, held, loads)


def _minimum(mechanism: LoadedMechanism, start: FloatArray) -> tuple[FloatArray, EnergyState]:
    """Return spring positions of least energy, shape (posture, spring), and the state there."""
    points = mechanism.load_points(mechanism.motions(start))
    reach = np.linalg.norm(points, axis=-1).T
    scale = np.sum(np.linalg.norm(mechanism.loads.force, axis=-1) * (1.0 + reach), axis=1)
    return minimise(lambda theta: mechanism.evaluate(theta, points), start, BALANCE * scale)
