"""A routine as a Python function of plain floats, three times quicker than arrays of three."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from elastocal.compensation.kernel.program import Assignment, Call, Turn, sum_text, value_text
from elastocal.compensation.kernel.statics import Routine
from elastocal.results import brief_repr

Function = Callable[..., tuple[float, ...]]


@brief_repr
@dataclass(frozen=True)
class ModelFunctions:
    """What a compensator asks of a model; arguments and results are sequences of floats."""

    orientation: Function
    """``(q)``: rotation of the tool centre point in base, by rows."""
    deflection: Function
    """``(q, force, moment)``: deflection in base, in m."""
    block: Function
    """``(q, force, moment)``: observation block by rows, in m per unit of each parameter."""


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
        ``(q, force, moment) -> outputs`` or ``(q) -> outputs``; every argument a sequence of
        floats: rad or m, N, N·m.
    """
    source = python_text(routine, joints, loaded)
    functions = {"sin", "cos"}
    functions |= {each.function for each in routine.statements if isinstance(each, Call)}
    namespace: dict[str, Function] = {name: getattr(math, name) for name in functions}
    exec(compile(source, "<elastic model>", "exec"), namespace)
    return namespace["routine"]


def python_text(routine: Routine, joints: int, loaded: bool) -> str:
    """Return the source of that function."""

    def naming(name: str) -> str:
        number = routine.constants.get(name)
        # In parentheses, since "a - -1.0" is no C and its twin here reads the same.
        return name if number is None else repr(number) if number >= 0 else f"({number!r})"

    lines = [f"def routine(q{', force, moment' if loaded else ''}):"]
    lines.append(_unpacked([f"q{k + 1}" for k in range(joints)], "q"))
    if loaded:
        lines += [_unpacked(["fx", "fy", "fz"], "force"), _unpacked(["mx", "my", "mz"], "moment")]
    for statement in routine.statements:
        match statement:
            case Turn(sine, cosine, angle):
                lines += [f"    {sine} = sin({angle})", f"    {cosine} = cos({angle})"]
            case Assignment():
                lines.append(f"    {statement.name} = {sum_text(statement, naming)}")
            case Call(name, function, argument):
                lines.append(f"    {name} = {function}({value_text(argument, naming)})")
    lines.append(f"    return ({' '.join(value_text(v, naming) + ',' for v in routine.outputs)})")
    return "\n".join(lines) + "\n"


def _unpacked(names: Sequence[str], source: str) -> str:
    return f"    {' '.join(name + ',' for name in names)} = {source}"
