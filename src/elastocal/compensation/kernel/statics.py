"""Chain and springs as statements: joint frames, deflection and observation block at a load."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel.program import (
    ONE,
    ZERO,
    Matrix,
    Program,
    Routine,
    Value,
    Vector,
    needed,
    used_names,
)
from elastocal.elastic import ElasticModel, SpringAxis, SpringLoad
from elastocal.elastic.springs import Expression, Function, Input, Number, Product, Sum
from elastocal.robot import ChainJoint, SerialChain

_NOTHING: Vector = (ZERO, ZERO, ZERO)
_IDENTITY: Matrix = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
_FORCE: Vector = (Value(1, "fx"), Value(1, "fy"), Value(1, "fz"))
"""Force on the robot at the tool centre point, in base."""
_MOMENT: Vector = (Value(1, "mx"), Value(1, "my"), Value(1, "mz"))
"""Moment on the robot about the tool centre point, in base."""


@dataclass(frozen=True)
class _Frame:
    """A frame in base."""

    rotation: Matrix
    origin: Vector


@dataclass(frozen=True)
class _JointFrames:
    """A joint's frame before and behind its motion."""

    proximal: _Frame
    distal: _Frame


@dataclass(frozen=True)
class _Chain:
    """Every frame of the chain."""

    joints: tuple[_JointFrames, ...]
    tcp: _Frame


def _write_chain(program: Program, chain: SerialChain) -> _Chain:
    """Add the statements of the forward chain (paper Eq. 1-3) and return its frames.

    Joint ``k`` counts from 1. Its names are ``p<k>`` (rotation before the motion), ``r<k>``
    (behind it), ``o<k>`` (origin before), ``d<k>`` (origin behind a linear motion).
    """
    # From the base out: what is 0 or 1 in the first frames leaves no statement in those behind.
    here = _Frame(_IDENTITY, _NOTHING)
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
    return _Chain(tuple(joints), _behind(program, here, tip, ("t", "tcp")))


def _constant_frame(program: Program, name: str, T: FloatArray) -> _Frame:
    x, y, z = (
        program.constant_vector(f"{name}_{a}", row) for a, row in zip("xyz", T[:3, :3], strict=True)
    )
    return _Frame((x, y, z), program.constant_vector(name, T[:3, 3]))


def _behind(program: Program, here: _Frame, place: _Frame, names: tuple[str, str]) -> _Frame:
    """Return ``here @ place``."""
    rotation, origin = names
    return _Frame(
        program.product(rotation, here.rotation, place.rotation),
        program.transformed(origin, here.rotation, place.origin, here.origin),
    )


def _moved(program: Program, proximal: _Frame, joint: ChainJoint, k: int) -> _Frame:
    """Return the frame behind the joint's motion."""
    axis = program.constant_vector(f"axis{k}", joint.axis)
    if joint.revolute:
        sine, cosine = program.turn(k, f"q{k}")
        turn = _rotation(program, f"turn{k}", axis, sine, cosine)
        return _Frame(program.product(f"r{k}", proximal.rotation, turn), proximal.origin)
    travel = Value(1, f"q{k}")
    slid = [program.total(f"slide{k}_{a}", [(x, travel)]) for a, x in zip("xyz", axis, strict=True)]
    along = (slid[0], slid[1], slid[2])
    origin = program.transformed(f"d{k}", proximal.rotation, along, proximal.origin)
    return _Frame(proximal.rotation, origin)


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


_Point = tuple[int, bool, tuple[float, float, float]]
"""Joint, whether behind its motion, offset: where the axis of a spring passes."""

_Weighted = tuple[Value, Vector]


def orientation(model: ElasticModel) -> Routine:
    """Return the program of the rotation of the tool centre point in base, row by row."""
    program = Program()
    tcp = _write_chain(program, model.robot.chain).tcp
    return _routine(program, [value for row in tcp.rotation for value in row])


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
    """
    program = Program()
    laws = _Laws(program, model)
    total = _NOTHING
    # A spring between two places of the chain moves neither before both its torques are known.
    waiting: list[_Place] = []
    moved: dict[int, Value] = {}
    for place in _places(program, model):
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
    return _routine(program, total)


def observation_block(model: ElasticModel) -> Routine:
    """Return the program of the block ``O`` with ``O c = deflection`` (paper Eq. 11, 14).

    The outputs are the x components of all parameters, then the y, then the z components.
    """
    program = Program()
    laws = _Laws(program, model)
    jacobian: dict[int, Vector] = {}
    terms: dict[int, list[_Weighted]] = {p: [] for p in range(len(model.parameters))}
    columns: dict[int, Vector] = {}
    for place in _places(program, model):
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
    parameters = range(len(model.parameters))
    return _routine(program, [columns[p][row] for row in range(3) for p in parameters])


@dataclass(frozen=True)
class _LoadedAxis:
    """An axis of a spring at given joints, with its load."""

    number: int
    """Counts the axes of all springs."""
    revolute: bool
    direction: Vector
    torque: Value
    """About the axis, or force along it."""


@dataclass(frozen=True)
class _Place:
    """A point of the chain where axes of springs pass."""

    program: Program
    label: str
    """Tells the names of its statements from those of other points: 2, 2_2, 2_3."""
    lever: Vector
    """From it to the tool centre point."""
    moment: Vector
    """Moment of the load about the point."""
    axes: dict[int, tuple[SpringAxis, _Frame]]
    """By number, with the frame that each is fixed in."""
    directions: dict[int, Vector] = field(default_factory=dict)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of its axes."""
        return tuple(self.axes)

    def loaded(self) -> Iterator[_LoadedAxis]:
        """Write and yield one axis after the other."""
        program = self.program
        for number, (axis, frame) in self.axes.items():
            fixed = program.constant_vector(f"spring{number + 1}", axis.axis)
            a = program.transformed(f"a{number + 1}", frame.rotation, fixed, _NOTHING)
            self.directions[number] = a
            torque = program.dot(f"tau{number + 1}", a, self.moment if axis.revolute else _FORCE)
            yield _LoadedAxis(number, axis.revolute, a, torque)


