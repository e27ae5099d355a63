"""The simulated robot: its elasticities, and its equilibrium.

From the foot to the tool: floor or rail carriage (three turns about the foot), the drives of
external axes, per arm joint a gear and two tilts of its bearing, a hinge pair in the middle of each
of the two long links, and the end-effector (three turns and three shifts at the sensor). Six or
eighteen springs at the joints describe only the gears and tilts, and those only as far as they are
linear. Figures that the file does not state are those of `elastocal.sim.arm` for an arm of 1.1 t,
in proportion to the mass that the arm moves: an assumption that gives the right order of magnitude
for a small robot.

At rest the potential energy of the deformed robot under its own weight, the tool's and the contact
force is least (`elastocal.sim.arm.statics`, with the laws of `elastocal.sim.arm.gears`): a
nonlinear equilibrium with a memory, for one posture or many.
"""

import itertools
import math
from dataclasses import dataclass, field, replace

import numpy as np

from elastocal.arrays import FloatArray, IndexArray, triple
from elastocal.cell import Cell
from elastocal.errors import DeviceError
from elastocal.robot import inverse_transform
from elastocal.sim.arm import (
    AXIAL_STIFFNESS,
    LINK_BENDING,
    BalancerSpring,
    DeadLoads,
    GearLaws,
    InverseResult,
    Linear,
    Linkage,
    LoadedMechanism,
    Reaction,
    RobotSprings,
    SpringChain,
    TruthSpring,
    axial_spring,
    build_spring_chain,
    link_hinges,
    solve_inverse,
    tilt_springs,
)
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._imperfections import built

ARM_JOINTS = 6
MOVED_MASS = 850.0
"""Mass in kg that an arm of 1.1 t moves: all but its foot."""
BALANCER_RATE = 5.5e4
"""Rate of the balancer's spring on such an arm, in N/m: 3 kN·m with the arm stretched out."""
HIGH_TORQUE = 1.65
"""Stiffness of a gear at high torque over that of a straight line through measured deflections, to
which play, bending links and floor add. An assumption."""
_SHORT_LINK = 0.2
"""A link shorter than this does not bend, in m."""
_END_EFFECTOR = 6
"""Number of springs of the end-effector, behind the sensor and last of all."""
BALANCE = 1e-11
"""Torque imbalance that counts as none, over the largest torque that the loads can exert."""


@dataclass(frozen=True, eq=False)
class RobotEquilibrium:
    """The robot where it comes to rest; the leading axes are those of the joints given."""

    theta: FloatArray
    """Spring positions, shape (..., spring), in rad or m."""
    springs: RobotSprings
    """Springs with the updated memory of the gears."""
    T_base_tcp: FloatArray
    """True tool frame, shape (..., 4, 4)."""
    T_base_sensor: FloatArray
    """True sensor frame, shape (..., 4, 4)."""
    imbalance: FloatArray
    """Largest torque left over at any spring, shape (...), in N·m."""


