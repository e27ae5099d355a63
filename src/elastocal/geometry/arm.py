"""The arm with its geometric errors: forward kinematics and their derivatives, all poses at once.

Each joint's frame is placed in the link before it by ``placement · [R(r) | t]``, three shifts ``t``
and three small turns ``r`` along and about the axes of that frame; the joint then moves by

    q' = q + o + s q + sum_k (a_k sin kq + b_k cos kq) + c tau,

its offset ``o``, transmission ``s``, errors of its gear and encoder ``k`` times a turn, and the
rotation by its compliance under the torque ``tau`` of weight, payload and process force. The
moments ``m`` of these loads across the joint's axis bend its bearing and the link before it, by the
compliances ``b``: three turns by ``b m`` about the axes of the frame, one after the other, follow
``R(r)``, as the virtual joints of `elastocal.elastic` do. Where a description has no masses, the
torque of bars in their place turns a joint by a compliance of its own
(`elastocal.geometry.assumed_masses`). A rotation of the placement about the joint's own axis is its
offset and is not counted twice. The poses of the base and of the markers are further unknowns
(`elastocal.geometry.problem`). This is the product of exponentials about the nominal frames (R. He
et al., IEEE Transactions on Robotics 26(3), 2010): it needs no case for parallel axes, as Denavit
and Hartenberg's parameters do; numbers that the positions do not determine are found from the
derivatives themselves.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, IndexArray
from elastocal.results import brief_repr
from elastocal.robot import Robot

KINDS = ("shift_x", "shift_y", "shift_z", "turn_x", "turn_y", "turn_z")
"""Errors of a joint's pose in the link before it."""
BENDS = ("bend_x", "bend_y", "bend_z")
"""Compliances of a joint's bearing about the axes of its frame, in rad/(N·m)."""
LOW_ORDERS, ORDERS = 2, 40
"""Orders of an arm's eccentric gears, and of all that is fitted: how often a turn."""


def motion_names(orders: int) -> tuple[str, ...]:
    """Return the errors of a joint's motion, with a series up to some order.

    >>> motion_names(2)
    ('offset', 'scale', 'sin', 'cos', 'sin2', 'cos2', 'compliance')
    """
    counts = ("", *range(2, orders + 1))
    return ("offset", "scale", *(f"{f}{k}" for k in counts for f in ("sin", "cos")), "compliance")


