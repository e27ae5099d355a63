"""A compensator as a folder of C: model, header, self-test, CMake file and page for integrators.

The templates of the exported C: texts with places between two @.
"""

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from types import MappingProxyType

import numpy as np

from elastocal import __version__
from elastocal.compensation.export._constants import checksum, constants_of, remark, turns_arcs
from elastocal.compensation.export._selftest import selftest_tables
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
from elastocal.files import filling


def template(name: str) -> str:
    """Return the text of a template."""
    return (resources.files(__package__) / "templates" / name).read_text(encoding="utf-8")


def filled(name: str, values: dict[str, str], remembers: bool = False) -> str:
    """Return a template with its places filled.

    Lines that begin with ``@FRICTION@`` are for models that remember friction only, those with
    ``@PLAIN@`` for the others.
    """
    kept, dropped = ("@FRICTION@", "@PLAIN@") if remembers else ("@PLAIN@", "@FRICTION@")
    lines = template(name).splitlines(keepends=True)
    text = "".join(line.removeprefix(kept) for line in lines if not line.startswith(dropped))
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text


_VECTORS = {"f": "force", "m": "moment"}
_PARTS = ("head.c", "sin_cos.c", "arc.c", "condition.c", "correct.c", "selftest.c")
_BESIDE = ("elastocal_model.h", "selftest_main.c", "CMakeLists.txt", "README.md")
_FUNCTIONS = {
    "atan2": "arc({}, {})",
    "fabs": "fabs({})",
    "min": "({0} < {1}) ? {0} : {1}",
    "max": "({0} < {1}) ? {1} : {0}",
}
"""As C for what statements call: comparisons compile to one instruction, without a branch."""
_RAW = "N, N m; raw, as the sensor gives them | sensor"
_AT_TCP = (
    "N, N m; **on** the robot, bias and tool weight removed, about the tool centre point | tcp"
)
_REMOVED_HERE = (
    "The sensor's bias, a tool of {mass:g} kg, and the way from sensor to tool centre point are"
    " taken care of by `elastocal_condition`. Do not zero the sensor after the export: its bias is"
    " among the constants. With another tool, or after a crash, identify and export again."
)
_REMOVED = (
    "**No tool file was given to this export.** Readings must come with the sensor's bias and the"
    " tool's weight removed, moved to the tool centre point and turned into its axes. A raw wrench"
    " that goes in is corrected as if the tool's weight were a process force."
)


