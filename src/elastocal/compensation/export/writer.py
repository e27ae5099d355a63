"""A compensator as a folder of C: model, header, self-test, CMake file and page for integrators.

The C is printed from the statements of `elastocal.compensation.kernel`. What it must give, for the
loads and the course of readings of the self-test, comes from `ElasticModel` in Python, never from
these statements: a mistake in them would agree with itself. A compiler is not on every machine, so
before anything is written the statements are evaluated in Python and must agree with the model,
too.
"""

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.compensation.export._constants import checksum, constants_of, remark, turns_arcs
from elastocal.compensation.kernel import (
    Assignment,
    Call,
    ModelFunctions,
    Naming,
    Remark,
    Routine,
    Statement,
    Turn,
    sum_text,
    used_names,
    value_text,
)
from elastocal.compensation.online import Compensator, Design, Reading
from elastocal.elastic import ElasticModel, SpringLoad
from elastocal.errors import CompensationError
from elastocal.files import filling


def template(name: str) -> str:
    """Return the text of a template."""
    return (resources.files(__package__) / "templates" / name).read_text(encoding="utf-8")


def filled(
    name: str,
    values: dict[str, str],
    remembers: bool = False,
    grown: bool = False,
    built: bool = False,
    linked: bool = False,
) -> str:
    """Return a template with its places filled.

    Lines that begin with ``@FRICTION@`` are for models that remember friction only, those with
    ``@PLAIN@`` for the others; those with ``@GROWN@`` for arms that have grown, with ``@COLD@`` for
    the others; those with ``@BUILT@`` for arms whose geometry is known; those with ``@LINKS@`` for
    arms with secondary encoders, with ``@ALONE@`` for the others. A line may have several marks.
    """
    marks = {"@FRICTION@": remembers, "@PLAIN@": not remembers, "@GROWN@": grown, "@BUILT@": built}
    marks |= {"@COLD@": not grown, "@LINKS@": linked, "@ALONE@": not linked}
    text = "".join(_meant(template(name), marks))
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text


def _meant(text: str, marks: dict[str, bool]) -> Iterator[str]:
    """Yield the lines of a text without their marks, but those with one that is not meant."""
    for line in text.splitlines(keepends=True):
        rest = line
        while mark := next((each for each in marks if marks[each] and rest.startswith(each)), ""):
            rest = rest.removeprefix(mark)
        if not any(map(rest.startswith, marks)):
            yield rest


_VECTORS = {"f": "force", "m": "moment"}
_PARTS = ("head.c", "sin_cos.c", "arc.c", "condition.c", "correct.c", "selftest.c")
_BESIDE = ("elastocal_model.h", "selftest_main.c", "CMakeLists.txt", "README.md")
_FUNCTIONS = {
    "atan2": "arc({}, {})",
    "fabs": "fabs({})",
    "min": "({0} < {1}) ? {0} : {1}",
    "max": "({0} < {1}) ? {1} : {0}",
    "quotient": "{} / {}",
}
"""C functions for those in statements: comparisons compile to one instruction, without a branch."""
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
    remembers, grown = bool(numbers.deflection.memory), numbers.growth is not None
    constants = constants_of(numbers)
    data = selftest_tables(numbers)
    mixing = "\n".join(line for constant in constants for line in constant.mixing())
    values |= data | {"MIXING": mixing, "CHECKSUM": str(checksum(constants))}
    linked = numbers.links is not None
    head, sin_cos, arc, condition, correct, selftest = (
        filled(part, values, remembers, grown, linked=linked) for part in _PARTS
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
    built = numbers.arm_error is not None
    beside = {name: filled(name, values, remembers, grown, built, linked) for name in _BESIDE}
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
    median, encoders = numbers.filters.median, numbers.settings.encoders.joints
    return {
        "ENCODERS": str(len(encoders)),
        "ENCODER_NAMES": "\n".join(f" *   {k}  {remark(n)}" for k, n in enumerate(encoders)),
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
        "OFFSET_MM": f"{1e3 * limits.offset:g}",
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
            *_growth(numbers),
            *_arm_error(numbers),
            *begins,
            _function(total, numbers.deflection, deflection, inputs, joints),
            _function(columns, of_block, block, inputs, joints),
            *_yielding(numbers, load),
        )
    )


