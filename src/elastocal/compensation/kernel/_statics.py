"""Deflection and observation block at a load as statements: chain, weight, springs together.

The laws of the springs as statements: from torques about their axes to angles.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, count

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel.program import (
    ONE,
    ZERO,
    Matrix,
    Product,
    Program,
    Routine,
    Value,
    Vector,
)
from elastocal.elastic import ElasticModel, SpringAxis, SpringLoad
from elastocal.elastic.springs import (
    Expression,
    Function,
    Input,
    Number,
    Product as ProductOf,
    Sum,
)
from elastocal.errors import SpringError
from elastocal.identification import EncoderZero
from elastocal.robot import ChainJoint, Robot, SerialChain

Angles = list[tuple[int, Value]]
"""Angles by the number of a parameter, each for one unit of it."""


@dataclass(frozen=True)
class LoadedAxis:
    """An axis of a spring at given joints, with its load."""

    number: int
    """Counts the axes of all springs."""
    revolute: bool
    direction: Vector
    torque: Value
    """Torque of the load about the axis, or force along it."""
    weight: Value
    """Torque of the arm's own weight, shape as above; zero where no law needs it."""


class Memory:
    """State of the friction elements from one call to the next, as numbers.

    For each element ``u``, the torque that it bears less the whole torque; then, for each axis
    with friction, the lowest and the highest torque since the arm was free, and the torque of the
    load at the last call.
    """

    def __init__(self, model: ElasticModel) -> None:
        self.elements = model.friction.limit.tolist()
        self.axes: list[int] = list(dict.fromkeys(model.friction.axis.tolist()))
        axes = range(1, len(self.axes) + 1)
        self.names = (
            *(f"u{element + 1}" for element in range(len(self.elements))),
            *(f"low{axis}" for axis in axes),
            *(f"high{axis}" for axis in axes),
            *(f"load{axis}" for axis in axes),
        )

    def values(
        self, states: Sequence[Value], ranges: dict[int, tuple[Value, Value, Value]]
    ) -> list[Value]:
        """Return numbers in the order of the memory, those of axes by the axis' number."""
        return [*states, *(ranges[axis][k] for k in range(3) for axis in self.axes)]


