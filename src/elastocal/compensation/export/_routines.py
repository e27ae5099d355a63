"""Routines of the kernel as C functions."""

from collections.abc import Mapping, Sequence

from elastocal.compensation.export._constants import remark
from elastocal.compensation.kernel import (
    Assignment,
    Call,
    Naming,
    Remark,
    Routine,
    Statement,
    Turn,
    sum_text,
    used_names,
    value_text,
)
from elastocal.compensation.online import Design

_VECTORS = {"f": "force", "m": "moment"}


def c_routines(numbers: Design) -> str:
    """Return the functions for orientation, deflection and observation block."""
    springs = len(numbers.calibrated.model.parameters)
    load = "const double q[], const double force[3], const double moment[3]"
    inputs = ("q", "force", "moment")
    rotation = [f"rotation[{i}]" for i in range(9)]
    deflection = [f"deflection[{i}]" for i in range(3)]
    block = [f"block[{row}][{spring}]" for row in range(3) for spring in range(springs)]
    head = "static void orientation(const double q[], double rotation[9])"
    columns = f"void elastocal_block({load},\n    double block[3][ELASTOCAL_SPRINGS])"
    total = f"void elastocal_deflection({load},\n    double deflection[3])"
    return "\n".join(
        (
            "/* ---- The model ------------------------------------------------------------------",
            " * s and c are sine and cosine, p and r rotations before and behind a joint, o and d",
            " * origins; tau torques, w turns of a spring, theta turns of a joint's springs. */",
            "",
            "/* Rotation of the tool centre point in base, by rows. */",
            _function(head, numbers.orientation, rotation, inputs[:1], numbers.joints),
            _function(total, numbers.deflection, deflection, inputs, numbers.joints),
            _function(columns, numbers.block, block, inputs, numbers.joints),
        )
    )


def _function(
    head: str, routine: Routine, outputs: Sequence[str], inputs: Sequence[str], joints: int
) -> str:
    names = {f"q{k + 1}": f"q[{k}]" for k in range(joints)}
    for letter, vector in _VECTORS.items():
        names |= {f"{letter}{axis}": f"{vector}[{i}]" for i, axis in enumerate("xyz")}
    naming = _naming(names, routine.constants)
    lines = [line for statement in routine.statements for line in _lines(statement, naming)]
    results = [
        f"    {output} = {value_text(value, naming)};"
        for output, value in zip(outputs, routine.outputs, strict=True)
    ]
    used = used_names(routine.statements, routine.outputs)
    idle = [
        f"    (void){name};"
        for name in inputs
        if not any(names.get(value, "").startswith(f"{name}[") for value in used)
    ]
    return "\n".join([head, "{", *lines, *idle, *results, "}", ""])


def _naming(names: Mapping[str, str], constants: Mapping[str, float]) -> Naming:
    return lambda name: name.upper() if name in constants else names.get(name, name)


def _lines(statement: Statement, naming: Naming) -> list[str]:
    match statement:
        case Remark(text):
            return [f"    /* {remark(text)} */"]
        case Turn(sine, cosine, angle):
            return [
                f"    double {sine};",
                f"    double {cosine};",
                f"    sin_cos({naming(angle)}, &{sine}, &{cosine});",
            ]
        case Assignment():
            return [f"    const double {statement.name} = {sum_text(statement, naming)};"]
        case Call(name, function, argument):
            return [f"    const double {name} = {function}({value_text(argument, naming)});"]