def _yielding(numbers: Design, load: str) -> Iterator[str]:
    """Yield the function of what joints with a secondary encoder yield, where there are any."""
    if numbers.links is not None:
        kept = ",\n    const double memory[ELASTOCAL_MEMORY]" if numbers.links.memory else ""
        yield "/* What joints with an encoder yield, then what a unit of each moves the tool by. */"
        head = f"static void yielding({load}{kept}, double out[])"
        outputs = [f"out[{i}]" for i in range(len(numbers.links.outputs))]
        inputs = ("q", "force", "moment")
        yield _function(head, numbers.links, outputs, inputs, numbers.joints)


def _growth(numbers: Design) -> Iterator[str]:
    """Yield the function of how far the arm has grown, where that is known."""
    if numbers.growth is not None:
        yield "/* How far the warm arm has grown, base, m. */"
        head = "static void growth(const double q[], double shift[3])"
        outputs = [f"shift[{i}]" for i in range(3)]
        yield _function(head, numbers.growth, outputs, ("q",), numbers.joints)


def _arm_error(numbers: Design) -> Iterator[str]:
    """Yield the function of the unloaded tool's error, where the geometry is known."""
    if numbers.arm_error is not None:
        head = "void elastocal_arm_error(const double q[], double error[3])"
        outputs = [f"error[{i}]" for i in range(3)]
        yield _function(head, numbers.arm_error, outputs, ("q",), numbers.joints)


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


_LOADS = 8
_SEED = 20240623
_MOST_TIMES = 400
_DIRECTIONS = 20
_AGREEMENT = 1e-9
"""Largest difference between statements and model, relative; round-off is some 1e-14."""


def selftest_tables(numbers: Design) -> dict[str, str]:
    """Return the self-test's tables as C, by the names of their places.

    Raises
    ------
    CompensationError
        If the statements that are to be exported do not agree with the model.
    """
    exported, model = numbers.functions(), _from_model(numbers)
    loads = _load_cases(numbers, model)
    memory = model.rest(loads[0].q)
    for load in loads:
        memory = _check_statements(exported, model, load, memory)
    course = _episodes(numbers, model)
    load_rows = [_struct(*load) for load in loads]
    episode_rows = [_episode_row(episode) for episode in course]
    return {
        "LOADS": str(len(loads)),
        "LOAD_DATA": ",\n".join(f"    {row}" for row in load_rows),
        "EPISODES": str(len(course)),
        "EPISODE_DATA": ",\n".join(f"    {row}" for row in episode_rows),
    }


class _LoadCase(NamedTuple):
    """A load with its deflection, in the order of the C struct."""

    q: list[float]
    force: list[float]
    moment: list[float]
    deflection: tuple[float, ...]
    half_width: float


class _Course(Enum):
    """Event of a course before a reading; the C has the same numbers."""

    GOES_ON = 0
    BEGINS = 1
    ENDS = 2
    ZEROES = 3


class _Stretch(NamedTuple):
    """A reading that comes some times in a row."""

    times: int
    reading: Reading
    """Its time is added to the course's clock. One of all numbers at most is a NaN or infinite."""
    course: _Course = _Course.GOES_ON
    deviation: tuple[float, ...] = (0.0, 0.0, 0.0)
    """At the beginning of a course, beyond what is predicted before it has been played, in m."""


@dataclass(frozen=True)
class _Episode:
    """A stretch with its last correction."""

    stretch: _Stretch
    correction: tuple[float, ...]
    status: int
    encoders: int


def _from_model(numbers: Design) -> ModelFunctions:
    """Return the functions that a compensator needs, answered by the model itself."""
    calibrated, state = numbers.calibrated, numbers.state
    model, c = calibrated.model, calibrated.compliance
    growth = None if state is None else lambda q: _floats(state.shift(model.robot, q))
    if len(model.friction):
        remembering = _Remembering(model, c)
        return ModelFunctions(
            orientation=lambda q: _floats(model.robot.forward(q)[:3, :3]),
            rest=remembering.rest,
            deflection=remembering.deflection,
            block=remembering.block,
            growth=growth,
            links=None if numbers.links is None else partial(_links_of, numbers, remembering),
        )
    return ModelFunctions(
        orientation=lambda q: _floats(model.robot.forward(q)[:3, :3]),
        rest=lambda _: (),
        deflection=lambda q, force, moment: _floats(model.deflection(c, q, force, moment)),
        block=lambda q, force, moment: _floats(model.observation_blocks(q, force, moment)),
        growth=growth,
        links=None if numbers.links is None else partial(_links_of, numbers, None),
    )