class Laws:
    """The laws of a model's springs, with the loads that they were given."""

    def __init__(
        self, program: Program, model: ElasticModel, sagging: Collection[int] = ()
    ) -> None:
        """Take the springs of a model; ``sagging`` are axes whose weight is asked for, too."""
        self.memory = Memory(model)
        self._sagging = frozenset(sagging)
        self._program = program
        self._heavy = model.robot.has_masses
        self._springs = model.springs
        self._spring_of = [s for s, each in enumerate(model.springs) for _ in each.axes]
        self._axes = _numbered([len(spring.axes) for spring in model.springs])
        self._parameters = _numbered([len(spring.parameters) for spring in model.springs])
        self._elements = _numbered([len(spring.friction_limits) for spring in model.springs])
        self._names = [_names(s + 1) for s in range(len(self._axes))]
        self._written: list[dict[Expression, Value]] = [{} for _ in self._axes]
        self._loads: dict[int, LoadedAxis] = {}
        self._states: dict[int, Value] = {}
        self._ranges: dict[int, tuple[Value, Value, Value]] = {}

    def weighs(self, axis: int) -> bool:
        """Return whether a law asks for the torque of the arm's own weight about an axis."""
        spring = self._springs[self._spring_of[axis]]
        asks = spring.bears_weight or bool(spring.friction_limits) or axis in self._sagging
        return self._heavy and asks

    def angles(self, axis: LoadedAxis) -> Iterator[tuple[int, Angles]]:
        """Yield, once all torques of a spring are known, the angles of each of its axes.

        Each axis by its number, with the angle that one unit of each parameter makes, by the
        number of the parameter.
        """
        self._loads[axis.number] = axis
        s = self._spring_of[axis.number]
        if not self._loads.keys() >= set(self._axes[s]):
            return
        friction = {f"f{e + 1}": state for e, state in self._slid(s).items()}
        rows = self._rows(s, friction)
        for number, row in zip(self._axes[s], rows, strict=True):
            yield number, list(zip(self._parameters[s], row, strict=True))

    def unknown_angles(self, number: int) -> Angles:
        """Return the possible rotation of an axis by earlier friction, beyond `angles`.

        An element slides at ``+-r``; its torque when the arm was free may be anything within, and 0
        is assumed. Torques that span ``R`` bring all histories to within ``2 r - R`` of one
        another, and never farther apart than they began: ``min(r, 2 r - R)``, none beyond ``R = 2
        r``.
        """
        s = self._spring_of[number]
        if not self._elements[s]:
            return []
        program, spring = self._program, self._springs[s]
        low, high, _ = self._ranges[self._axes[s][0]]
        half = program.quantity("half", 0.5)
        widths = {
            f"unknown{e + 1}": program.total(
                f"half_width{e + 1}", [(half, self._width(e, low, high))]
            )
            for e in self._elements[s]
        }
        # A law that stiffens with the size of its torque yields most about zero: what friction
        # turns there, half its width to either side, no load makes larger.
        still = tuple(Number(0.0) for _ in self._axes[s])
        weight = still if self._heavy and spring.bears_weight else ()
        load = SpringLoad[Expression](still, weight, tuple(map(Input, widths)))
        row = spring.angles(load)[self._axes[s].index(number)]
        known: dict[Expression, Value] = {}
        sides = [
            (p, written(program, angle, widths, self._names[s], known))
            for p, angle in zip(self._parameters[s], row, strict=True)
            if reads(angle)
        ]
        return [(p, program.total(f"open{p + 1}", [(side,), (side,)])) for p, side in sides]

    def remembered(self) -> list[Value]:
        """Return the memory after the loads."""
        states = [self._states[e] for e in range(len(self.memory.elements))]
        return self.memory.values(states, self._ranges)

    def _rows(self, s: int, friction: dict[str, Value]) -> list[list[Value]]:
        """Return the angles of a spring by axis and parameter, for torques that friction bears."""
        spring, loads = self._springs[s], [self._loads[number] for number in self._axes[s]]
        torque = {f"t{k}": load.torque for k, load in enumerate(loads)}
        weight = {}
        if self._heavy and spring.bears_weight:
            weight = {f"w{k}": load.weight for k, load in enumerate(loads)}
        load = SpringLoad[Expression](
            *(tuple(Input(name) for name in part) for part in (torque, weight, friction))
        )
        inputs = torque | weight | friction
        names, known = self._names[s], self._written[s]
        return [
            [written(self._program, angle, inputs, names, known) for angle in row]
            for row in spring.angles(load)
        ]

    def _slid(self, s: int) -> dict[int, Value]:
        """Write what each friction element of a spring bears, and what it remembers of it."""
        if not self._elements[s]:
            return {}
        program, first = self._program, self._loads[self._axes[s][0]]
        a = self.memory.axes.index(first.number) + 1
        torque = program.total(f"total{a}", [(first.torque,), (first.weight,)])
        friction_torque = {}
        for e in self._elements[s]:
            pulled = program.total(f"pulled{e + 1}", [(torque,), (Value(1, f"u{e + 1}"),)])
            friction_torque[e] = program.clipped(f"borne{e + 1}", pulled, self._limit(e))
            self._states[e] = program.total(f"kept{e + 1}", [(friction_torque[e],), (-torque,)])
        low = program.call(f"lowest{a}", "min", Value(1, f"low{a}"), torque)
        high = program.call(f"highest{a}", "max", Value(1, f"high{a}"), torque)
        self._ranges[first.number] = low, high, first.torque
        return friction_torque

    def _width(self, e: int, low: Value, high: Value) -> Value:
        """Write ``(r + |2 r - R| - |r - R|) / 2``: ``r`` up to ``R = r``, then less, then 0."""
        program, limit, name = self._program, self._limit(e), f"width{e + 1}"
        left = program.total(f"{name}_left", [(limit,), (-high,), (low,)])
        twice = program.total(f"{name}_twice", [(limit,), (left,)])
        sizes = program.call(f"{name}_a", "fabs", twice), program.call(f"{name}_b", "fabs", left)
        half = program.quantity("half", 0.5)
        return program.total(name, [(half, limit), (half, sizes[0]), (-half, sizes[1])])

    def _limit(self, e: int) -> Value:
        return self._program.quantity(f"slip{e + 1}", self.memory.elements[e])


def written(
    program: Program,
    x: Expression,
    inputs: dict[str, Value],
    names: Iterator[str],
    known: dict[Expression, Value] | None = None,
) -> Value:
    """Write the statements of a formula and return its value.

    Parameters
    ----------
    program : Program
        Gets the statements.
    x : Expression
        The formula.
    inputs : dict of str to Value
        By the names in the formula.
    names : iterator of str
        Names for what is between.
    known : dict, optional
        Values of what is written already, added to: a part that occurs twice is written once.
    """
    known = {} if known is None else known
    if x not in known:
        known[x] = _statement(program, x, inputs, names, known)
    return known[x]


