"""Programs as Python functions of plain floats."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from elastocal.compensation.kernel.program import (
    Assignment,
    Call,
    Routine,
    Statement,
    Turn,
    statement_uses,
    sum_text,
    value_text,
)
from elastocal.results import brief_repr

_WRITTEN_OUT = {
    "min": "{0} if {0} < {1} else {1}",
    "max": "{1} if {0} < {1} else {0}",
    "quotient": "{0} / {1}",
}
"""Python's own functions take thrice the time."""

_MATH = ("sin", "cos", "atan2", "fabs")

Function = Callable[..., tuple[float, ...]]


@brief_repr
@dataclass(frozen=True)
class ModelFunctions:
    """Functions of a model that a compensator needs; they take and return sequences of floats.

    A model without friction remembers nothing: its functions take no ``memory``.
    """

    orientation: Function
    """``(q)``: rotation of the tool centre point in base, by rows."""
    rest: Function
    """``(q)``: memory of the unloaded arm after a free motion."""
    deflection: Function
    """``(q, force, moment, memory)``: deflection in base, in m, and the memory after it."""
    block: Function
    """``(q, force, moment, memory)``: observation block by rows, in m per unit of each parameter;
    with friction also how far an unknown start may move each component, in m, and the memory after
    the load."""
    growth: Function | None = None
    """``(q)``: how far a warm arm has grown, in base, in m; None: nothing is known of it."""
    links: Function | None = None
    """``(q, force, moment, memory)``: what joints with a secondary encoder yield, then the
    displacement of the tool centre point for a unit of each; None: there are none."""


def compiled(routine: Routine, joints: int, loaded: bool = True) -> Function:
    """Return a routine as a function.

    The text is made of the names and numbers of the routine alone, none of which a file can
    choose: joints and springs are numbered, and every number is a finite float.

    Parameters
    ----------
    routine : Routine
        The program.
    joints : int
        Number of joints.
    loaded : bool
        Whether it reads a load.

    Returns
    -------
    callable
        ``(q, force, moment) -> outputs``, with ``memory`` behind them where the routine has one,
        or ``(q) -> outputs``; every argument a sequence of floats: rad or m, N, N·m.
    """
    namespace: dict[str, Function] = {name: getattr(math, name) for name in _MATH}
    # Compiled once, run every cycle: an interpreter of the statements would be slower than arrays.
    exec(compile(python_text(routine, joints, loaded), "<elastic model>", "exec"), namespace)
    return namespace["routine"]


def python_text(routine: Routine, joints: int, loaded: bool) -> str:
    """Return the source of that function."""
    variables = _Variables(routine)

    def naming(name: str) -> str:
        number = routine.constants.get(name)
        return variables.read(name) if number is None else repr(number)

    inputs = {"q": [f"q{k + 1}" for k in range(joints)]}
    if loaded:
        inputs |= {"force": ["fx", "fy", "fz"], "moment": ["mx", "my", "mz"]}
    if routine.memory:
        inputs["memory"] = list(routine.memory)
    lines = [f"def routine({', '.join(inputs)}):"]
    for source, names in inputs.items():
        targets = "".join(f"{variables.write(name)}, " for name in names)
        lines.append(f"    {targets}= {source}")
    for statement in routine.statements:
        match statement:
            case Turn(sine, cosine, angle):
                read = naming(angle)
                # The angle is read twice: its variable is not free for the sine.
                pair = variables.write(sine), variables.write(cosine)
                lines += [f"    {pair[0]} = sin({read})", f"    {pair[1]} = cos({read})"]
            case Assignment():
                text = sum_text(statement, naming)
                variables.free(statement)
                lines.append(f"    {variables.write(statement.name)} = {text}")
            case Call(name, function, arguments):
                texts = [value_text(argument, naming) for argument in arguments]
                form = _WRITTEN_OUT.get(function)
                text = form.format(*texts) if form else f"{function}({', '.join(texts)})"
                variables.free(statement)
                lines.append(f"    {variables.write(name)} = {text}")
    lines.append(f"    return ({' '.join(value_text(v, naming) + ',' for v in routine.outputs)})")
    return "\n".join(lines) + "\n"


class _Variables:
    """Local variables of a routine in Python, used again once nothing reads what they hold.

    A frame of some hundred variables takes twice the time: the interpreter asks the system for
    its memory at every call.
    """

    def __init__(self, routine: Routine) -> None:
        last = {
            name: statement
            for statement in routine.statements
            for name in statement_uses(statement)
        }
        kept = {value.name for value in routine.outputs}
        self._last = {name: id(each) for name, each in last.items() if name not in kept}
        self._place: dict[str, str] = {}
        self._idle: list[str] = []
        self._count = 0

    def write(self, name: str) -> str:
        """Return the variable that a name gets."""
        if not self._idle:
            self._count += 1
            self._idle.append(f"v{self._count}")
        self._place[name] = self._idle.pop()
        return self._place[name]

    def read(self, name: str) -> str:
        """Return the variable that holds a name."""
        return self._place[name]

    def free(self, statement: Statement) -> None:
        """Note that a statement has been read: what no later one reads may go."""
        for name in sorted(statement_uses(statement)):
            if self._last.get(name) == id(statement) and name in self._place:
                self._idle.append(self._place.pop(name))