def _links_of(
    numbers: Design, remembering: "_Remembering | None", q: Sequence[float], *given: Sequence[float]
) -> tuple[float, ...]:
    """Return what joints with encoders yield, and their Jacobian, from the model."""
    calibrated, force, moment = numbers.calibrated, given[0], given[1]
    model, posed, friction = calibrated.model, calibrated.model.at(q), None
    if remembering is not None:
        friction, _ = remembering.loaded(q, *given)
    known = {zero.joint: zero for zero in calibrated.encoders}
    yields = model.joint_blocks(posed, force, moment, friction) @ calibrated.compliance
    seen, J = [], model.robot.jacobian(q).translation
    own = [model.robot.joint_names.index(joint) for joint in numbers.settings.encoders.joints]
    for joint in own:
        zero = known[model.robot.joint_names[joint]]
        waves = zero.sine * math.sin(q[joint]) + zero.cosine * math.cos(q[joint])
        seen.append(zero.offset + zero.weight * posed.joint_weight[joint] + waves + yields[joint])
    return (*map(float, seen), *_floats(J[:, own].T))


@dataclass(frozen=True, eq=False)
class _Remembering:
    """A model with friction, its memory moved on by `FrictionElements.path`."""

    model: ElasticModel
    compliance: FloatArray

    @property
    def _axes(self) -> list[int]:
        """The axes with friction, in the order of the memory."""
        return list(dict.fromkeys(self.model.friction.axis.tolist()))

    def rest(self, q: Sequence[float]) -> tuple[float, ...]:
        weight = self.model.weight_torques(q)
        still, here = -weight[self.model.friction.axis], weight[self._axes]
        return _floats(np.concatenate([still, here, here, np.zeros(len(here))]))

    def deflection(self, q: Sequence[float], *given: Sequence[float]) -> tuple[float, ...]:
        force, moment, _ = given
        friction_torque, after = self.loaded(q, *given)
        found = self.model.deflection(self.compliance, q, force, moment, friction=friction_torque)
        return (*_floats(found), *after)

    def block(self, q: Sequence[float], *given: Sequence[float]) -> tuple[float, ...]:
        force, moment, _ = given
        friction_torque, after = self.loaded(q, *given)

        # Each friction element alone moves the deflection by the torque that it may bear.
        limit, axes = self.model.friction.limit, self._axes
        low, high = np.reshape(after[len(limit) : len(limit) + 2 * len(axes)], (2, -1))
        spanned = dict(zip(axes, high - low, strict=True))
        ranges = np.array([spanned[axis] for axis in self.model.friction.axis.tolist()])
        found = self.model.observation_blocks(q, force, moment, friction=friction_torque)
        unknown = self._turned(q, 0.5 * np.clip(2.0 * limit - ranges, 0.0, limit))
        return (*_floats(found), *_floats(2.0 * unknown), *after)

    def _turned(self, q: Sequence[float], friction_torque: FloatArray) -> FloatArray:
        """Return the sum of the norms by which friction elements alone move an unloaded tcp."""
        model, moved = self.model, np.zeros(3)
        J = model.spring_jacobian(q).translation
        counts = [(len(s.axes), len(s.friction_limits), len(s.parameters)) for s in model.springs]
        starts = np.cumsum([(0, 0, 0), *counts], axis=0)
        for spring, (axis, element, parameter), (axes, elements, parameters) in zip(
            model.springs, starts, counts, strict=False
        ):
            still = (np.zeros(()),) * axes
            for one in np.diag(friction_torque[element : element + elements]):
                angles = np.array(spring.angles(SpringLoad(still, (), tuple(map(np.asarray, one)))))
                turned = angles @ self.compliance[parameter : parameter + parameters]
                moved += np.abs(J[:, axis : axis + axes] @ turned)
        return moved

    def loaded(
        self,
        q: Sequence[float],
        force: Sequence[float],
        moment: Sequence[float],
        memory: Sequence[float],
    ) -> tuple[FloatArray, tuple[float, ...]]:
        """Return the torques of the elements under a load, and the memory after it."""
        model, n, axes = self.model, len(self.model.friction), self._axes
        load = model.load_torques(q, force, moment)
        total = load + model.weight_torques(q)
        way = np.stack([np.zeros_like(total), total])
        friction_torque = model.friction.path(way, np.array(memory[:n]))[1]
        low, high = np.reshape(memory[n : n + 2 * len(axes)], (2, -1))
        seen = total[axes]
        kept = (
            friction_torque - total[model.friction.axis],
            np.minimum(low, seen),
            np.maximum(high, seen),
            load[axes],
        )
        return friction_torque, _floats(np.concatenate(kept))