def write_c(
    folder: Path,
    numbers: Design,
    force: bool = False,
    beside: Mapping[str, str] = MappingProxyType({}),
) -> tuple[str, ...]:
    """Write the C files of a compensator and return their names.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    numbers : Design
        The compensator.
    force : bool
        Whether files in the folder may be replaced.
    beside : mapping of str to str
        Further files by name, such as `linux_files`.

    Raises
    ------
    FileAccessError
        If the folder holds files and ``force`` is not given, or cannot be written.
    CompensationError
        If what would be exported does not agree with the model.
    """
    files = c_files(numbers) | dict(beside)
    with filling(folder, "elastocal_model.c", force) as temporary:
        for name, text in files.items():
            (temporary / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(files)


def c_files(numbers: Design) -> dict[str, str]:
    """Return the C files of a compensator, by name; the same design gives the same text.

    Raises
    ------
    CompensationError
        If what would be exported does not agree with the model.
    """
    values = _values(numbers)
    remembers = bool(numbers.deflection.memory)
    constants = constants_of(numbers)
    data = selftest_tables(numbers)
    mixing = "\n".join(line for constant in constants for line in constant.mixing())
    values |= data | {"MIXING": mixing, "CHECKSUM": str(checksum(constants))}
    head, sin_cos, arc, condition, correct, selftest = (
        filled(part, values, remembers) for part in _PARTS
    )
    definitions = "".join(f"{each.definition()}\n" for each in constants if not each.in_header)
    model = "".join(
        [
            head,
            definitions,
            sin_cos,
            arc if turns_arcs(numbers) else "",
            _routines(numbers),
            condition,
            correct,
            selftest,
        ]
    )
    values |= _readme_values(numbers)
    beside = {name: filled(name, values, remembers) for name in _BESIDE}
    return {"elastocal_model.c": model} | beside


def _values(numbers: Design) -> dict[str, str]:
    calibrated = numbers.calibrated
    robot = calibrated.model.robot
    about = [
        f"Robot {robot.name}, base {robot.base}, tool centre point {robot.tip}.",
        f"Tool: {calibrated.tool_name}.",
        f"Data: {calibrated.provenance or 'not named'}.",
    ]
    names = [
        f"{k}  {name}, {'rad' if turns else 'm'}"
        for k, (name, turns) in enumerate(zip(robot.joint_names, robot.revolute, strict=True))
    ]
    frame = numbers.settings.frame
    median = numbers.filters.median
    return {
        "VERSION": __version__,
        "ABOUT": "\n".join(f" * {remark(line)}" for line in about),
        "JOINT_NAMES": "\n".join(f" *   {remark(name)}" for name in names),
        "JOINTS": str(numbers.joints),
        "SPRINGS": str(len(calibrated.model.parameters)),
        "SECTIONS": str(len(numbers.filters.sections)),
        "MEDIAN": str(median),
        "MEMORY": str(len(numbers.deflection.memory)),
        "MEDIAN_CODE": template(f"median_{median}.c").rstrip("\n"),
        "CYCLE": repr(numbers.settings.cycle),
        "SAMPLE": repr(numbers.filters.sample),
        "DELAY": repr(float(numbers.filters.delay())),
        "FRAME": frame if isinstance(frame, str) else "a frame turned in base (FRAME)",
    }


def _readme_values(numbers: Design) -> dict[str, str]:
    """Return the values of the README's places."""
    settings, limits = numbers.settings, numbers.settings.limits
    robot = numbers.calibrated.model.robot
    frequencies = np.array([0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
    frequencies = frequencies[frequencies < 0.5 / numbers.filters.sample]
    delays, gains = numbers.filters.delay(frequencies), numbers.filters.gain(frequencies)
    rows = [
        f"| {f:g} | {'none passes' if np.isnan(d) else f'{1e3 * d:.2f}'} | {g:.3f} |"
        for f, d, g in zip(frequencies, delays, gains, strict=True)
    ]
    return {
        "ROBOT": robot.name,
        "BASE": robot.base,
        "TIP": robot.tip,
        "CYCLE_MS": f"{1e3 * settings.cycle:g}",
        "SAMPLE_MS": f"{1e3 * numbers.filters.sample:g}",
        "LARGEST_MM": f"{1e3 * limits.correction:g}",
        "RATE_MM": f"{1e3 * limits.rate:g}",
        "FADE_MM": f"{1e3 * limits.fade:g}",
        "HOLD_MS": f"{1e3 * settings.hold:g}",
        "SENSOR": _REMOVED_HERE.format(mass=numbers.load.mass) if numbers.weighs else _REMOVED,
        "RAW": _RAW if numbers.weighs else _AT_TCP,
        "DELAYS": "\n".join(rows),
        "LIBRARY": "`fabs`, `copysign`, " if turns_arcs(numbers) else "",
        "FREE_MS": f"{1e3 * settings.friction.free_after:g}",
    }


def _routines(numbers: Design) -> str:
    """Return the functions for orientation, rest, deflection and observation block."""
    springs, joints = len(numbers.calibrated.model.parameters), numbers.joints
    load = "const double q[], const double force[3], const double moment[3]"
    inputs = ("q", "force", "moment")
    rotation = [f"rotation[{i}]" for i in range(9)]
    deflection = [f"deflection[{i}]" for i in range(3)]
    block = [f"block[{row}][{spring}]" for row in range(3) for spring in range(springs)]
    head = "static void orientation(const double q[], double rotation[9])"
    columns = f"void elastocal_block({load},\n    double block[3][ELASTOCAL_SPRINGS])"
    total = f"void elastocal_deflection({load},\n    double deflection[3])"
    of_block, begins = numbers.block, []
    if numbers.deflection.memory:
        kept = "double memory[ELASTOCAL_MEMORY]"
        columns = (
            f"void elastocal_block({load},\n    const {kept}, double block[3][ELASTOCAL_SPRINGS],"
            " double unknown[3])"
        )
        total = f"void elastocal_deflection({load},\n    {kept}, double deflection[3])"
        memory = [f"memory[{i}]" for i in range(len(numbers.deflection.memory))]
        deflection += memory
        block += [f"unknown[{i}]" for i in range(3)]
        # The deflection has moved the memory on already; the block leaves it as it is.
        of_block = numbers.block.leading(len(block))
        rest = f"void elastocal_rest(const double q[], {kept})"
        begins = [_function(rest, numbers.rest, memory, inputs[:1], joints)]
    return "\n".join(
        (
            "/* ---- The model ------------------------------------------------------------------",
            " * s and c are sine and cosine, p and r rotations before and behind a joint, o and d",
            " * origins; tau torques, w turns of a spring, theta turns of a joint's springs. */",
            "",
            "/* Rotation of the tool centre point in base, by rows. */",
            _function(head, numbers.orientation, rotation, inputs[:1], joints),
            *begins,
            _function(total, numbers.deflection, deflection, inputs, joints),
            _function(columns, of_block, block, inputs, joints),
        )
    )


def _function(
    head: str, routine: Routine, outputs: Sequence[str], inputs: Sequence[str], joints: int
) -> str:
    names = {f"q{k + 1}": f"q[{k}]" for k in range(joints)}
    for letter, vector in _VECTORS.items():
        names |= {f"{letter}{axis}": f"{vector}[{i}]" for i, axis in enumerate("xyz")}
    names |= {name: f"memory[{i}]" for i, name in enumerate(routine.memory)}

    def naming(name: str) -> str:
        return name.upper() if name in routine.constants else names.get(name, name)

    lines = [line for statement in routine.statements for line in _lines(statement, naming)]
    results = [
        f"    {output} = {value_text(value, naming)};"
        for output, value in zip(outputs, routine.outputs, strict=True)
    ]
    used = used_names(routine.statements, routine.outputs)
    # An argument that a model without such joints or loads never reads would be a warning in C.
    idle = [
        f"    (void){name};"
        for name in inputs
        if not any(names.get(value, "").startswith(f"{name}[") for value in used)
    ]
    return "\n".join([head, "{", *lines, *idle, *results, "}", ""])


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
        case Call(name, function, arguments):
            texts = [value_text(argument, naming) for argument in arguments]
            return [f"    const double {name} = {_FUNCTIONS[function].format(*texts)};"]