def reads(x: Expression) -> bool:
    """Return whether a formula has an input."""
    match x:
        case Sum(parts) | ProductOf(parts) | Function(_, parts):
            return any(map(reads, parts))
    return isinstance(x, Input)


def _statement(
    program: Program,
    x: Expression,
    inputs: dict[str, Value],
    names: Iterator[str],
    known: dict[Expression, Value],
) -> Value:
    def value(part: Expression) -> Value:
        return written(program, part, inputs, names, known)

    match x:
        case Input(name):
            return inputs[name]
        case Number(number):
            # Unlike lengths of a URDF, numbers of a law may be tiny and still count.
            plain = number in (0.0, 1.0, -1.0)
            return Value(int(number)) if plain else program.quantity(next(names), number)
        case ProductOf(factors):
            return program.total(next(names), [tuple(map(value, factors))])
        case Sum(terms):
            return program.total(next(names), [(value(term),) for term in terms])
        case Function(name, arguments):
            return program.call(next(names), name, *map(value, arguments))
    raise TypeError(f"no formula: {x!r}")


def _names(spring: int) -> Iterator[str]:
    return (f"x{spring}_{k}" for k in count(1))


def _numbered(lengths: Sequence[int]) -> list[range]:
    """Return the numbers of each one's parts, counted through."""
    ends = [sum(lengths[: k + 1]) for k in range(len(lengths))]
    return [range(end - length, end) for end, length in zip(ends, lengths, strict=True)]


NOTHING: Vector = (ZERO, ZERO, ZERO)
IDENTITY: Matrix = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
_FORCE: Vector = (Value(1, "fx"), Value(1, "fy"), Value(1, "fz"))
"""Force on the robot at the tool centre point, in base."""
_MOMENT: Vector = (Value(1, "mx"), Value(1, "my"), Value(1, "mz"))
"""Moment on the robot about the tool centre point, in base."""
_Point = tuple[int, bool, tuple[float, float, float]]
"""Joint, whether behind its motion, offset: where the axis of a spring passes."""
_Weighted = tuple[Value, Vector]


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
    here = Frame(IDENTITY, NOTHING)
    joints = []
    for k, joint in enumerate(chain.joints, start=1):
        program.remark(f"joint {k}, {joint.name}")
        place = constant_frame(program, f"place{k}", joint.placement)
        proximal = behind(program, here, place, (f"p{k}", f"o{k}"))
        distal = turned(program, proximal, joint, str(k), Value(1, f"q{k}"))
        joints.append(_JointFrames(proximal, distal))
        here = distal
    program.remark(f"tool centre point, {chain.tip}")
    tip = constant_frame(program, "tip", chain.T_last_tip)
    return ChainFrames(tuple(joints), behind(program, here, tip, ("t", "tcp")))


def constant_frame(program: Program, name: str, T: FloatArray) -> Frame:
    x, y, z = (
        program.constant_vector(f"{name}_{a}", row) for a, row in zip("xyz", T[:3, :3], strict=True)
    )
    return Frame((x, y, z), program.constant_vector(name, T[:3, 3]))


def behind(program: Program, here: Frame, place: Frame, names: tuple[str, str]) -> Frame:
    """Return ``here @ place``."""
    rotation, origin = names
    return Frame(
        program.product(rotation, here.rotation, place.rotation),
        program.transformed(origin, here.rotation, place.origin, here.origin),
    )


def turned(program: Program, proximal: Frame, joint: ChainJoint, label: str, angle: Value) -> Frame:
    """Return the frame behind a joint's motion, whose names end in a label.

    Parameters
    ----------
    program : Program
        Gets the statements.
    proximal : Frame
        The frame before the motion.
    joint : ChainJoint
        The joint.
    label : str
        A number, perhaps with letters before it.
    angle : Value
        Angle or way of the joint.
    """
    axis = program.constant_vector(f"axis{label}", joint.axis)
    if joint.revolute:
        sine, cosine = program.turn(label, angle.name)
        turn = _rotation(program, f"turn{label}", axis, sine, cosine)
        return Frame(program.product(f"r{label}", proximal.rotation, turn), proximal.origin)
    slid = [
        program.total(f"slide{label}_{a}", [(x, angle)]) for a, x in zip("xyz", axis, strict=True)
    ]
    along = (slid[0], slid[1], slid[2])
    origin = program.transformed(f"d{label}", proximal.rotation, along, proximal.origin)
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