def _floats(array: FloatArray) -> tuple[float, ...]:
    return tuple(array.ravel().tolist())


def _check_statements(
    exported: ModelFunctions, model: ModelFunctions, load: _LoadCase, memory: tuple[float, ...]
) -> tuple[float, ...]:
    """Refuse statements that give something else than the model; return the memory after a load."""
    given = (load.q, load.force, load.moment, *([memory] if memory else []))
    found, block = exported.deflection(*given), exported.block(*given)
    expected, expected_block = model.deflection(*given), model.block(*given)
    size = len(expected_block) - (3 + len(memory) if memory else 0)
    compared = [
        ("orientation", exported.orientation(load.q), model.orientation(load.q)),
        ("deflection", found[:3], expected[:3]),
        ("observation block", block[:size], expected_block[:size]),
    ]
    if exported.links is not None and model.links is not None:
        compared.append(("yield of joints", exported.links(*given), model.links(*given)))
    if exported.growth is not None and model.growth is not None:
        compared.append(("growth", exported.growth(load.q), model.growth(load.q)))
    if memory:
        compared += [
            ("unknown friction", block[size : size + 3], expected_block[size : size + 3]),
            ("memory of friction", found[3:], expected[3:]),
            ("memory of friction", block[size + 3 :], expected[3:]),
            ("free memory of friction", exported.rest(load.q), model.rest(load.q)),
        ]
    for what, got, wanted in compared:
        off = np.abs(np.subtract(got, wanted)).max() / max(np.abs(wanted).max(), 1e-300)
        if not off <= _AGREEMENT:
            raise CompensationError(
                f"the {what} that would be exported differs from the model's by {off:.1e} of its"
                f" size, more than {_AGREEMENT:g}: nothing is written"
            )
    return expected[3:]


def _load_cases(numbers: Design, model: ModelFunctions) -> list[_LoadCase]:
    """Return random loads, one after the other as friction remembers them, and deflections."""
    rng = np.random.default_rng(_SEED)
    cases = []
    configurations = _configurations(numbers, rng, _LOADS).tolist()
    memory, size = model.rest(configurations[0]), 3 * len(numbers.spread)
    for q in configurations:
        force, moment = rng.normal(0.0, 800.0, 3).tolist(), rng.normal(0.0, 80.0, 3).tolist()
        given = (q, force, moment, *([memory] if memory else []))
        block, deflection = model.block(*given), model.deflection(*given)
        rows = np.reshape(block[:size], (3, -1)) @ numbers.spread
        widths = np.sqrt((rows**2).sum(axis=1)) + (block[size : size + 3] if memory else 0.0)
        memory = deflection[3:]
        cases.append(_LoadCase(q, force, moment, deflection[:3], float(widths.max())))
    return cases


def _episodes(numbers: Design, model: ModelFunctions) -> list[_Episode]:
    """Return a course that passes through every branch of the step.

    Loads that make a deflection within the deadband, a middle one and more than the limit;
    readings that fail until the correction fades; readings beyond the range, a good one, one from
    a clock that was set back, and good ones again; readings with a NaN or an infinity in every
    place, between good ones.
    """
    rng = np.random.default_rng(_SEED + 1)
    limits, settings = numbers.settings.limits, numbers.settings
    configurations = _configurations(numbers, rng, 3).tolist()
    small = max(1.5 * settings.deadband, 0.05 * limits.correction)
    sizes = (small, 0.5 * limits.correction, 1.5 * limits.correction)
    first, middle, large = (
        _reading(numbers, q, size, rng) for q, size in zip(configurations, sizes, strict=True)
    )
    arriving = min(_MOST_TIMES, int(2.0 * limits.correction / numbers.largest_step) + 60)
    course = [
        *(_Stretch(times, reading) for reading in (first, middle) for times in (1, 2, 5)),
        _Stretch(arriving, large),
        _Stretch(settings.hold_cycles, middle._replace(ok=False)),
        _Stretch(3, middle._replace(force=[2.0 * x for x in settings.sensor.force])),
        _Stretch(1, large),
        _Stretch(1, middle._replace(time=-1e3)),
        _Stretch(2, middle),
        _Stretch(4, middle),
        *_without_numbers(middle),
        *_courses(numbers, first),
        *_free_motion(numbers, (first, large)),
        *_encoders(numbers, model, (first, middle)),
    ]
    return _played(Compensator(numbers, model), course)


