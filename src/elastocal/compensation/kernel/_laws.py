"""The laws of the springs as statements: from torques about their axes to angles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

from elastocal.compensation.kernel.program import Program, Value, Vector
from elastocal.elastic import ElasticModel, SpringLoad
from elastocal.elastic.springs import Expression, Function, Input, Number, Product, Sum

Angles = list[tuple[int, Value]]
"""By the number of a parameter, the angle that one unit of it makes."""


@dataclass(frozen=True)
class LoadedAxis:
    """An axis of a spring at given joints, with its load."""

    number: int
    """Counts the axes of all springs."""
    revolute: bool
    direction: Vector
    torque: Value
    """Of the load about the axis, or force along it."""
    weight: Value
    """Torque of the arm's own weight, likewise; zero where no law asks for it."""


class Memory:
    """What friction remembers, as numbers from one call to the next.

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

    def __init__(self, program: Program, model: ElasticModel) -> None:
        self.memory = Memory(model)
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
        return self._heavy and (spring.bears_weight or bool(spring.friction_limits))

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
        """Return by how much friction from before may have turned an axis beside `angles`.

        An element slides at ``+-r`` and may have borne anything within when the arm was free; 0 is
        taken. Torques that span ``R`` bring all histories to within ``2 r - R`` of one another,
        and never farther apart than they began: ``min(r, 2 r - R)``, none beyond ``R = 2 r``.
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
        borne = {}
        for e in self._elements[s]:
            pulled = program.total(f"pulled{e + 1}", [(torque,), (Value(1, f"u{e + 1}"),)])
            borne[e] = program.clipped(f"borne{e + 1}", pulled, self._limit(e))
            self._states[e] = program.total(f"kept{e + 1}", [(borne[e],), (-torque,)])
        low = program.call(f"lowest{a}", "min", Value(1, f"low{a}"), torque)
        high = program.call(f"highest{a}", "max", Value(1, f"high{a}"), torque)
        self._ranges[first.number] = low, high, first.torque
        return borne

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
        case Sum(parts) | Product(parts) | Function(_, parts):
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
        case Product(factors):
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