def orientation(model: ElasticModel) -> Routine:
    """Return the program of the rotation of the tool centre point in base, row by row."""
    program = Program()
    tcp = write_chain(program, model.robot.chain).tcp
    return routine(program, [value for row in tcp.rotation for value in row])


def growth(robot: Robot, share: float, offset: Sequence[float]) -> Routine:
    """Return the program of how far an arm has grown, ``s (p_tcp - p_foot) + o``, in base, in m."""
    program = Program()
    chain = write_chain(program, robot.chain)
    foot = chain.joints[robot.external_axes].proximal.origin
    s = program.quantity("growth_share", share)
    rest = program.constant_vector("growth_offset", np.asarray(offset, dtype=float))
    terms = [(s, chain.tcp.origin), (-s, foot), (ONE, rest)]
    return routine(program, program.weighted_sum("growth", terms))


def deflection(model: ElasticModel, compliance: Sequence[float]) -> Routine:
    """Return the program of the deflection at joints ``q`` under a force and a moment.

    With the springs at one point of the chain taken together, the lever ``l`` from there to the
    tool centre point and the moment ``n = m + l x f`` that the load has there,

        deflection = sum over points of (theta x l + u),
        theta = sum of w_i a_i  over the revolute axes of the point,
        u     = sum of w_i a_i  over its prismatic axes,

    where the spring makes ``w_i`` of the torques ``a_i . n`` about, or forces ``a_i . f`` along,
    its axes: ``c_i`` times them for a hinge. That is ``sum c_i tau_i J_i`` (paper Eq. 10, 14)
    with ``J_i = a_i x l`` or ``a_i`` and ``tau_i = J_i . f + W_i . m``.

    With friction the outputs go on with what it remembers after the load (`rest` says how it
    begins).
    """
    program = Program()
    laws = Laws(program, model)
    total = NOTHING
    # A spring between two places of the chain moves neither before both its torques are known.
    waiting: list[_Place] = []
    moved: dict[int, Value] = {}
    for place in _places(program, model, laws):
        for axis in place.loaded():
            for number, angles in laws.angles(axis):
                terms = [
                    (program.quantity(f"compliance{p + 1}", float(compliance[p])), angle)
                    for p, angle in angles
                ]
                moved[number] = program.total(f"w{number + 1}", terms)
        waiting.append(place)
        for ready in [each for each in waiting if moved.keys() >= set(each.numbers)]:
            waiting.remove(ready)
            total = _displaced(program, total, ready, moved)
    return routine(program, [*total, *laws.remembered()], laws.memory.names)


def observation_block(model: ElasticModel, compliance: Sequence[float] = ()) -> Routine:
    """Return the program of the block ``O`` with ``O c = deflection`` (paper Eq. 11, 14).

    The outputs are the x components of all parameters, then the y, then the z components. With
    friction, and with compliances, three follow: how far friction from before the memory began
    may move x, y and z of the deflection, ``sum |J_i| f_j min(r_j, 2 r_j - R)`` over the elements
    until torques have spanned ``R = 2 r_j``; then the memory after the load, as of `deflection`.
    """
    program = Program()
    laws = Laws(program, model)
    jacobian: dict[int, Vector] = {}
    terms: dict[int, list[_Weighted]] = {p: [] for p in range(len(model.parameters))}
    columns: dict[int, Vector] = {}
    for place in _places(program, model, laws):
        for axis in place.loaded():
            jacobian[axis.number] = (
                program.cross(f"j{axis.number + 1}", axis.direction, place.lever)
                if axis.revolute
                else axis.direction
            )
            complete = list(laws.angles(axis))
            for number, angles in complete:
                for p, angle in angles:
                    terms[p].append((angle, jacobian[number]))
            for p in dict.fromkeys(p for _, angles in complete for p, _ in angles):
                columns[p] = program.weighted_sum(f"b{p + 1}", terms[p])
    outputs = [columns[p][row] for row in range(3) for p in range(len(model.parameters))]
    if len(model.friction) and len(compliance):
        outputs += [*_unknown(program, laws, jacobian, compliance), *laws.remembered()]
    return routine(program, outputs, laws.memory.names)


