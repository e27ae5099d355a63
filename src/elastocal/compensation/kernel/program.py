"""Straight-line programs: one list of statements, printed as C and compiled as Python.

The deflection of an elastic model at given joints is a fixed sequence of products and sums. Sums
of products read the same in C and in Python, so both come from one list, with the same arithmetic
in the same order; products with 0 and 1, of which the transforms of a robot are full, are left
out when the list is made. As Python functions of plain floats they are three times quicker than
arrays of three.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from elastocal.results import brief_repr

_SNAP = 4e-16
"""Numbers nearer than this to 0, 1 or -1 are these: ``rpy="0 1.5707963267948966 0"`` of a URDF
means a right angle."""


@dataclass(frozen=True)
class Value:
    """0, 1 or the value of a name, with a sign."""

    sign: int
    """-1, 0 or 1."""
    name: str = ""
    """Empty: the number ``sign`` itself."""

    def __neg__(self) -> "Value":
        return Value(-self.sign, self.name)


ZERO, ONE = Value(0), Value(1)
Vector = tuple[Value, Value, Value]
Matrix = tuple[Vector, Vector, Vector]
"""Rows."""
Product = tuple[Value, ...]
Naming = Callable[[str], str]
"""Function from the name of a value to its spelling in C or Python."""


@brief_repr
@dataclass(frozen=True)
class Assignment:
    """``name = ± a * b ± c * d …``."""

    name: str
    terms: tuple[tuple[int, tuple[str, ...]], ...]
    """Sign and factors of each product."""

    def uses(self) -> set[str]:
        """Return the names that it reads."""
        return {factor for _, factors in self.terms for factor in factors}


@dataclass(frozen=True)
class Turn:
    """``sine, cosine = sin(angle), cos(angle)``."""

    sine: str
    cosine: str
    angle: str


@dataclass(frozen=True)
class Remark:
    """A line for the reader."""

    text: str


@brief_repr
@dataclass(frozen=True)
class Call:
    """``name = function(arguments)``."""

    name: str
    function: str
    """``atan2``, ``quotient``, ``fabs``, ``min`` or ``max``."""
    arguments: tuple[Value, ...]


Statement = Assignment | Turn | Call | Remark


@brief_repr
@dataclass
class Program:
    """A list of statements under construction."""

    constants: dict[str, float] = field(default_factory=dict)
    """Numbers of the model, by name."""
    statements: list[Statement] = field(default_factory=list)

    def remark(self, text: str) -> None:
        """Add a line for the reader."""
        self.statements.append(Remark(text))

    def constant(self, name: str, number: float) -> Value:
        """Return a constant as a value; 0, 1 and -1 need no name.

        Parameters
        ----------
        name : str
            Name of the constant.
        number : float
            Finite.
        """
        for nearest in (0, 1, -1):
            if abs(number - nearest) <= _SNAP:
                return Value(nearest)
        return self.quantity(name, number)

    def quantity(self, name: str, number: float) -> Value:
        """Return a constant that keeps its name whatever its number is."""
        self.constants[name] = number
        return Value(1, name)

    def turn(self, index: str, angle: str) -> tuple[Value, Value]:
        """Return sine and cosine of an angle."""
        sine, cosine = f"s{index}", f"c{index}"
        self.statements.append(Turn(sine, cosine, angle))
        return Value(1, sine), Value(1, cosine)

    def call(self, name: str, function: str, *arguments: Value) -> Value:
        """Return a function of values."""
        self.statements.append(Call(name, function, arguments))
        return Value(1, name)

    def clipped(self, name: str, value: Value, limit: Value) -> Value:
        """Return a value no farther from zero than a limit: ``(|x + r| - |x - r|) / 2``.

        Comparisons with constants would become jumps in C, and the time would depend on the data.
        """
        half = self.quantity("half", 0.5)
        ahead = self.total(f"{name}_ahead", [(value,), (limit,)])
        behind = self.total(f"{name}_behind", [(value,), (-limit,)])
        sizes = self.call(f"{name}_up", "fabs", ahead), self.call(f"{name}_down", "fabs", behind)
        return self.total(name, [(half, sizes[0]), (-half, sizes[1])])

    def total(self, name: str, products: Iterable[Product]) -> Value:
        """Return a sum of products, left to right; a plain one needs no statement.

        Parameters
        ----------
        name : str
            Name of the sum, where it needs one.
        products : iterable of tuples of Value
            The summands.
        """
        # Products are flattened to a sign and names: factors 0 and 1, of which the transforms of a
        # robot are full, leave no arithmetic behind.
        terms = []
        for product in products:
            sign = 1
            for value in product:
                sign *= value.sign
            if sign:
                terms.append((sign, tuple(value.name for value in product if value.name)))
        if not terms:
            return ZERO
        if len(terms) == 1 and len(terms[0][1]) <= 1:
            return Value(terms[0][0], *terms[0][1])
        self.statements.append(Assignment(name, tuple(terms)))
        return Value(1, name)

    # -- vectors ----------------------------------------------------------------------------

    def constant_vector(self, name: str, numbers: ArrayLike) -> Vector:
        """Return three constants as a vector."""
        plain = np.asarray(numbers, dtype=float).tolist()
        pairs = zip("xyz", plain, strict=True)
        return _vector(self.constant(f"{name}_{axis}", x) for axis, x in pairs)

    def weighted_sum(self, name: str, parts: Sequence[tuple[Value, Vector]]) -> Vector:
        """Return the sum of ``weight * vector``."""
        return _vector(
            self.total(f"{name}_{axis}", [(weight, vector[i]) for weight, vector in parts])
            for i, axis in enumerate("xyz")
        )

    def transformed(self, name: str, matrix: Matrix, vector: Vector, start: Vector) -> Vector:
        """Return ``start + matrix @ vector``."""
        return _vector(
            self.total(f"{name}_{axis}", [(start[i],), *zip(matrix[i], vector, strict=True)])
            for i, axis in enumerate("xyz")
        )

    def product(self, name: str, left: Matrix, right: Matrix) -> Matrix:
        """Return ``left @ right``."""
        rows = []
        for row, a in zip(left, "xyz", strict=True):
            columns = zip(*right, strict=True)
            rows.append(
                _vector(
                    self.total(f"{name}_{a}{b}", list(zip(row, column, strict=True)))
                    for column, b in zip(columns, "xyz", strict=True)
                )
            )
        return rows[0], rows[1], rows[2]

    def cross(self, name: str, a: Vector, b: Vector, start: Vector = (ZERO, ZERO, ZERO)) -> Vector:
        """Return ``start + a x b``."""
        # x of a x b is a_y b_z - a_z b_y, and so on round the axes.
        pairs = ((1, 2), (2, 0), (0, 1))
        return _vector(
            self.total(f"{name}_{axis}", [(start[i],), (a[j], b[k]), (-a[k], b[j])])
            for (i, axis), (j, k) in zip(enumerate("xyz"), pairs, strict=True)
        )

    def dot(self, name: str, a: Vector, b: Vector) -> Value:
        """Return the scalar product."""
        return self.total(name, list(zip(a, b, strict=True)))


@brief_repr
@dataclass(frozen=True)
class Routine:
    """A finished program."""

    statements: tuple[Statement, ...]
    outputs: tuple[Value, ...]
    constants: dict[str, float]
    """The numbers that it reads, by name."""
    memory: tuple[str, ...] = ()
    """Names of the numbers that it remembers from one call to the next."""

    def prefixed(self, prefix: str) -> "Routine":
        """Return the same program, its constants named apart from those of others."""
        names = {name: f"{prefix}{name}" for name in self.constants}

        def value(old: Value) -> Value:
            return Value(old.sign, names.get(old.name, old.name))

        def statement(old: Statement) -> Statement:
            match old:
                case Assignment(name, terms):
                    named = ((sign, tuple(names.get(f, f) for f in each)) for sign, each in terms)
                    return Assignment(name, tuple(named))
                case Turn(sine, cosine, angle):
                    return Turn(sine, cosine, names.get(angle, angle))
                case Call(name, function, arguments):
                    return Call(name, function, tuple(map(value, arguments)))
            return old

        return Routine(
            tuple(map(statement, self.statements)),
            tuple(map(value, self.outputs)),
            {names[name]: number for name, number in self.constants.items()},
            self.memory,
        )

    def leading(self, count: int) -> "Routine":
        """Return the program of its first outputs alone."""
        outputs = self.outputs[:count]
        statements = needed(self.statements, outputs)
        used = used_names(statements, outputs)
        constants = {name: x for name, x in self.constants.items() if name in used}
        return Routine(statements, outputs, constants, self.memory)


def statement_uses(statement: Statement) -> set[str]:
    """Return the names that a statement reads."""
    match statement:
        case Assignment():
            return statement.uses()
        case Turn():
            return {statement.angle}
        case Call():
            return {value.name for value in statement.arguments}
    return set()


def used_names(statements: Iterable[Statement], outputs: Iterable[Value]) -> set[str]:
    """Return the names that statements and outputs read."""
    return {value.name for value in outputs}.union(*map(statement_uses, statements))


def needed(statements: Sequence[Statement], outputs: Iterable[Value]) -> tuple[Statement, ...]:
    """Return the statements that the outputs depend on, in their order, remarks kept."""
    # From the last statement back: what follows a statement has already said what it reads.
    wanted = {value.name for value in outputs}
    kept: list[Statement] = []
    for statement in reversed(statements):
        match statement:
            case Remark():
                kept.append(statement)
            case Turn() if {statement.sine, statement.cosine} & wanted:
                wanted.add(statement.angle)
                kept.append(statement)
            case Assignment() | Call() if statement.name in wanted:
                wanted |= statement_uses(statement)
                kept.append(statement)
    return tuple(_without_idle_remarks(kept[::-1]))


def sum_text(assignment: Assignment, naming: Naming = str) -> str:
    """Return the right side of an assignment, every product in parentheses, left to right."""
    parts: list[str] = []
    for sign, factors in assignment.terms:
        product = " * ".join(map(naming, factors)) or "1.0"
        alone = len(assignment.terms) == 1
        term = product if len(factors) < 2 or (alone and sign > 0) else f"({product})"
        if not parts:
            parts.append(term if sign > 0 else f"-{term}")
        else:
            parts.append(f"{'+' if sign > 0 else '-'} {term}")
    return " ".join(parts)


def value_text(value: Value, naming: Naming = str) -> str:
    """Return a value by itself."""
    if not value.name:
        return repr(float(value.sign))
    return naming(value.name) if value.sign > 0 else f"-{naming(value.name)}"


def _without_idle_remarks(statements: Sequence[Statement]) -> Iterable[Statement]:
    """Drop the remarks that nothing follows before the next one."""
    for here, after in zip(statements, [*statements[1:], None], strict=True):
        if not isinstance(here, Remark) or not (after is None or isinstance(after, Remark)):
            yield here


def _vector(values: Iterable[Value]) -> Vector:
    x, y, z = values
    return x, y, z
