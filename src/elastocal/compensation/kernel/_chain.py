"""The chain as statements: joint frames, and the moment of the arm's own weight."""

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel.program import ONE, ZERO, Matrix, Program, Value, Vector
from elastocal.robot import ChainJoint, Robot, SerialChain

NOTHING: Vector = (ZERO, ZERO, ZERO)
_IDENTITY: Matrix = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


@dataclass(frozen=True)
class Frame:
    """A frame in base."""

    rotation: Matrix
    origin: Vector


@dataclass(frozen=True)
class _JointFrames:
    """A joint's frame before and behind its motion."""

    proximal: Frame
    distal: Frame


@dataclass(frozen=True)
class ChainFrames:
    """Every frame of the chain."""

    joints: tuple[_JointFrames, ...]
    tcp: Frame


def write_chain(program: Program, chain: SerialChain) -> ChainFrames:
    """Add the statements of the forward chain (paper Eq. 1-3) and return its frames.

    Joint ``k`` counts from 1. Its names are ``p<k>`` (rotation before the motion), ``r<k>``
    (behind it), ``o<k>`` (origin before), ``d<k>`` (origin behind a linear motion).
    """
    # From the base out: what is 0 or 1 in the first frames leaves no statement in those behind.
    here = Frame(_IDENTITY, NOTHING)
    joints = []
    for k, joint in enumerate(chain.joints, start=1):
        program.remark(f"joint {k}, {joint.name}")
        place = _constant_frame(program, f"place{k}", joint.placement)
        proximal = _behind(program, here, place, (f"p{k}", f"o{k}"))
        distal = _moved(program, proximal, joint, k)
        joints.append(_JointFrames(proximal, distal))
        here = distal
    program.remark(f"tool centre point, {chain.tip}")
    tip = _constant_frame(program, "tip", chain.T_last_tip)
    return ChainFrames(tuple(joints), _behind(program, here, tip, ("t", "tcp")))


def _constant_frame(program: Program, name: str, T: FloatArray) -> Frame:
    x, y, z = (
        program.constant_vector(f"{name}_{a}", row) for a, row in zip("xyz", T[:3, :3], strict=True)
    )
    return Frame((x, y, z), program.constant_vector(name, T[:3, 3]))


def _behind(program: Program, here: Frame, place: Frame, names: tuple[str, str]) -> Frame:
    """Return ``here @ place``."""
    rotation, origin = names
    return Frame(
        program.product(rotation, here.rotation, place.rotation),
        program.transformed(origin, here.rotation, place.origin, here.origin),
    )


def _moved(program: Program, proximal: Frame, joint: ChainJoint, k: int) -> Frame:
    """Return the frame behind the joint's motion."""
    axis = program.constant_vector(f"axis{k}", joint.axis)
    if joint.revolute:
        sine, cosine = program.turn(k, f"q{k}")
        turn = _rotation(program, f"turn{k}", axis, sine, cosine)
        return Frame(program.product(f"r{k}", proximal.rotation, turn), proximal.origin)
    travel = Value(1, f"q{k}")
    slid = [program.total(f"slide{k}_{a}", [(x, travel)]) for a, x in zip("xyz", axis, strict=True)]
    along = (slid[0], slid[1], slid[2])
    origin = program.transformed(f"d{k}", proximal.rotation, along, proximal.origin)
    return Frame(proximal.rotation, origin)


def _rotation(program: Program, name: str, axis: Vector, sine: Value, cosine: Value) -> Matrix:
    """Return the rotation about an axis (Rodrigues): ``c I + (1 - c) a a^T + s [a]x``."""
    rest = program.total(f"{name}_rest", [(ONE,), (-cosine,)])
    rows = []
    for i, a in enumerate("xyz"):
        row = []
        for j, b in enumerate("xyz"):
            # Row i of [a]x holds -a_k where (i, j, k) is an even permutation, a_k where odd.
            k = 3 - i - j
            if i == j:
                # On a coordinate axis the sum is 1 or the cosine itself.
                plain = axis[i].sign and not axis[i].name
                terms = [(ONE,)] if plain else [(cosine,), (rest, axis[i], axis[i])]
            else:
                skew = -axis[k] if (j - i) % 3 == 1 else axis[k]
                terms = [(rest, axis[i], axis[j]), (sine, skew)]
            row.append(program.total(f"{name}_{a}{b}", terms))
        rows.append((row[0], row[1], row[2]))
    return rows[0], rows[1], rows[2]


@dataclass(frozen=True)
class Weights:
    """The weight that hangs behind each joint, accumulated from the tip to the base.

    About a place ``p`` it has the moment ``(S - W p) x d``, where ``W`` is the weight of all links
    behind, ``S`` the sum of each one's weight times its centre of mass, and ``d`` points down.
    """

    program: Program
    weight: tuple[Value, ...]
    """``W`` behind each joint, in N."""
    first_moment: tuple[Vector, ...]
    """``S`` behind each joint, in base, in N·m."""
    down: Vector
    """``d``: unit vector of gravity in base."""

    def moment(self, label: str, joint: int, place: Vector) -> Vector:
        """Return the moment of what hangs behind a joint about a place, in base, in N·m."""
        hanging = [(ONE, self.first_moment[joint]), (-self.weight[joint], place)]
        lever = self.program.weighted_sum(f"hang{label}", hanging)
        return self.program.cross(f"sag{label}", lever, self.down)

    def force(self, label: str, joint: int) -> Vector:
        """Return the weight behind a joint, in base, in N."""
        return self.program.weighted_sum(f"pull{label}", [(self.weight[joint], self.down)])


def write_weights(program: Program, robot: Robot, chain: ChainFrames) -> Weights:
    """Add the statements of the weights behind all joints."""
    gravity = np.asarray(robot.gravity)
    size = float(np.linalg.norm(gravity))
    program.remark("weight behind each joint, from the tip backwards")
    own = [joint.mass * size for joint in robot.chain.joints]
    behind = list(accumulate(own[::-1]))[::-1]
    moments: list[Vector] = []
    links = list(enumerate(zip(robot.chain.joints, chain.joints, own, strict=True), start=1))
    for k, (joint, frames, weight) in reversed(links):
        further = [(ONE, moments[-1])] if moments else []
        if weight > 0.0:
            centre = program.constant_vector(f"centre{k}", joint.centre_of_mass)
            R, origin = frames.distal.rotation, frames.distal.origin
            at = program.transformed(f"mass{k}", R, centre, origin)
            further = [(program.quantity(f"link{k}", weight), at), *further]
        moments.append(program.weighted_sum(f"first{k}", further))
    return Weights(
        program,
        tuple(
            program.quantity(f"weight{k}", weight) if weight > 0.0 else ZERO
            for k, weight in enumerate(behind, start=1)
        ),
        tuple(moments[::-1]),
        program.constant_vector("down", gravity / size) if size > 0.0 else NOTHING,
    )