def joint_deflections(
    model: ElasticModel, compliance: Sequence[float], zeros: Sequence[EncoderZero]
) -> Routine:
    """Return the program of what secondary encoders see, and of the Jacobian of their joints.

    The outputs are how far each link is from its motor, under the load and by what its encoder
    reads in the air; then the displacement of the tool centre point for a unit of each, x, y, z.

    Raises
    ------
    SpringError
        If a joint has no spring about its own axis: the model does not know what it yields.
    """
    axes = [axis for spring in model.springs for axis in spring.axes]
    links = {each.name: each for each in model.robot.chain.joints}
    own = {n: axis.joint for n, axis in enumerate(axes) if axis.is_axis_of(links[axis.joint])}
    for zero in zeros:
        if zero.joint not in own.values():
            raise SpringError(f"joint {zero.joint!r} has no spring about its own axis")
    joints = [zero.joint for zero in zeros]
    asked = {number: joint for number, joint in own.items() if joint in joints}
    program = Program()
    laws = Laws(program, model, asked)
    terms: dict[str, list[Product]] = {zero.joint: [] for zero in zeros}
    jacobian: dict[str, Vector] = {}
    weight: dict[str, Value] = {}
    for place in _places(program, model, laws):
        for axis in place.loaded():
            joint = asked.get(axis.number)
            if joint is not None and joint not in jacobian:
                weight[joint] = axis.weight
                turned = program.cross(f"j{axis.number + 1}", axis.direction, place.lever)
                jacobian[joint] = turned if axis.revolute else axis.direction
            for number, angles in laws.angles(axis):
                if number in asked:
                    terms[asked[number]] += [
                        (program.quantity(f"compliance{p + 1}", float(compliance[p])), angle)
                        for p, angle in angles
                    ]
    yielded = []
    for k, zero in enumerate(zeros, start=1):
        label = str(model.robot.joint_names.index(zero.joint) + 1)
        numbers = {"at": zero.offset, "sag": zero.weight, "sin": zero.sine, "cos": zero.cosine}
        at, sag, *waves = (
            program.quantity(f"zero{k}_{name}", number) for name, number in numbers.items()
        )
        pairs = zip(waves, (Value(1, f"s{label}"), Value(1, f"c{label}")), strict=True)
        turning = [*pairs] if links[zero.joint].revolute else []
        in_air = [(at,), (sag, weight[zero.joint]), *turning]
        yielded.append(program.total(f"yield{k}", [*in_air, *terms[zero.joint]]))
    moved = [value for joint in joints for value in jacobian[joint]]
    return routine(program, [*yielded, *moved], laws.memory.names)


def rest(model: ElasticModel) -> Routine:
    """Return the program of what friction remembers of a free motion to joints ``q``.

    No element bears anything while only the arm's own weight acts.
    """
    if not len(model.friction):
        return Routine((), (), {})
    program = Program()
    laws = Laws(program, model)
    weights: dict[int, Value] = {}
    for place in _places(program, model, laws):
        weights |= {axis.number: axis.weight for axis in place.loaded()}
    free = [-weights[axis] for axis in model.friction.axis.tolist()]
    ranges = {axis: (weights[axis], weights[axis], ZERO) for axis in laws.memory.axes}
    return routine(program, laws.memory.values(free, ranges))


def _unknown(
    program: Program, laws: Laws, jacobian: dict[int, Vector], compliance: Sequence[float]
) -> Vector:
    """Return the largest possible effect of earlier friction on each component."""
    bounds: list[list[Value]] = [[], [], []]
    for number, J in jacobian.items():
        terms = [
            (program.quantity(f"compliance{p + 1}", float(compliance[p])), angle)
            for p, angle in laws.unknown_angles(number)
        ]
        turn = program.total(f"unknown{number + 1}", terms)
        for bound, axis, component in zip(bounds, "xyz", J, strict=True):
            moved = program.total(f"unknown{number + 1}_{axis}", [(component, turn)])
            if moved != ZERO:
                bound.append(program.call(f"bound{number + 1}_{axis}", "fabs", moved))
    x, y, z = (
        program.total(f"bound_{axis}", [(each,) for each in bound])
        for axis, bound in zip("xyz", bounds, strict=True)
    )
    return x, y, z


