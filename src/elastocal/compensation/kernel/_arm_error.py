"""Error of the unloaded tool of an arm whose geometry was calibrated, as statements.

The chain is that of the drawing with each joint's place corrected and its bearing bent, and turns
by

    q' = q + o + s q + sum_k (a_k sin kq + b_k cos kq) + c tau

(`elastocal.geometry.arm`). The series takes no sine of its own: by Horner's rule in the complex
number ``cos q + i sin q``, of which the chain of the drawing has both parts.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel._statics import (
    IDENTITY,
    NOTHING,
    ChainFrames,
    Frame,
    behind,
    constant_frame,
    routine,
    turned,
    write_chain,
    write_weights,
)
from elastocal.compensation.kernel.program import ONE, ZERO, Program, Routine, Value, Vector
from elastocal.results import brief_repr
from elastocal.robot import ChainJoint, Robot

_PREFIX = "arm_"
"""Begins the names of its constants: the springs may have been fitted on another arm."""


@brief_repr
@dataclass(frozen=True, eq=False)
class BuiltArm:
    """An arm as it was built, with its tool."""

    drawn: Robot
    """As drawn, with the tcp of its geometry."""
    place: FloatArray
    """Errors of the joints' places, shape (joint, 6), in m and rad."""
    motion: FloatArray
    """Errors of their motion, shape (joint, 3 + 2 orders): offset, scale, sine and cosine of each
    order, compliance."""
    bend: FloatArray
    """Compliances of their bearings about x, y and z of their frames, shape (joint, 3)."""
    sag: FloatArray | None
    """Compliances to the own weight, shape (joint,), which joints otherwise yield to as to
    payloads."""
    T_tcp_drawn: FloatArray
    """The tool in that tcp as its controller knows it, shape (4, 4), in m."""
    T_tcp_built: FloatArray
    """The tool where it really is, shape (4, 4), in m."""
    payload: float = 0.0
    """Mass of the tool beyond what the drawing has, in kg."""
    payload_centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Its centre in that tcp, in m."""


def arm_error(arm: BuiltArm) -> Routine:
    """Return the program of where the unloaded tool is less where its controller has it.

    In base, in m, under weight and payload.
    """
    program = Program()
    drawn = write_chain(program, arm.drawn.chain)
    loads = _Loads(program, arm, drawn)
    here = Frame(IDENTITY, NOTHING)
    for k, joint in enumerate(arm.drawn.chain.joints, start=1):
        program.remark(f"joint {k} as built")
        error = np.eye(4)
        error[:3, :3] = Rotation.from_rotvec(arm.place[k - 1, 3:]).as_matrix()
        error[:3, 3] = arm.place[k - 1, :3]
        place = constant_frame(program, f"built{k}", joint.placement @ error)
        proximal = behind(program, here, place, (f"pb{k}", f"ob{k}"))
        proximal = _bent(program, k, proximal, joint, arm.bend[k - 1], loads)
        moved = _moved(program, k, arm, loads, turns=joint.revolute)
        here = turned(program, proximal, joint, f"b{k}", moved)
    program.remark("tool")
    T_last_tip = arm.drawn.chain.T_last_tip
    real = behind(
        program, here, constant_frame(program, "tool", T_last_tip @ arm.T_tcp_built), ("tb", "tcpb")
    )
    way = program.constant_vector("drawn_tool", arm.T_tcp_drawn[:3, 3])
    known = program.transformed("known", drawn.tcp.rotation, way, drawn.tcp.origin)
    off = program.weighted_sum("off", [(ONE, real.origin), (-ONE, known)])
    return routine(program, off).prefixed(_PREFIX)


class _Loads:
    """Statements of what weight and payload ask of each joint, counted from 0."""

    def __init__(self, program: Program, arm: BuiltArm, drawn: ChainFrames) -> None:
        self._program, self._drawn, robot = program, drawn, arm.drawn
        self._joints = robot.chain.joints
        asked = (arm.motion[:, -1], arm.bend, () if arm.sag is None else arm.sag)
        heavy = robot.has_masses and any(np.any(each) for each in asked)
        self._weights = write_weights(program, robot, drawn) if heavy else None
        self._pull = program.constant_vector("payload", arm.payload * np.asarray(robot.gravity))
        centre = program.constant_vector("payload_centre", arm.payload_centre)
        self._at = program.transformed("hung", drawn.tcp.rotation, centre, drawn.tcp.origin)
        self._moments: dict[str, Vector] = {}

    def torque(self, k: int, *, payload: bool, weight: bool) -> Value:
        """Write the torque of payload, of the arm's weight, or of both along a joint's axis."""
        joint, program = self._joints[k], self._program
        along = program.constant_vector(f"along{k + 1}", joint.axis)
        rotation = self._drawn.joints[k].proximal.rotation
        axis = program.transformed(f"axis_y{k + 1}", rotation, along, NOTHING)
        label = f"y{k + 1}{'p' * payload}{'w' * weight}"
        if joint.revolute:
            load = self._moment(k, label, payload=payload, weight=weight)
        else:
            parts = [(ONE, self._pull)] if payload else []
            if weight and self._weights is not None:
                parts.append((ONE, self._weights.force(label, k)))
            load = program.weighted_sum(f"force_{label}", parts)
        return program.dot(f"torque_{label}", axis, load)

    def about(self, k: int) -> Vector:
        """Write the moments of both about the axes of a joint's frame."""
        whole = self._moment(k, f"y{k + 1}pw", payload=True, weight=True)
        rotation = self._drawn.joints[k].proximal.rotation
        x, y, z = (
            self._program.dot(f"about{k + 1}_{name}", (a, b, c), whole)
            for name, a, b, c in zip("xyz", *rotation, strict=True)
        )
        return x, y, z

    def _moment(self, k: int, label: str, *, payload: bool, weight: bool) -> Vector:
        """Write a moment about a joint's origin, once for its torque and its bearing."""
        if label in self._moments:
            return self._moments[label]
        program, origin = self._program, self._drawn.joints[k].proximal.origin
        parts: list[tuple[Value, Vector]] = []
        if payload:
            lever = program.weighted_sum(f"to_{label}", [(ONE, self._at), (-ONE, origin)])
            parts.append((ONE, program.cross(f"of_{label}", lever, self._pull)))
        if weight and self._weights is not None:
            parts.append((ONE, self._weights.moment(label, k, origin)))
        self._moments[label] = program.weighted_sum(f"moment_{label}", parts)
        return self._moments[label]