class _Laws:
    """The laws of the springs as statements: from torques about their axes to angles."""

    def __init__(self, program: Program, model: ElasticModel) -> None:
        self._program = program
        self._torques: dict[int, Value] = {}
        self._spring_of = [s for s, each in enumerate(model.springs) for _ in each.axes]
        self._springs = model.springs
        self._axes = _numbered([len(spring.axes) for spring in model.springs])
        self._parameters = _numbered([len(spring.parameters) for spring in model.springs])

    def angles(self, axis: _LoadedAxis) -> Iterator[tuple[int, list[tuple[int, Value]]]]:
        """Yield, once all torques of a spring are known, the angles of each of its axes.

        Each axis by its number, with the angle that one unit of each parameter makes, by the
        number of the parameter.
        """
        self._torques[axis.number] = axis.torque
        s = self._spring_of[axis.number]
        axes, parameters = self._axes[s], self._parameters[s]
        if not self._torques.keys() >= set(axes):
            return
        inputs = {f"t{k}": self._torques[number] for k, number in enumerate(axes)}
        names = (f"x{s + 1}_{k}" for k in count(1))
        load = SpringLoad[Expression](tuple(Input(name) for name in inputs))
        for number, row in zip(axes, self._springs[s].angles(load), strict=True):
            values = [written(self._program, x, inputs, names) for x in row]
            yield number, list(zip(parameters, values, strict=True))


def written(
    program: Program, x: Expression, inputs: dict[str, Value], names: Iterator[str]
) -> Value:
    """Write the statements of a formula and return its value."""

    def value(part: Expression) -> Value:
        return written(program, part, inputs, names)

    match x:
        case Input(name):
            return inputs[name]
        case Number(number):
            # Unlike lengths of a URDF, numbers of a law may be tiny and still count.
            plain = number in (0.0, 1.0, -1.0)
            return Value(int(number)) if plain else program.quantity(next(names), number)
        case Product(factors):
            return program.total(next(names), [tuple(map(value, factors))])
        case Sum(terms):
            return program.total(next(names), [(value(term),) for term in terms])
        case Function(name, argument):
            return program.call(next(names), name, value(argument))
    raise TypeError(f"no formula: {x!r}")


def _numbered(lengths: Sequence[int]) -> list[range]:
    """Return the numbers of each one's parts, counted through."""
    ends = [sum(lengths[: k + 1]) for k in range(len(lengths))]
    return [range(end - length, end) for end, length in zip(ends, lengths, strict=True)]


def _displaced(program: Program, start: Vector, place: _Place, moved: dict[int, Value]) -> Vector:
    """Return ``start`` with what the axes of a place displace the tool centre point by."""
    turns = {number: axis.revolute for number, (axis, _) in place.axes.items()}
    turned = [(moved[n], a) for n, a in place.directions.items() if turns[n]]
    shifted = [(moved[n], a) for n, a in place.directions.items() if not turns[n]]
    theta = program.weighted_sum(f"theta{place.label}", turned)
    shift = program.weighted_sum(f"shift{place.label}", shifted)
    base = program.weighted_sum(f"base{place.label}", [(ONE, start), (ONE, shift)])
    return program.cross(f"sum{place.label}", theta, place.lever, base)


def _places(program: Program, model: ElasticModel) -> Iterator[_Place]:
    """Write the chain and yield where springs sit, from base to tip."""
    chain = _write_chain(program, model.robot.chain)
    axes = [axis for spring in model.springs for axis in spring.axes]
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
        here = {i: (axes[i], _frame(chain, joint, axes[i].distal)) for i in numbers}
        yield _Place(program, label, lever, moment, here)


def _points(model: ElasticModel, axes: Sequence[SpringAxis]) -> list[tuple[_Point, list[int]]]:
    """Return where axes pass, from base to tip, with the axes of each place.

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


def _frame(chain: _Chain, joint: int, behind: bool) -> _Frame:
    return chain.joints[joint].distal if behind else chain.joints[joint].proximal


def _routine(program: Program, outputs: Iterable[Value]) -> Routine:
    outputs = tuple(outputs)
    statements = needed(program.statements, outputs)
    used = used_names(statements, outputs)
    constants = {name: x for name, x in program.constants.items() if name in used}
    return Routine(statements, outputs, constants)
