"""A robot that gives way, made by the physics engine MuJoCo: a truth that elastocal has no part in.

What the estimator is judged by shares no equation with it. The engine reads the URDF itself, and
gives kinematics, Jacobians and the torques of gravity. Four laws stand here:

* **Springs.** Each joint has three torsional springs before its motor: two that tilt its bearing
  and one about its axis, the gear. A bending link is two more hinges at its middle.
* **Gears** are softer at rest than under load, ``x = (t + a T tanh(t / T)) / k``: the estimator
  has arc tangents.
* **Friction** in the gears is Dahl's, ``dF/dx = s (1 - F sign(dx) / F_c)`` (P. Dahl, *A solid
  friction model*, 1968): the estimator has elements that stick or slide.
* **Equilibrium**: every spring turns until it bears the torque of gravity and of the force on the
  tool at the *deformed* arm. The estimator takes torques at the arm of the drawing.

A campaign is the paper's Procedure 1: the tool stops before the tooling, where the zero of both
displacements is read; then it presses, load case by load case, while the controller follows until
the tool stands where the tooling holds it. All in SI units and radians, all frames are base.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

mujoco = pytest.importorskip("mujoco", reason="needs the engine: pip install 'elastocal[nightly]'")

TILT = (4.0, 6.0)
"""How many times as stiff each bearing is against tilting."""
_ASIDE = 280.0 / 1100.0
PRESSES = np.array(
    [[0, 0, -1], [_ASIDE, 0, -1], [-_ASIDE, 0, -1], [0, -_ASIDE, -1], [0, _ASIDE, -1]]
)
"""The paper's five load cases, as force on the robot in the tcp frame, over the press."""
GAP = 3e-3
"""Way to the tooling from where the zero is read, in m."""
_ENGINE = '<mujoco><compiler fusestatic="false" discardvisual="true" strippath="true"/></mujoco>'
_ROUNDS = 200


@dataclass(frozen=True)
class Drawing:
    """An arm with its tool as its maker draws it, and how stiff it is."""

    urdf: str
    stiffness: tuple[float, ...]
    """Of the gears far beyond their knee, in N·m/rad."""
    bending: float
    """Stiffness of a bending link, in N·m/rad."""
    links: tuple[str, ...]
    """Joints before which a link bends at its middle, where the laws say so."""
    press: float
    """Force of the load cases, in N."""
    knee: float
    """Twist at which a gear has stiffened, in rad."""
    tooling: float
    """Stiffness of the tooling, in N/m."""

    @property
    def loads_tcp(self) -> np.ndarray:
        """The load cases, as force on the robot in the tcp frame, shape (load, 3), in N."""
        return self.press * PRESSES


@dataclass(frozen=True)
class Laws:
    """What the arm is made of, beside linear springs."""

    softening: float = 0.0
    """How much softer than beyond the knee a gear is at rest, as a part."""
    bending: bool = False
    """Whether links bend."""
    lost_motion: float = 0.0
    """Angle between a torque and its opposite that friction leaves in every gear, in rad."""
    dahl: float = 2.0
    """Stiffness of the friction at rest over that of the gear."""