def _moved(program: Program, k: int, arm: BuiltArm, loads: _Loads, *, turns: bool) -> Value:
    """Write how far a joint really moves when its controller says ``q``."""
    motion, sag = arm.motion[k - 1], 0.0 if arm.sag is None else float(arm.sag[k - 1])
    q, (offset, scale), compliance = Value(1, f"q{k}"), motion[:2].tolist(), float(motion[-1])
    terms: list[tuple[Value, ...]] = [(q,)]
    if offset:
        terms.append((program.quantity(f"zero{k}", offset),))
    if scale:
        terms.append((program.quantity(f"scale{k}", scale), q))
    if turns:
        terms.append((_series(program, k, motion[2:-1].reshape(-1, 2)),))
    if compliance:
        torque = loads.torque(k - 1, payload=True, weight=arm.sag is None)
        terms.append((program.quantity(f"yield{k}", compliance), torque))
    if sag:
        own = loads.torque(k - 1, payload=False, weight=True)
        terms.append((program.quantity(f"sag{k}", sag), own))
    return program.total(f"moved{k}", terms)


def _series(program: Program, k: int, terms: FloatArray) -> Value:
    """Write the sum of sines and cosines of a joint's angle, the highest order first."""
    sine, cosine, x, y = Value(1, f"s{k}"), Value(1, f"c{k}"), ZERO, ZERO
    there = np.flatnonzero(terms.any(axis=1))
    for n in range(int(there[-1]) + 1 if len(there) else 0, 0, -1):
        a, b = (
            program.quantity(f"{name}{k}_{n}", float(number)) if number else ZERO
            for name, number in zip(("sine", "cosine"), terms[n - 1], strict=True)
        )
        u = program.total(f"u{k}_{n}", [(x,), (b,)])
        v = program.total(f"v{k}_{n}", [(y,), (-a,)])
        x = program.total(f"x{k}_{n}", [(u, cosine), (-v, sine)])
        y = program.total(f"y{k}_{n}", [(u, sine), (v, cosine)])
    return x


def _bent(
    program: Program, k: int, proximal: Frame, joint: ChainJoint, bend: FloatArray, loads: _Loads
) -> Frame:
    """Write the frame of a joint behind the turns of its bearing, one axis after the other."""
    if not bend.any():
        return proximal
    about = loads.about(k - 1)
    for axis, name in enumerate("xyz"):
        # Weight has no moment about an upright axis.
        if bend[axis] and about[axis] != ZERO:
            compliance = program.quantity(f"bend{k}_{name}", float(bend[axis]))
            angle = program.total(f"bent{k}_{name}", [(compliance, about[axis])])
            hinge = replace(joint, revolute=True, axis=np.eye(3)[axis])
            proximal = turned(program, proximal, hinge, f"h{k}_{name}", angle)
    return proximal