@dataclass(frozen=True, eq=False)
class TrueRobot:
    """A robot on its floor with its tool; make one with `of`."""

    linkage: Linkage
    """Linkage as described: the controller's."""
    built: Linkage
    """Linkage as built."""
    chain: SpringChain
    springs: RobotSprings
    """Without friction and memory."""
    external: int
    """Number of joints before the arm."""
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
    _recent: dict[bool, tuple[bytes, FloatArray]] = field(
        init=False, repr=False, default_factory=dict
    )

    def gear_angles(self, theta: FloatArray) -> FloatArray:
        """Return how far each link is from where its motor has it, shape (..., joint), in rad.

        Zero at external axes, whose drives have no gears here.

        Parameters
        ----------
        theta : ndarray, shape (..., spring)
            Spring positions in rad or m.
        """
        angles = np.zeros((*theta.shape[:-1], len(self.linkage.joint_names)))
        angles[..., self.external :] = theta[..., self.springs.gears.which]
        return angles

    def __post_init__(self) -> None:
        linkage, ends = self.built, self.chain.ends
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
        linkage = Linkage.from_urdf(cell.robot.urdf, cell.robot.tip, cell.robot.base)
        external = len(linkage.joint_names) - ARM_JOINTS
        if external < 0:
            raise DeviceError(
                f"the simulated arm needs six joints; {linkage.name} has"
                f" {len(linkage.joint_names)} ({', '.join(linkage.joint_names)})"
            )
        simulation = truth_of(cell)
        real = built(linkage, simulation.geometry, external, simulation.seed)
        chain, springs = _springs(cell, real, external)
        return cls(
            linkage,
            real,
            chain,
            springs,
            external,
            cell.gravity_base,
            cell.file.tool.mass,
            cell.tool_centre_tcp,
            _sensor_frame(cell),
        )

    def forward(self, q: FloatArray) -> FloatArray:
        """Return T_base_tcp of the undeformed robot: what its controller believes.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m.
        """
        return self._tip(self.linkage, q)

    def undeformed(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return T_base_tcp of the undeformed robot as described and as built, (..., 4, 4) each."""
        return self._tip(self.linkage, q), self._tip(self.built, q)

    def _tip(self, linkage: Linkage, q: FloatArray) -> FloatArray:
        """Return T_base_tcp; the last is kept, since one posture is evaluated repeatedly."""
        described, asked = linkage is self.linkage, q.tobytes()
        known = self._recent.get(described)
        if known is None or known[0] != asked or known[1].shape[:-2] != q.shape[:-1]:
            known = self._recent[described] = (asked, linkage.forward(q))
        return known[1]

    def solve(self, T_base_tcp: FloatArray, start: FloatArray) -> InverseResult:
        """Return joints that bring the undeformed tool to poses, external axes where they start.

        Parameters
        ----------
        T_base_tcp : ndarray, shape (pose, 4, 4)
        start : ndarray, shape (pose, joint)
            In rad or m.
        """
        return solve_inverse(self.linkage, T_base_tcp, start, tolerance=1e-10, locked=self.external)

    def rest(
        self,
        q: FloatArray,
        force_base: FloatArray,
        springs: RobotSprings,
        start: FloatArray | None = None,
        attack_tcp: FloatArray | None = None,
        reaction: Reaction | None = None,
    ) -> RobotEquilibrium:
        """Return the equilibrium of the robot, in one posture or in many at once.

        Fifty postures at once take a tenth of the time of one after another.

        Parameters
        ----------
        q : ndarray, shape (joint,) or (posture, joint)
            Positions that the motors hold, in rad or m.
        force_base : ndarray, shape (3,) or (posture, 3)
            Force on the robot at its tool centre point, in N.
        springs : RobotSprings
            The springs, with what they remember.
        start : ndarray, shape (spring,) or (posture, spring), optional
            Spring positions near the result.
        attack_tcp : ndarray, shape (3,) or (posture, 3), optional
            Where the force acts on the tool, in its own frame, in m.
        reaction : Reaction, optional
            What pushes back on the tool beside the force.

        Raises
        ------
        EquilibriumError
            If the robot cannot carry the load.
        """
        springs = springs.at_joint(q[..., self.external + 1])
        batch = q.shape[:-1]
        mechanism = self._mechanism(np.atleast_2d(q), np.atleast_2d(force_base), springs)
        mechanism = replace(mechanism, reaction=reaction)
        if attack_tcp is not None:
            mechanism = replace(mechanism, loads=self._attacked(mechanism.loads, attack_tcp))
        theta = np.zeros((*batch, len(springs.stiffness))) if start is None else start
        theta = np.atleast_2d(theta)
        points = mechanism.load_points(mechanism.motions(theta))
        theta, state = mechanism.rest(theta, points, BALANCE)
        total = mechanism.motions(theta)
        T_base_tip = self.built.T_base_tip
        tool = total[-1] @ T_base_tip
        sensor = total[-1 - _END_EFFECTOR] @ T_base_tip @ self.T_tcp_sensor
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
        chain = self.chain
        weights = np.repeat(self._weights[None], len(q), axis=0)
        forces = np.concatenate([force_base[:, None], weights], axis=1)
        loads = DeadLoads(self._points, self._after, forces)
        return LoadedMechanism(chain.screws, chain.spring_elements, springs, chain.held(q), loads)

    def _attacked(self, loads: DeadLoads, attack_tcp: FloatArray) -> DeadLoads:
        """Return the loads with the first one at a point (..., 3) of the tool."""
        T, attack = self.built.T_base_tip, np.atleast_2d(attack_tcp)
        point = np.repeat(loads.point[:, None], len(attack), axis=1)
        point[0] = attack @ T[:3, :3].T + T[:3, 3]
        return replace(loads, point=point)


def _springs(cell: Cell, linkage: Linkage, external: int) -> tuple[SpringChain, RobotSprings]:
    """Return the positions of the springs of a cell's robot, and their laws."""
    truth, scale = truth_of(cell), truth_of(cell).truth
    size = _size(linkage, external)
    usual = size * HIGH_TORQUE * np.array(AXIAL_STIFFNESS)
    stiffness = scale.gears * np.array(truth.gears.stiffness or usual)
    bearings = scale.bearings / scale.gears * np.array(truth.bearings.ratio)
    bending = scale.links * (truth.links.bending or size * LINK_BENDING)
    gears = [axial_spring(linkage, joint, float(k)) for joint, k in enumerate(stiffness, external)]
    turn, offset = truth.bearings.turn, truth.bearings.offset
    tilts = [
        tilt_springs(linkage, joint, k * bearings, turn, offset)
        for joint, k in enumerate(stiffness, external)
    ]
    springs = [
        *_drives(cell, linkage, external),
        *_floor(linkage, external, scale.floor * truth.floor.tilt),
        *gears,
        *itertools.chain(*tilts),
        *(s for i in (1, 2) for s in _bending(linkage, external + i, bending)),
        *_end_effector(cell, linkage),
    ]
    chain = build_spring_chain(linkage, springs)
    ks = np.array([spring.law.k for spring in chain.springs if isinstance(spring.law, Linear)])
    order = [id(spring) for spring in chain.springs]
    which = np.array([order.index(id(gear)) for gear in gears])
    laws = GearLaws.of(truth.gears, which, ks[which])
    balancer = _balancer(cell, linkage, size)
    if balancer is not None and balancer.seal_friction > 0.0:
        laws = laws.with_seals(balancer.lever)
    return chain, RobotSprings(ks, laws, None, balancer, int(which[1]), np.zeros(()))


def _size(linkage: Linkage, external: int) -> float:
    """Return the mass that the arm moves over that of a 1.1 t arm; 1 when it is not known."""
    moved = sum(body.mass for body in linkage.masses if body.joint > external)
    return moved / MOVED_MASS if moved > 0.0 else 1.0


def _drives(cell: Cell, linkage: Linkage, external: int) -> list[TruthSpring]:
    entry, scale = truth_of(cell).external, truth_of(cell).truth.external
    stiffness = {True: scale * entry.turning, False: scale * entry.linear}
    return [
        axial_spring(linkage, joint, stiffness[linkage.revolute[joint]])
        for joint in range(external)
    ]


def _floor(linkage: Linkage, external: int, tilt: float) -> list[TruthSpring]:
    """Return turns about the point of axis 1 that is nearest to the origin of base."""
    T_base_joint, screws = linkage.T_base_joint[external], linkage.screws
    axis, point = screws.axis[external], screws.point[external]
    foot = point - axis * (axis @ point)
    at = triple(T_base_joint[:3, :3].T @ (foot - point))
    name = linkage.joint_names[external]
    return [TruthSpring(name, triple(T_base_joint[k, :3]), Linear(tilt), at=at) for k in range(3)]


def _bending(linkage: Linkage, joint: int, stiffness: float) -> list[TruthSpring]:
    """Return two hinges in the middle of the link behind a joint; none for a short one."""
    ends = linkage.T_base_joint[joint : joint + 2, :3, 3]
    if not np.linalg.norm(ends[1] - ends[0]) > _SHORT_LINK:
        return []
    return link_hinges(linkage, linkage.joint_names[joint], stiffness)


def _end_effector(cell: Cell, linkage: Linkage) -> list[TruthSpring]:
    """Return three turns and three shifts at the sensor, last of all springs."""
    entry, scale = truth_of(cell).end_effector, truth_of(cell).truth.end_effector
    T = inverse_transform(linkage.T_base_joint[-1]) @ linkage.T_base_tip @ _sensor_frame(cell)
    at, name = triple(T[:3, 3]), linkage.joint_names[-1]
    kinds = ((True, scale * entry.turn), (False, scale * entry.shift))
    return [
        TruthSpring(name, triple(T[:3, k]), Linear(stiffness), turns, distal=True, at=at)
        for turns, stiffness in kinds
        for k in range(3)
    ]


def _sensor_frame(cell: Cell) -> FloatArray:
    """Return T_tcp_sensor of the undeformed robot; the flange where there is no sensor."""
    sensor = cell.T_sensor_tcp
    return cell.T_tcp_flange if sensor is None else inverse_transform(sensor)


def _balancer(cell: Cell, linkage: Linkage, size: float) -> BalancerSpring | None:
    """Return the balancer of axis 2, tuned for the mounting of the robot.

    Upright is where the link behind axis 2 points along axis 1 against gravity. Without a link,
    or with axis 1 level (a robot on a wall), no spring balances the arm.
    """
    entry, scale = truth_of(cell).balancer, truth_of(cell).truth.balancer
    first = len(linkage.joint_names) - ARM_JOINTS
    screws, arm = linkage.screws, linkage.T_base_joint[first + 2, :3, 3]
    up = -screws.axis[first] * (screws.axis[first] @ cell.gravity_base)
    axis = screws.axis[first + 1]
    link, up = (v - axis * (axis @ v) for v in (arm - screws.point[first + 1], up))
    if not entry.fitted or not min(np.linalg.norm(link), np.linalg.norm(up)) > 1e-6:
        return None
    upright = math.atan2(float(axis @ np.cross(link, up)), float(link @ up))
    rate = scale * (entry.rate or size * BALANCER_RATE)
    lengths = (entry.free_length, entry.anchor, entry.lever)
    return BalancerSpring(rate, *lengths, upright, entry.seal_friction)