MOTION = motion_names(LOW_ORDERS)
"""Errors of a joint's motion of an arm without functions of its joints."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ArmErrors:
    """Geometric errors of a chain."""

    place: FloatArray
    """Shape (joint, 6): shifts in m, rotations in rad."""
    motion: FloatArray
    """Shape (joint, 3 + 2 orders): in the order of `motion_names`; rad (m) of each unit term,
    rad/(N·m)."""
    bend: FloatArray
    """Shape (joint, 3), in the order of `BENDS`; 0 about the axis of a joint that turns."""
    sag: FloatArray
    """Compliance to the own weight by assumed masses, shape (joint,), in rad/(N·m), of linear axes
    in m/N; 0 where masses are known, to which joints yield by their compliance."""

    @classmethod
    def none(cls, joints: int) -> "ArmErrors":
        """Return the nominal arm."""
        place, motion, bend = (np.zeros((joints, len(each))) for each in (KINDS, MOTION, BENDS))
        return cls(place, motion, bend, np.zeros(joints))

    @property
    def series(self) -> FloatArray:
        """Sines and cosines of each order, shape (joint, order, 2), in rad."""
        return self.motion[:, 2:-1].reshape(len(self.motion), -1, 2)

    def up_to(self, orders: int) -> "ArmErrors":
        """Return the same errors with the series up to some order; what it lacks is 0."""
        kept = min(2 * orders, self.motion.shape[1] - 3)
        motion = np.zeros((len(self.motion), 3 + 2 * orders))
        motion[:, : 2 + kept], motion[:, -1] = self.motion[:, : 2 + kept], self.motion[:, -1]
        return ArmErrors(self.place.copy(), motion, self.bend.copy(), self.sag.copy())

    def shortest(self) -> "ArmErrors":
        """Return the same errors without orders that no joint has, beyond the low ones."""
        there = np.flatnonzero(self.series.any(axis=(0, 2)))
        return self.up_to(max(LOW_ORDERS, int(there[-1]) + 1 if len(there) else 0))

    def moved(self, q: FloatArray, loads: "JointLoads") -> FloatArray:
        """Return how far the joints really turn, shape (pose, joint), in rad or m."""
        waved = series(q, self.shortest().series)
        offset, scale, compliance = self.motion[:, [0, 1, -1]].T
        yielded = compliance * loads.torque + self.sag * loads.own
        return np.asarray(q + offset + scale * q + waved + yielded)


@brief_repr
@dataclass(frozen=True, eq=False)
class JointLoads:
    """What weight, payload and process force ask of each joint."""

    torque: FloatArray
    """Along its axis, shape (pose, joint), in N·m (N)."""
    moment: FloatArray
    """About the axes of its frame before its motion, shape (pose, joint, 3), in N·m."""
    own: FloatArray
    """Along its axis by the weight of assumed masses, which ``torque`` then does not hold, shape
    (pose, joint), in N·m (N); 0 where masses are known."""

    @classmethod
    def none(cls, q: FloatArray) -> "JointLoads":
        """Return no loads at joints, shape (pose, joint)."""
        return cls(np.zeros_like(q), np.zeros((*q.shape, 3)), np.zeros_like(q))


@brief_repr
@dataclass(frozen=True, eq=False)
class ArmFrames:
    """Frames of the joints and the tcp of an arm at some poses."""

    rotation: FloatArray
    """Frames of the joints before their motion, in base, shape (joint, pose, 3, 3)."""
    shifts: FloatArray
    """Directions of their shifts in base, shape (joint, pose, 3, 3): of the frame as drawn."""
    turns: FloatArray
    """Axes about which an increment of their turns turns them in base, likewise."""
    bends: FloatArray
    """Axes about which their bearings bend in base, likewise."""
    origin: FloatArray
    """Their origins, shape (joint, pose, 3), in m."""
    axis: FloatArray
    """Axes of the joints in base, shape (joint, pose, 3)."""
    T_base_tcp: FloatArray
    """Shape (pose, 4, 4), in m."""


def frames(robot: Robot, q: FloatArray, loads: JointLoads, errors: ArmErrors) -> ArmFrames:
    """Return the frames of an arm with errors.

    Parameters
    ----------
    robot : Robot
        The nominal arm.
    q : ndarray, shape (pose, joint)
        Joints as the controller states them, in rad or m.
    loads : JointLoads
        Loads that joints and bearings yield to.
    errors : ArmErrors
        Its errors.
    """
    count, joints = len(q), robot.chain.joints
    R, p = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
    rotation, origin, axis, shifts, turns, bends = [], [], [], [], [], []
    moved = errors.moved(q, loads)
    for index, joint in enumerate(joints):
        place = errors.place[index]
        T = joint.placement
        p = p + R @ T[:3, 3]
        R = R @ T[:3, :3]
        p = p + R @ place[:3]
        shifts.append(R)
        R = R @ Rotation.from_rotvec(place[3:]).as_matrix()
        turns.append(R @ _increments(place[3:]))
        R, across = _bent(R, errors.bend[index] * loads.moment[:, index])
        bends.append(across)
        rotation.append(R)
        origin.append(p)
        axis.append(R @ joint.axis)
        if joint.revolute:
            R = R @ Rotation.from_rotvec(moved[:, index, None] * joint.axis).as_matrix()
        else:
            p = p + axis[-1] * moved[:, index, None]
    T_tip = robot.chain.T_last_tip
    tip = np.zeros((count, 4, 4))
    tip[:, 3, 3] = 1.0
    tip[:, :3, :3] = R @ T_tip[:3, :3]
    tip[:, :3, 3] = p + R @ T_tip[:3, 3]
    return ArmFrames(
        rotation=np.array(rotation),
        shifts=np.array(shifts),
        turns=np.array(turns),
        bends=np.array(bends),
        origin=np.array(origin),
        axis=np.array(axis),
        T_base_tcp=tip,
    )


def _bent(R: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return frames turned about their axes in turn, shape (pose, 3, 3), and these axes in base.

    Parameters
    ----------
    R : ndarray, shape (pose, 3, 3)
        Frames before.
    angle : ndarray, shape (pose, 3)
        Turns about x, y and z, in rad.
    """
    axes = np.empty_like(R)
    for k, axis in enumerate(np.eye(3)):
        axes[:, :, k] = R[:, :, k]
        if angle[:, k].any():
            R = R @ Rotation.from_rotvec(angle[:, k, None] * axis).as_matrix()
    return R, axes


