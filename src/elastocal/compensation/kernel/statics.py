"""Springs as statements: deflection and observation block at given joints and load."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from elastocal.compensation.kernel.chain import (
    FORCE,
    MOMENT,
    NOTHING,
    Chain,
    Frame,
    constant_vector,
    write_chain,
)
from elastocal.compensation.kernel.program import (
    Assignment,
    Program,
    Statement,
    Value,
    Vector,
    needed,
)
from elastocal.elastic import ElasticModel, Spring

Point = tuple[int, bool, tuple[float, float, float]]
"""Joint, whether behind its motion, offset: where the axis of a spring passes."""

Weighted = tuple[Value, Vector]


@dataclass(frozen=True)
class Routine:
    """A finished program."""

    statements: tuple[Statement, ...]
    outputs: tuple[Value, ...]
    constants: dict[str, float]
    """The numbers that it reads, by name."""


def orientation(model: ElasticModel) -> Routine:
    """Return the program of the rotation of the tool centre point in base, row by row."""
    program = Program()
    tcp = write_chain(program, model.robot.chain).tcp
    return _routine(program, [value for row in tcp.rotation for value in row])


def deflection(model: ElasticModel, compliance: Sequence[float]) -> Routine:
    """Return the program of the deflection at joints ``q`` under a force and a moment.

    With the springs at one point of the chain taken together, the lever ``l`` from there to the
    tool centre point and the moment ``n = m + l x f`` that the load has there,

        deflection = sum over points of (theta x l + u),
        theta = sum of c_i (a_i . n) a_i  over the revolute springs of the point,
        u     = sum of c_i (a_i . f) a_i  over its prismatic springs,

    which is ``sum c_i tau_i J_i`` (paper Eq. 10, 14) with ``J_i = a_i x l`` or ``a_i`` and
    ``tau_i = J_i . f + W_i . m``.
    """
    program = Program()
    chain = write_chain(program, model.robot.chain)
    total = NOTHING
    names = _labels(model)
    for point, indices in _points(model):
        label = names[point]
        program.remark(f"springs {', '.join(model.springs[i].name for i in indices)}")
        lever, moment = _lever(program, chain, point, label)
        turned: list[Weighted] = []
        shifted: list[Weighted] = []
        for i in indices:
            spring = model.springs[i]
            axis = _axis(program, chain, spring, point[0], i)
            torque = program.dot(f"tau{i + 1}", axis, moment if spring.revolute else FORCE)
            c = program.quantity(f"compliance{i + 1}", float(compliance[i]))
            yielding = program.total(f"w{i + 1}", [(c, torque)])
            (turned if spring.revolute else shifted).append((yielding, axis))
        theta = _sum(program, f"theta{label}", turned)
        for_shift = _sum(program, f"shift{label}", shifted)
        start = program.add(f"base{label}", total, for_shift)
        total = program.cross(f"sum{label}", theta, lever, start)
    return _routine(program, total)


def observation_block(model: ElasticModel) -> Routine:
    """Return the program of the block ``O`` with ``O c = deflection`` (paper Eq. 11, 14).

    The outputs are the x components of all springs, then the y, then the z components.
    """
    program = Program()
    chain = write_chain(program, model.robot.chain)
    columns: dict[int, Vector] = {}
    names = _labels(model)
    for point, indices in _points(model):
        label = names[point]
        program.remark(f"springs {', '.join(model.springs[i].name for i in indices)}")
        lever, moment = _lever(program, chain, point, label)
        for i in indices:
            spring = model.springs[i]
            axis = _axis(program, chain, spring, point[0], i)
            torque = program.dot(f"tau{i + 1}", axis, moment if spring.revolute else FORCE)
            J = program.cross(f"j{i + 1}", axis, lever) if spring.revolute else axis
            x, y, z = (
                program.total(f"b{i + 1}_{a}", [(torque, component)])
                for a, component in zip("xyz", J, strict=True)
            )
            columns[i] = (x, y, z)
    springs = range(len(model.springs))
    return _routine(program, [columns[i][row] for row in range(3) for i in springs])


def _points(model: ElasticModel) -> list[tuple[Point, list[int]]]:
    """Return where springs sit, from base to tip, with the springs of each place.

    A revolute spring about its joint's own axis is the same before and behind the motion.
    """
    names = model.robot.joint_names
    groups: dict[Point, list[int]] = {}
    for i, spring in enumerate(model.springs):
        joint = names.index(spring.joint)
        own = tuple(model.robot.chain.joints[joint].axis.tolist()) == spring.axis
        behind = spring.distal and not (own and spring.revolute and not any(spring.offset))
        groups.setdefault((joint, behind, spring.offset), []).append(i)
    return sorted(groups.items(), key=lambda item: (item[0][:2], item[1]))


def _frame(chain: Chain, joint: int, behind: bool) -> Frame:
    return chain.joints[joint].distal if behind else chain.joints[joint].proximal


def _labels(model: ElasticModel) -> dict[Point, str]:
    """Return what tells the names of a point's statements from those of others: 2, 2_2, 2_3."""
    points = [point for point, _ in _points(model)]
    labels: dict[Point, str] = {}
    for point in points:
        before = sum(1 for other in labels if other[0] == point[0])
        labels[point] = f"{point[0] + 1}" + (f"_{before + 1}" if before else "")
    return labels


def _lever(program: Program, chain: Chain, point: Point, label: str) -> tuple[Vector, Vector]:
    """Return the lever to the tool centre point and the moment of the load at the point."""
    joint, behind, offset = point
    frame = _frame(chain, joint, behind)
    shift = constant_vector(program, f"offset{label}", offset)
    at = program.transformed(f"at{label}", frame.rotation, shift, frame.origin)
    x, y, z = (-value for value in at)
    lever = program.add(f"lever{label}", chain.tcp.origin, (x, y, z))
    return lever, program.cross(f"moment{label}", lever, FORCE, MOMENT)


def _axis(program: Program, chain: Chain, spring: Spring, joint: int, index: int) -> Vector:
    frame = _frame(chain, joint, spring.distal)
    axis = constant_vector(program, f"spring{index + 1}", spring.axis)
    return program.transformed(f"a{index + 1}", frame.rotation, axis, NOTHING)


def _sum(program: Program, name: str, parts: Sequence[Weighted]) -> Vector:
    """Return the sum of ``weight * axis``."""
    x, y, z = (
        program.total(f"{name}_{a}", [(weight, axis[i]) for weight, axis in parts])
        for i, a in enumerate("xyz")
    )
    return x, y, z


def _routine(program: Program, outputs: Iterable[Value]) -> Routine:
    outputs = tuple(outputs)
    statements = needed(program.statements, outputs)
    used = {name for s in statements if isinstance(s, Assignment) for name in s.uses()}
    used |= {value.name for value in outputs}
    constants = {name: x for name, x in program.constants.items() if name in used}
    return Routine(statements, outputs, constants)