def _courses(numbers: Design, light: Reading) -> list[_Stretch]:
    """Return courses whose offset is taken, refused for each reason, and gone."""
    limit, still = numbers.settings.limits.offset, light._replace(ok=False)
    part = [
        (0.5 * limit, -0.3 * limit, 0.2 * limit),
        (1.5 * limit, 0.0, 0.0),
        (math.nan, 0.0, 0.0),
        (0.0, 0.0, -math.inf),
        (0.1 * limit, 0.2 * limit, -0.3 * limit),
    ]
    begun = [_Stretch(20, light, _Course.BEGINS, each) for each in part]
    return [_Stretch(40, light), *begun, _Stretch(2, still), *begun[:1],
            _Stretch(20, light, _Course.ENDS)]  # fmt: skip


def _encoders(
    numbers: Design, model: ModelFunctions, readings: tuple[Reading, Reading]
) -> list[_Stretch]:
    """Return readings of links before and after they were zeroed, and one that fails."""
    if numbers.links is None or model.links is None:
        return []
    names, joints = numbers.calibrated.model.robot.joint_names, numbers.settings.encoders.joints
    course = []
    for event, reading, beyond in (
        (_Course.GOES_ON, readings[0], 2e-4),
        (_Course.ZEROES, readings[0], 5e-4),
        (_Course.GOES_ON, readings[1], -3e-4),
    ):
        q = reading.q
        links = [q[names.index(joint)] + beyond * k for k, joint in enumerate(joints, start=1)]
        course.append(_Stretch(20, reading._replace(links=links), event))
    wrong = course[-1].reading._replace(links=[1e4] * len(joints))
    return [*course, _Stretch(2, wrong), course[-1]]


def _without_numbers(good: Reading) -> list[_Stretch]:
    """Return readings with a NaN or an infinity, each followed by one that is good."""
    course = []
    for bad in (math.nan, math.inf, -math.inf):
        for spoilt in (
            good._replace(time=bad),
            good._replace(q=[*good.q[:-1], bad]),
            good._replace(force=[*good.force[:-1], bad]),
            good._replace(moment=[bad, *good.moment[1:]]),
        ):
            course += [_Stretch(1, spoilt), _Stretch(2, good)]
    return course


def _free_motion(numbers: Design, pressed: tuple[Reading, Reading]) -> list[_Stretch]:
    """Return presses before, within and after a motion in the air."""
    if not numbers.light_loads:
        return []
    first, large = pressed
    R = numbers.calibrated.model.robot.forward(first.q)[:3, :3]
    raw = _raw(numbers, np.zeros(6), R)
    air = first._replace(force=raw[:3].tolist(), moment=raw[3:].tolist())
    free = min(_MOST_TIMES, numbers.settings.free_cycles + 60)
    way = (3, first), (5, large), (5, first), (5, air), (5, first), (free, air), (5, first)
    return [_Stretch(*each) for each in way]


def _played(compensator: Compensator, course: list[_Stretch]) -> list[_Episode]:
    state, clock, played = compensator.start(), 0.0, []
    robot, grows = compensator.design.calibrated.model.robot, compensator.design.state
    for stretch in course:
        reading = stretch.reading
        if stretch.course is _Course.BEGINS:
            grown = np.zeros(3) if grows is None else grows.shift(robot, reading.q)
            known = np.array(state.deflection) + grown
            stretch = stretch._replace(deviation=_floats(known + stretch.deviation))
            state = compensator.begin_course(state, reading.q, stretch.deviation)
        if stretch.course is _Course.ENDS:
            state = compensator.end_course(state)
        if stretch.course is _Course.ZEROES:
            state = compensator.zero_encoders(state)
        for _ in range(stretch.times):
            clock += compensator.design.filters.sample
            state, corrected = compensator.step(state, reading._replace(time=reading.time + clock))
        encoders = len(compensator.design.settings.encoders.joints)
        played.append(_Episode(stretch, corrected.correction, corrected.status, encoders))
    return played


