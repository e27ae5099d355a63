"""The forward chain of a robot as statements: where each joint frame is, at given joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel.program import ONE, ZERO, Matrix, Program, Value, Vector
from elastocal.robot import ChainJoint, SerialChain

NOTHING: Vector = (ZERO, ZERO, ZERO)
IDENTITY: Matrix = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
FORCE: Vector = (Value(1, "fx"), Value(1, "fy"), Value(1, "fz"))
"""Force on the robot at the tool centre point, in base."""
MOMENT: Vector = (Value(1, "mx"), Value(1, "my"), Value(1, "mz"))
"""Moment on the robot about the tool centre point, in base."""


@dataclass(frozen=True)
class Frame:
    """A frame in base."""

    rotation: Matrix
    origin: Vector


@dataclass(frozen=True)
class JointFrames:
    """A joint's frame before and behind its motion."""

    proximal: Frame
    distal: Frame


@dataclass(frozen=True)
class Chain:
    """Every frame of the chain."""

    joints: tuple[JointFrames, ...]
    tcp: Frame


def write_chain(program: Program, chain: SerialChain) -> Chain:
    """Add the statements of the forward chain (paper Eq. 1-3) and return its frames.

    Joint ``k`` counts from 1. Its names are ``p<k>`` (rotation before the motion), ``r<k>``
    (behind it), ``o<k>`` (origin before), ``d<k>`` (origin behind a linear motion).
    """
    here = Frame(IDENTITY, NOTHING)
    joints = []
    for k, joint in enumerate(chain.joints, start=1):
        program.remark(f"joint {k}, {joint.name}")
        place = _constant_frame(program, f"place{k}", joint.placement)
        proximal = _behind(program, here, place, (f"p{k}", f"o{k}"))
        distal = _moved(program, proximal, joint, k)
        joints.append(JointFrames(proximal, distal))
        here = distal
    program.remark(f"tool centre point, {chain.tip}")
    tip = _constant_frame(program, "tip", chain.T_last_tip)
    return Chain(tuple(joints), _behind(program, here, tip, ("t", "tcp")))


def _constant_frame(program: Program, name: str, T: FloatArray) -> Frame:
    x, y, z = (
        constant_vector(program, f"{name}_{a}", row)
        for a, row in zip("xyz", T[:3, :3], strict=True)
    )
    return Frame((x, y, z), constant_vector(program, name, T[:3, 3]))


def _behind(program: Program, here: Frame, place: Frame, names: tuple[str, str]) -> Frame:
    """Return ``here @ place``."""
    rotation, origin = names
    return Frame(
        program.product(rotation, here.rotation, place.rotation),
        program.transformed(origin, here.rotation, place.origin, here.origin),
    )


def _moved(program: Program, proximal: Frame, joint: ChainJoint, k: int) -> Frame:
    """Return the frame behind the joint's motion."""
    axis = constant_vector(program, f"axis{k}", joint.axis)
    if joint.revolute:
        sine, cosine = program.turn(k, f"q{k}")
        turn = _rotation(program, f"turn{k}", axis, sine, cosine)
        return Frame(program.product(f"r{k}", proximal.rotation, turn), proximal.origin)
    travel = Value(1, f"q{k}")
    slid = [program.total(f"slide{k}_{a}", [(x, travel)]) for a, x in zip("xyz", axis, strict=True)]
    along = (slid[0], slid[1], slid[2])
    origin = program.transformed(f"d{k}", proximal.rotation, along, proximal.origin)
    return Frame(proximal.rotation, origin)


def constant_vector(program: Program, name: str, numbers: ArrayLike) -> Vector:
    """Return three constants."""
    x, y, z = np.asarray(numbers, dtype=float).tolist()
    return (
        program.constant(f"{name}_x", x),
        program.constant(f"{name}_y", y),
        program.constant(f"{name}_z", z),
    )


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