@dataclass(frozen=True)
class _Place:
    """A point of the chain where axes of springs pass."""

    program: Program
    label: str
    """Suffix that distinguishes the names of its statements from those of other points: 2, 2_2,
    2_3."""
    lever: Vector
    """Lever arm from it to the tool centre point."""
    moment: Vector
    """Moment of the load about the point."""
    weight: tuple[Vector, Vector]
    """Force and moment about it of the arm's own weight; zero where no law asks for them."""
    axes: dict[int, tuple[SpringAxis, Frame]]
    """Axes by number, with the frame in which each is fixed."""
    directions: dict[int, Vector] = field(default_factory=dict)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of its axes."""
        return tuple(self.axes)

    def loaded(self) -> Iterator[LoadedAxis]:
        """Write and yield one axis after the other."""
        program = self.program
        for number, (axis, frame) in self.axes.items():
            fixed = program.constant_vector(f"spring{number + 1}", axis.axis)
            a = program.transformed(f"a{number + 1}", frame.rotation, fixed, NOTHING)
            self.directions[number] = a
            torque = program.dot(f"tau{number + 1}", a, self.moment if axis.revolute else _FORCE)
            weight = program.dot(f"own{number + 1}", a, self.weight[axis.revolute])
            yield LoadedAxis(number, axis.revolute, a, torque, weight)


def _displaced(program: Program, start: Vector, place: _Place, moved: dict[int, Value]) -> Vector:
    """Return ``start`` with what the axes of a place displace the tool centre point by."""
    turns = {number: axis.revolute for number, (axis, _) in place.axes.items()}
    turned = [(moved[n], a) for n, a in place.directions.items() if turns[n]]
    shifted = [(moved[n], a) for n, a in place.directions.items() if not turns[n]]
    theta = program.weighted_sum(f"theta{place.label}", turned)
    shift = program.weighted_sum(f"shift{place.label}", shifted)
    base = program.weighted_sum(f"base{place.label}", [(ONE, start), (ONE, shift)])
    return program.cross(f"sum{place.label}", theta, place.lever, base)


def _places(program: Program, model: ElasticModel, laws: Laws) -> Iterator[_Place]:
    """Write the chain and yield where springs sit, from base to tip."""
    chain = write_chain(program, model.robot.chain)
    axes = [axis for spring in model.springs for axis in spring.axes]
    heavy = any(map(laws.weighs, range(len(axes))))
    weights = write_weights(program, model.robot, chain) if heavy else None
    before: dict[int, int] = {}
    for (joint, behind, offset), numbers in _points(model, axes):
        before[joint] = before.get(joint, 0) + 1
        label = f"{joint + 1}" + (f"_{before[joint]}" if before[joint] > 1 else "")
        program.remark(f"springs {', '.join(axes[i].name for i in numbers)}")
        frame = _frame(chain, joint, behind)
        shift = program.constant_vector(f"offset{label}", offset)
        at = program.transformed(f"at{label}", frame.rotation, shift, frame.origin)
        lever = program.weighted_sum(f"lever{label}", [(ONE, chain.tcp.origin), (-ONE, at)])
        moment = program.cross(f"moment{label}", lever, _FORCE, _MOMENT)
        weight = NOTHING, NOTHING
        if weights and any(map(laws.weighs, numbers)):
            weight = weights.force(label, joint), weights.moment(label, joint, at)
        here = {i: (axes[i], _frame(chain, joint, axes[i].distal)) for i in numbers}
        yield _Place(program, label, lever, moment, weight, here)


def _points(model: ElasticModel, axes: Sequence[SpringAxis]) -> list[tuple[_Point, list[int]]]:
    """Return the points of the axes, from base to tip, with the axes through each.

    A revolute spring about its joint's own axis is the same before and behind the motion.
    """
    names = model.robot.joint_names
    groups: dict[_Point, list[int]] = {}
    for i, axis in enumerate(axes):
        joint = names.index(axis.joint)
        own = tuple(model.robot.chain.joints[joint].axis.tolist()) == axis.axis
        behind = axis.distal and not (own and axis.revolute and not any(axis.offset))
        groups.setdefault((joint, behind, axis.offset), []).append(i)
    return sorted(groups.items(), key=lambda item: (item[0][:2], item[1]))


def _frame(chain: ChainFrames, joint: int, behind: bool) -> Frame:
    return chain.joints[joint].distal if behind else chain.joints[joint].proximal


def routine(program: Program, outputs: Iterable[Value], memory: tuple[str, ...] = ()) -> Routine:
    every = tuple(outputs)
    return Routine(tuple(program.statements), every, program.constants, memory).leading(len(every))
