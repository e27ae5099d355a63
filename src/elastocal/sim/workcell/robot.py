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
class Rest:
    """The robot where it comes to rest."""

    theta: FloatArray
    """Spring positions, shape (spring,), in rad or m."""
    springs: RobotSprings
    """With what the gears remember from now on."""
    T_base_tcp: FloatArray
    """True tool frame, shape (4, 4)."""
    T_base_sensor: FloatArray
    """True sensor frame, shape (4, 4)."""
    imbalance: float
    """Largest torque left over at any spring, in N·m."""


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
    ) -> Rest:
        """Return where the robot rests.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            Positions that the motors hold, in rad or m.
        force_base : ndarray, shape (3,)
            Force on the robot at its tool centre point, in N.
        springs : RobotSprings
            The springs, with what they remember; see `RobotSprings.frictionless`.
        start : ndarray, shape (spring,), optional
            Spring positions near the result.

        Raises
        ------
        EquilibriumError
            If the robot cannot carry the load.
        """
        springs = springs.at_joint(float(q[self.layout.external + 1]))
        mechanism = self._mechanism(q, force_base, springs)
        theta = np.zeros(len(springs.stiffness)) if start is None else start
        theta, state = _minimum(mechanism, theta[None])
        total = mechanism.motions(theta)[:, 0]
        T_base_tip = self.layout.linkage.T_base_tip
        return Rest(
            theta=theta[0],
            springs=springs.drawn_along(theta[0]),
            T_base_tcp=total[-1] @ T_base_tip,
            T_base_sensor=total[self.layout.sensor_after] @ T_base_tip @ self.T_tcp_sensor,
            imbalance=float(np.abs(state.gradient).max()),
        )

    def _mechanism(
        self, q: FloatArray, force_base: FloatArray, springs: RobotSprings
    ) -> LoadedMechanism:
        skeleton = self.layout.skeleton
        held = np.zeros((1, skeleton.ends[-1]))
        held[0, skeleton.motor_elements] = q
        forces = np.concatenate([force_base[None], self._weights])[None]
        loads = DeadLoads(self._points, self._after, forces)
        return LoadedMechanism(skeleton.screws, skeleton.spring_elements, springs, held, loads)


def _minimum(mechanism: LoadedMechanism, start: FloatArray) -> tuple[FloatArray, EnergyState]:
    """Return spring positions of least energy, shape (1, spring), and the state there."""
    points = mechanism.load_points(mechanism.motions(start))
    reach = np.linalg.norm(points, axis=-1).T
    scale = np.sum(np.linalg.norm(mechanism.loads.force, axis=-1) * (1.0 + reach), axis=1)
    return minimise(lambda theta: mechanism.evaluate(theta, points), start, BALANCE * scale)