def _reading(numbers: Design, q: list[float], size: float, rng: Generator) -> Reading:
    """Return a raw reading whose load makes a deflection of a size, in m.

    Where the sensor's range does not allow so much, of the most that it allows.
    """
    model, R = numbers.calibrated.model, numbers.calibrated.model.robot.forward(q)[:3, :3]
    wrenches = rng.normal(size=(_DIRECTIONS, 6)) * [1.0, 1.0, 1.0, 0.03, 0.03, 0.03]
    turned = wrenches[:, :3] @ R.T, wrenches[:, 3:] @ R.T
    made = model.deflection(numbers.calibrated.compliance, np.array([q] * _DIRECTIONS), *turned)
    lengths = np.maximum(np.linalg.norm(made, axis=1), 1e-12)
    # The softest direction needs the least force.
    best = int(np.argmax(lengths / np.linalg.norm(wrenches[:, :3], axis=1)))
    wrench = wrenches[best] * (size / lengths[best])
    settings = numbers.settings.sensor
    within = 0.9 * np.array([*settings.force, *settings.moment])
    for _ in range(60):
        raw = _raw(numbers, wrench, R)
        if np.all(np.abs(raw) < within):
            break
        wrench = 0.8 * wrench
    return Reading(0.0, q, raw[:3].tolist(), raw[3:].tolist())


def _raw(numbers: Design, wrench: FloatArray, R_base_tcp: FloatArray) -> FloatArray:
    """Return the sensor's reading of a wrench in the tcp frame: the conditioner backwards."""
    f, m = wrench[:3], wrench[3:]
    at_sensor = np.concatenate([f, m - np.cross(numbers.sensor_origin, f)])
    weight = numbers.weight_response @ (numbers.gravity @ R_base_tcp)
    bias = np.concatenate([numbers.load.force_bias, numbers.load.moment_bias])
    raw: FloatArray = np.linalg.solve(numbers.sensor_matrix, at_sensor + weight) + bias
    return raw


def _configurations(numbers: Design, rng: Generator, count: int) -> FloatArray:
    limits = numbers.calibrated.model.robot.limits
    lower, upper = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    return rng.uniform(lower, upper, (count, numbers.joints))


def _episode_row(episode: _Episode) -> str:
    """Return an episode as C: what is no number as its place in the reading, and its bits."""
    stretch, reading = episode.stretch, episode.stretch.reading
    numbers = [reading.time, *reading.q, *reading.force, *reading.moment, *stretch.deviation]
    spoilt = [(place, x) for place, x in enumerate(numbers, start=1) if not math.isfinite(x)]
    place, bad = spoilt[0] if spoilt else (0, 0.0)
    (bits,) = struct.unpack("<Q", struct.pack("<d", bad))
    time, q, force, moment, deviation = (
        [x if math.isfinite(x) else 0.0 for x in part]
        for part in ([reading.time], reading.q, reading.force, reading.moment, stretch.deviation)
    )
    read = reading.links is not None
    links = [*(reading.links or [0.0] * episode.encoders)]
    return _struct(
        str(stretch.times),
        _struct(
            *(time[0], q, force, moment, str(int(reading.ok))),
            *((links, str(int(read))) if episode.encoders else ()),
        ),
        str(stretch.course.value),
        deviation,
        str(place),
        f"UINT64_C(0x{bits:016X})",
        episode.correction,
        f"{episode.status}U",
    )


def _struct(*parts: str | float | Sequence[float]) -> str:
    """Return a C initializer; text goes in as it is."""
    return "{" + ",\n     ".join(map(_literal, parts)) + "}"


def _literal(part: str | float | Sequence[float]) -> str:
    if isinstance(part, str):
        return part
    if isinstance(part, Sequence):
        return "{" + ", ".join(repr(float(x)) for x in part) + "}"
    return repr(float(part))