def _increments(turn: FloatArray) -> FloatArray:
    """Return how increments of a turn's vector turn a frame about its own axes, shape (3, 3).

    The right Jacobian of the rotations (G. S. Chirikjian, "Stochastic Models, Information Theory,
    and Lie Groups" 2, 2012, section 10.8); its second term by its series, as turns are small.
    """
    x, y, z = turn
    angle = float(np.linalg.norm(turn))
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    first = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    second = 1.0 / 6.0 - angle**2 / 120.0 + angle**4 / 5040.0
    return np.asarray(np.eye(3) - first * K + second * K @ K)


def arm_length(robot: Robot) -> float:
    """Return the length of an arm's links behind its first joint, in m."""
    joints = robot.chain.joints[robot.external_axes + 1 :]
    steps = [*(each.placement for each in joints), robot.chain.T_last_tip]
    return sum(float(np.linalg.norm(T[:3, 3])) for T in steps)


def motion_terms(q: FloatArray, torque: FloatArray) -> FloatArray:
    """Return the factors of each error of a joint's motion in `MOTION`, shape (pose, joint, 7)."""
    low = waves(q, 1, LOW_ORDERS)
    return np.concatenate([np.stack([np.ones_like(q), q], 2), low, torque[..., None]], axis=2)


def waves(q: FloatArray, first: int, last: int) -> FloatArray:
    """Return sine and cosine of some orders in turn, shape (pose, joint, 2 orders)."""
    # The poses come last in memory: the recurrence then runs along them.
    turn = np.exp(1j * q.T)
    power, found = turn**first, np.empty((q.shape[1], 2 * (last + 1 - first), len(q)))
    for k in range(last + 1 - first):
        power = power * turn if k else power
        found[:, 2 * k], found[:, 2 * k + 1] = power.imag, power.real
    return found.transpose(2, 0, 1)


def series(q: FloatArray, terms: FloatArray, first: int = 1) -> FloatArray:
    """Return the sum of sines and cosines of each joint, by Horner's rule, shape (pose, joint).

    Parameters
    ----------
    q : ndarray, shape (pose, joint)
        Angles, in rad.
    terms : ndarray, shape (joint, order, 2)
        Of sine and cosine.
    first : int
        The first order.
    """
    turn = np.exp(1j * q)
    total = np.zeros_like(turn)
    for sine, cosine in terms.transpose(1, 2, 0)[::-1]:
        total = total * turn + (cosine - 1j * sine)
    return np.asarray((total * turn**first).real)


def point_motions(
    robot: Robot,
    at: ArmFrames,
    terms: FloatArray,
    loads: JointLoads,
    points: FloatArray,
    row: IndexArray,
) -> Iterator[FloatArray]:
    """Yield, joint by joint, the motion of points on the tool by each of its errors.

    A point at a lever ``l`` from an axis ``a`` moves by ``a x l`` when it turns, by ``a`` when it
    slides (K. M. Lynch, F. C. Park, "Modern Robotics", 2017, section 5.1).

    Parameters
    ----------
    robot : Robot
        The nominal arm.
    at : ArmFrames
        Frames of the arm with its errors.
    terms : ndarray, shape (pose, joint, 7)
        By `motion_terms`.
    loads : JointLoads
        As for `frames`.
    points : ndarray, shape (point, 3)
        In base, in m.
    row : ndarray, shape (point,)
        Pose of each.

    Yields
    ------
    ndarray, shape (point, 3, 17)
        By shifts and turns of the joint's place (`KINDS`), then errors of its motion (`MOTION`),
        compliances of its bearing (`BENDS`), and its sag.
    """
    shifts, turns = len(KINDS) // 2, len(KINDS)
    motions = turns + len(MOTION)
    for number, joint in enumerate(robot.chain.joints):
        lever = points - at.origin[number][row]
        axis, axes = at.axis[number][row], at.turns[number][row]
        x, y, z = lever.T[..., None]
        found = np.empty((len(points), 3, motions + len(BENDS) + 1))
        found[:, :, :shifts] = at.shifts[number][row]
        found[:, 0, shifts:turns] = axes[:, 1] * z - axes[:, 2] * y
        found[:, 1, shifts:turns] = axes[:, 2] * x - axes[:, 0] * z
        found[:, 2, shifts:turns] = axes[:, 0] * y - axes[:, 1] * x
        own = np.cross(axis, lever) if joint.revolute else axis
        found[:, :, turns:motions] = own[:, :, None] * terms[row, number][:, None]
        for k in range(len(BENDS)):
            across = np.cross(at.bends[number][row][:, :, k], lever)
            found[:, :, motions + k] = across * loads.moment[row, number, k, None]
        found[:, :, -1] = own * loads.own[row, number, None]
        yield found