class MujocoArm:
    """An arm with springs, in equilibrium; see the module."""

    def __init__(self, drawing: Drawing, laws: Laws) -> None:
        self.drawing, self.laws = drawing, laws
        spec = mujoco.MjSpec.from_string(drawing.urdf.replace("</robot>", f"{_ENGINE}</robot>"))
        spec.option.gravity = [0.0, 0.0, -9.80665]
        names, stiffness, is_gear = _insert_springs(spec, drawing, laws)
        tip = spec.body("tcp")
        tip.add_site(name="tcp")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        motors = [name for name in names if name not in stiffness]
        self.k = np.array(list(stiffness.values()))
        self.is_gear = np.array([name in is_gear for name in stiffness])
        # Every joint of the model is a hinge: its place is the same in positions and velocities.
        self._motors = np.array([self.model.joint(name).dofadr[0] for name in motors])
        self._springs = np.array([self.model.joint(name).dofadr[0] for name in stiffness])
        self._site = self.model.site("tcp").id

    @property
    def friction_limit(self) -> np.ndarray:
        """Torque at which the friction of each spring slides, shape (spring,), in N·m."""
        return np.where(self.is_gear, 0.5 * self.laws.lost_motion * self.k, 0.0)

    def rigid(self, q: np.ndarray) -> np.ndarray:
        """Return ``T_base_tcp`` as the controller believes it, shape (4, 4)."""
        self._move(q, np.zeros(len(self.k)))
        return self._tcp()

    def joints_at(self, T_base_tcp: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return the joints at which the undeformed tool stands there, by Newton from ``q``."""
        q = q.copy()
        for _ in range(20):
            here = self.rigid(q)
            turn = Rotation.from_matrix(T_base_tcp[:3, :3] @ here[:3, :3].T).as_rotvec()
            missed = np.concatenate([T_base_tcp[:3, 3] - here[:3, 3], turn])
            if np.abs(missed).max() < 1e-12:
                return q
            q += np.linalg.lstsq(np.vstack(self._jacobians())[:, self._motors], missed, None)[0]
        raise ValueError(f"no joints for {T_base_tcp[:3, 3]}: {missed}")

    def equilibrium(
        self, q: np.ndarray, force: np.ndarray, friction: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the true tcp and the torque about each spring, shapes (3,) and (spring,).

        Parameters
        ----------
        q : ndarray, shape (joint,)
            Joints of the controller.
        force : ndarray, shape (3,)
            Force on the robot at the tcp, in base.
        friction : ndarray, shape (spring,)
            Torque that friction bears in each spring.
        """
        twist = np.zeros(len(self.k))
        for _ in range(_ROUNDS):
            self._move(q, twist)
            weight = np.zeros(self.model.nv)
            mujoco.mj_rne(self.model, self.data, 0, weight)
            torque = (self._jacobians()[0].T @ force - weight)[self._springs]
            before, twist = twist, self._twist(torque - friction)
            if np.abs(twist - before).max() < 1e-14:
                break
        return self._tcp()[:3, 3], torque

    def slide(self, friction: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Return what friction bears after the torques went straight from start to end.

        The twist then goes one way only, along which Dahl's law has the closed form
        ``F = s F_c - (s F_c - F_0) exp(-sigma |x - x_0| / F_c)``. Sought is the twist at which
        spring and friction bear the torque together, by halving.
        """
        limit = self.friction_limit
        sticks = limit > 0.0
        way, most = np.sign(end - start), np.where(sticks, limit, 1.0)
        x_0, sigma = self._twist(start - friction), self.laws.dahl * self.k

        def borne(elastic: np.ndarray) -> np.ndarray:
            gone = np.abs(self._twist(elastic) - x_0)
            return way * most - (way * most - friction) * np.exp(-sigma * gone / most)

        low, high = np.minimum(start, end) - 2.0 * most, np.maximum(start, end) + 2.0 * most
        low, high = (
            np.where(way > 0, start - friction, low),
            np.where(way < 0, start - friction, high),
        )
        for _ in range(80):
            middle = 0.5 * (low + high)
            over = middle + borne(middle) > end
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        return np.where(sticks & (way != 0.0), borne(0.5 * (low + high)), friction)

    def _twist(self, torque: np.ndarray) -> np.ndarray:
        """Return how far each spring turns under the torque that it bears itself."""
        knee = self.k * self.drawing.knee
        soft = np.where(self.is_gear, self.laws.softening, 0.0)
        return (torque + soft * knee * np.tanh(torque / knee)) / self.k

    def _move(self, q: np.ndarray, twist: np.ndarray) -> None:
        self.data.qpos[self._motors], self.data.qpos[self._springs] = q, twist
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def _tcp(self) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3] = self.data.site_xmat[self._site].reshape(3, 3)
        T[:3, 3] = self.data.site_xpos[self._site]
        return T

    def _jacobians(self) -> np.ndarray:
        """Return the Jacobians of the tcp, translation and rotation, shape (2, 3, all joints)."""
        J = np.zeros((2, 3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, J[0], J[1], self._site)
        return J


def _insert_springs(
    spec: "mujoco.MjSpec", drawing: Drawing, laws: Laws
) -> tuple[list[str], dict[str, float], set[str]]:
    """Put the springs before each motor; return all joints, stiffnesses, and names of gears."""
    stiffness, gears, names = dict[str, float](), set[str](), list[str]()
    motors = [(joint.name, joint.axis.copy(), joint.parent) for joint in spec.joints]
    for joint in spec.joints:
        spec.delete(joint)
    hinge = mujoco.mjtJoint.mjJNT_HINGE

    def add(body, name: str, axis: np.ndarray, k: float | None, at=(0.0, 0.0, 0.0)) -> None:
        # The inertia of a rotor keeps the engine's mass matrix regular; statics do not know it.
        body.add_joint(name=name, type=hinge, axis=axis, pos=at, armature=1.0)
        names.append(name)
        if k is not None:
            stiffness[name] = k

    for (name, axis, body), k in zip(motors, drawing.stiffness, strict=True):
        if laws.bending and name in drawing.links:
            # From the middle of the link before, seen in the frame of the body that it carries.
            link = Rotation.from_quat(np.roll(body.quat, -1)).inv().apply(body.pos)
            along = link / np.linalg.norm(link)
            first = np.cross(along, np.eye(3)[np.abs(along).argmin()])
            first /= np.linalg.norm(first)
            for n, each in enumerate((first, np.cross(along, first))):
                add(body, f"{name}.bend{n}", each, drawing.bending, -0.5 * link)
        across = [each for each in np.eye(3) if abs(each @ axis) < 0.5]
        for n, (each, times) in enumerate(zip(across, TILT, strict=True)):
            add(body, f"{name}.tilt{n}", each, times * k)
        add(body, f"{name}.gear", axis, k)
        gears.add(f"{name}.gear")
        add(body, name, axis, None)
    return names, stiffness, gears


@dataclass(frozen=True)
class Campaign:
    """What controller, sensor and tracker say of presses at some poses, in order of time."""

    reference_joints: np.ndarray
    """Where the zero was read, shape (pose, joint)."""
    joints: np.ndarray
    """Of the controller under load, shape (pose, load, joint)."""
    force: np.ndarray
    """As the sensor shows it, shape (pose, load, 3)."""
    controller_displacement: np.ndarray
    """Shape (pose, load, 3)."""
    marker_displacement: np.ndarray
    """Shape (pose, load, 3)."""


@dataclass(frozen=True)
class Procedure:
    """How a campaign is done, and what its instruments add."""

    levels: tuple[float, ...] = ()
    """Parts of the first load case that are pressed after the five."""
    marker_noise: float = 15e-6
    """Standard deviation of a reading of the tracker, in m."""
    force_noise: float = 2.0
    """Of the sensor, in N."""
    residual: float = 0.0
    """Part of its limit that friction may bear, either way, when the arm comes to a pose."""
    conditioned: bool = False
    """Whether the first load case is a press before the zero is read."""


def campaign(arm: MujocoArm, q: np.ndarray, how: Procedure, rng: np.random.Generator) -> Campaign:
    """Press at poses whose undeformed tool touches the tooling, shape (pose, joint)."""
    five = arm.drawing.loads_tcp
    loads = np.vstack([five, *(level * five[:1] for level in how.levels)])
    shape = (len(q), len(loads), 3)
    joints, seen = np.empty((*shape[:2], q.shape[1])), np.empty(shape)
    shown, forces, references = np.empty(shape), np.empty(shape), np.empty_like(q)
    for pose, touching in enumerate(q):
        T = arm.rigid(touching)
        visit = _Visit(arm, T, touching, how, rng)
        forces[pose] = loads @ T[:3, :3].T
        for case, force in enumerate(forces[pose]):
            joints[pose, case], seen[pose, case] = visit.press(force)
            if how.conditioned and case == 0:
                visit.read_zero()
        seen[pose] -= visit.zero
        references[pose] = visit.reference
        shown[pose] = [arm.rigid(each)[:3, 3] for each in joints[pose]]
        shown[pose] -= arm.rigid(visit.reference)[:3, 3]
    noise = how.marker_noise * rng.standard_normal((len(q), 1 + len(loads), 3))
    return Campaign(
        references,
        joints,
        forces + how.force_noise * rng.standard_normal(shape),
        shown,
        seen + noise[:, 1:] - noise[:, :1],
    )


class _Visit:
    """The arm at one pose, from the zero on; its gears remember."""

    def __init__(self, arm, T_base_tcp, touching, how, rng) -> None:
        self.arm, self.T = arm, T_base_tcp
        before = T_base_tcp.copy()
        before[:3, 3] -= GAP * before[:3, 2]
        self.reference = self.q = arm.joints_at(before, touching)
        limit = arm.friction_limit
        self.friction = how.residual * rng.uniform(-1.0, 1.0, len(limit)) * limit
        _, self.torque = arm.equilibrium(self.q, np.zeros(3), self.friction)
        self.read_zero()

    def read_zero(self) -> None:
        """Read the tracker where the tool stands before the tooling, unloaded."""
        _, torque = self.arm.equilibrium(self.reference, np.zeros(3), self.friction)
        self.friction = self.arm.slide(self.friction, self.torque, torque)
        self.zero, self.torque = self.arm.equilibrium(self.reference, np.zeros(3), self.friction)

    def press(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Press; return the joints of the controller and the true tcp."""
        held = self.zero + GAP * self.T[:3, 2] - force / self.arm.drawing.tooling
        friction = self.friction
        for _ in range(4):
            tcp, torque = self.arm.equilibrium(self.q, force, friction)
            friction = self.arm.slide(self.friction, self.torque, torque)
            goal = self.T.copy()
            goal[:3, 3] = self.arm.rigid(self.q)[:3, 3] + held - tcp
            self.q = self.arm.joints_at(goal, self.q)
        tcp, torque = self.arm.equilibrium(self.q, force, friction)
        self.friction = self.arm.slide(self.friction, self.torque, torque)
        tcp, self.torque = self.arm.equilibrium(self.q, force, self.friction)
        return self.q, tcp


def true_deflection(arm: MujocoArm, q: np.ndarray, *presses: np.ndarray) -> np.ndarray:
    """Return the true deflection of the last of some presses, of which the first is from rest.

    Against the unloaded arm before the first. The force goes straight from each press to the next.

    Parameters
    ----------
    q : ndarray, shape (pose, joint)
    presses : ndarray, shape (pose, 3)
        Forces one after another.
    """
    rest, found = np.zeros(len(arm.k)), np.empty_like(presses[-1])
    for pose, joints in enumerate(q):
        free, torque = arm.equilibrium(joints, np.zeros(3), rest)
        friction = rest
        for force in presses:
            before, start = friction, torque
            for _ in range(4):
                pressed, torque = arm.equilibrium(joints, force[pose], friction)
                friction = arm.slide(before, start, torque)
        found[pose] = pressed - free
    return found
