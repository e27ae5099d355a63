"""The constants of the C file: in one list, so that the self-test can sum them up."""

import string
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.kernel import Call
from elastocal.compensation.online import JOINT_RANGE, LONG_AGO, MOST_BEYOND, Design

_FNV_START, _FNV_PRIME = 14695981039346656037, 1099511628211
"""FNV-1a, 64 bits (Fowler, Noll and Vo)."""
_INDENT = " " * 4
_COUNTS = ("JOINTS", "SPRINGS", "SECTIONS", "MEDIAN", "MEMORY", "ENCODERS")
_ARC = (
    -0.3333333333333325,
    0.19999999999898407,
    -0.1428571426609662,
    0.11111109636534361,
    -0.09090852557176049,
    0.0769105515839315,
    -0.06649613695291669,
    0.05736332165907643,
    -0.04483334622272886,
    0.02275052699336167,
)
"""``(atan(t) / t - 1) / t^2`` in powers of ``t^2``, interpolated at the ten Chebyshev nodes of
``t <= tan(pi / 8)``: wrong by 1.3e-16 at most."""


@dataclass(frozen=True, eq=False)
class Constant:
    """A constant of the C file."""

    name: str
    numbers: FloatArray
    """Shape () for one number, (n,) or (n, m) for an array."""
    comment: str = ""
    whole: bool = False
    """Whether it is an ``int`` in C."""
    in_header: bool = False
    """Whether the header defines it; the C file then has no definition of it."""

    def definition(self) -> str:
        """Return its C definition."""
        kind = "int" if self.whole else "double"
        extents = "".join(f"[{extent}]" for extent in self.numbers.shape)
        comment = f" /* {remark(self.comment)} */" if self.comment else ""
        if self.numbers.ndim == 0:
            return f"static const {kind} {self.name} = {self._literal(self.numbers)};{comment}"
        rows = self.numbers if self.numbers.ndim == 2 else self.numbers[None]
        texts = [", ".join(self._literal(x) for x in row) for row in rows]
        if self.numbers.ndim == 2:
            texts = [f"{{{text}}}" for text in texts]
        body = "\n".join("\n".join(wrap(text, 96)) + "," for text in texts)[:-1]
        indented = "\n".join(f"    {line}" for line in body.splitlines())
        return f"static const {kind} {self.name}{extents} = {{{comment}\n{indented}\n}};"

    def mixing(self) -> list[str]:
        """Return the C statements that add it to the sum of constants."""
        cast = "(double)" if self.whole else ""
        loops = list(zip("ik", self.numbers.shape, strict=False))
        place = "".join(f"[{index}]" for index, _ in loops)
        return [
            *(
                f"{_INDENT * depth}for ({index} = 0; {index} < {extent}; {index}++) {{"
                for depth, (index, extent) in enumerate(loops, start=1)
            ),
            f"{_INDENT * (len(loops) + 1)}sum = mixed(sum, {cast}{self.name}{place});",
            *(f"{_INDENT * depth}}}" for depth in range(len(loops), 0, -1)),
        ]

    def _literal(self, number: np.floating | FloatArray) -> str:
        return str(int(number)) if self.whole else repr(float(number))


def checksum(constants: Sequence[Constant]) -> int:
    """Return FNV-1a over the bits of every number, in the order of the list."""
    total = _FNV_START
    for constant in constants:
        for number in constant.numbers.ravel().tolist():
            (bits,) = struct.unpack("<Q", struct.pack("<d", float(number)))
            total = ((total ^ bits) * _FNV_PRIME) % 2**64
    return total


def constants_of(numbers: Design) -> list[Constant]:
    """Return every constant of a compensator's C files, in the order of the self-test's sum."""
    return [
        *_header(numbers),
        *_trigonometry(),
        *(_arcs() if turns_arcs(numbers) else ()),
        *_model(numbers),
        *_conditioning(numbers),
        *_compensation(numbers),
        *(_friction(numbers) if numbers.deflection.memory else ()),
        *_encoders(numbers),
    ]


def _header(numbers: Design) -> list[Constant]:
    """Return the constants that the header defines: edited there, nothing would follow them."""
    filters = numbers.filters
    values = {
        "JOINTS": numbers.joints,
        "SPRINGS": len(numbers.calibrated.model.parameters),
        "SECTIONS": len(filters.sections),
        "MEDIAN": filters.median,
        "CYCLE": numbers.settings.cycle,
        "SAMPLE": filters.sample,
        "DELAY": float(filters.delay()),
    }
    if numbers.deflection.memory:
        values["MEMORY"] = len(numbers.deflection.memory)
    if numbers.links is not None:
        values["ENCODERS"] = len(numbers.settings.encoders.joints)
    return [
        Constant(f"ELASTOCAL_{name}", np.array(float(value)), whole=name in _COUNTS, in_header=True)
        for name, value in values.items()
    ]


def _one(name: str, number: float, comment: str = "", whole: bool = False) -> Constant:
    return Constant(name, np.array(float(number)), comment, whole)


def _trigonometry() -> list[Constant]:
    factorial = np.cumprod(np.arange(1.0, 18.0))
    signs = np.array([-1.0, 1.0] * 4)
    return [
        _one("TWO_BY_PI", 2.0 / np.pi),
        _one("ROUNDER", 1.5 * 2.0**52, "adding and subtracting it rounds to an integer"),
        Constant(
            "HALF_PI",
            np.array([1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21]),
            "pi/2, the first two of 33 and 32 bits",
        ),
        Constant("SINE", signs[:7] / factorial[2:16:2], "-1/3!, 1/5!, ..."),
        Constant("COSINE", signs / factorial[1:17:2], "-1/2!, 1/4!, ..."),
    ]


def turns_arcs(numbers: Design) -> bool:
    """Return whether a law of the model needs the angle of a point."""
    calls = [s for s in numbers.deflection.statements if isinstance(s, Call)]
    return any(call.function == "atan2" for call in calls)


def _arcs() -> list[Constant]:
    return [
        Constant("ARC", np.array(_ARC), "of the arc tangent"),
        _one("TAN_EIGHTH", np.sqrt(2.0) - 1.0, "of pi / 8"),
        _one("QUARTER_TURN", np.pi / 4.0),
        _one("SMALLEST", 1e-300, "keeps 0 / 0 away"),
    ]


def _friction(numbers: Design) -> list[Constant]:
    light = np.array(numbers.light_loads)
    return [
        _one("RUBBING", len(light), "gears with friction", whole=True),
        Constant("LIGHT", light, "loads below which the arm moves freely, N m"),
        _one("FREE_CYCLES", numbers.settings.free_cycles, whole=True),
    ]


def _encoders(numbers: Design) -> list[Constant]:
    """Return the constants of secondary encoders, where there are any."""
    if numbers.links is None or numbers.rest_spread is None:
        return []
    names, settings = numbers.calibrated.model.robot.joint_names, numbers.settings
    own = np.array([float(names.index(joint)) for joint in settings.encoders.joints])
    found = [
        Constant("ENCODER_JOINT", own, "numbers in q", whole=True),
        _one("ENCODER_SHARE", settings.encoder_share, "of a new reading"),
        _one(
            "MOST_BEYOND", MOST_BEYOND, "that a zeroed encoder may see beyond the model, rad or m"
        ),
        Constant("REST_SPREAD", numbers.rest_spread, "SPREAD of what encoders do not see"),
    ]
    if numbers.deflection.memory:
        found.append(_one("SEES_FRICTION", numbers.encoders_see_friction, whole=True))
    return found


def _model(numbers: Design) -> list[Constant]:
    """Return the numbers of the chain and the springs, by the names that the routines use."""
    comments = {
        f"compliance{i + 1}": f"{parameter.name}, {parameter.unit.si.replace('*', ' ')}"
        for i, parameter in enumerate(numbers.calibrated.model.parameters)
    }
    named = {
        **numbers.orientation.constants,
        **numbers.deflection.constants,
        **numbers.block.constants,
        **numbers.rest.constants,
        **(numbers.growth.constants if numbers.growth else {}),
        **(numbers.arm_error.constants if numbers.arm_error else {}),
        **(numbers.links.constants if numbers.links else {}),
    }
    return [
        *(_one(name.upper(), number, comments.get(name, "")) for name, number in named.items()),
        _one("DIRECTIONS", numbers.spread.shape[1], "of the bootstrap draws", whole=True),
        Constant("SPREAD", numbers.spread, "1.96 times a root of the draws' covariance"),
    ]


def _conditioning(numbers: Design) -> list[Constant]:
    load, settings = numbers.load, numbers.settings
    sections = np.array(numbers.filters.sections or [(1.0, 0.0, 0.0, 0.0, 0.0)])
    biases = np.concatenate([load.force_bias, load.moment_bias])
    return [
        Constant("BIAS", biases, "of the sensor, N and N m"),
        Constant("RANGE", np.array([*settings.sensor.force, *settings.sensor.moment])),
        Constant("SENSOR_MATRIX", numbers.sensor_matrix, "of readings without bias, tcp axes"),
        Constant("WEIGHT", numbers.weight_response, "of the tool by gravity, tcp axes, kg, kg m"),
        Constant("GRAVITY", numbers.gravity, "base, m/s^2"),
        Constant("ORIGIN", numbers.sensor_origin, "of the sensor, tcp frame, m"),
        Constant("SECTION", sections, "b0, b1, b2, a1, a2"),
        _one("LONGEST_GAP", settings.hold, "between readings, s"),
        _one("LONG_AGO", LONG_AGO, "s"),
        _one("JOINT_RANGE", JOINT_RANGE, "rad or m"),
    ]


def _compensation(numbers: Design) -> list[Constant]:
    settings = numbers.settings
    return [
        _one("FRAME_IS_TCP", numbers.in_tcp, whole=True),
        Constant("FRAME", numbers.frame.ravel(), "axes of the correction in base, by rows"),
        _one("GAIN", settings.gain),
        _one("DEADBAND", settings.deadband, "m"),
        _one("DEADBAND_SLOPE", numbers.deadband_slope, "1/m"),
        _one("LARGEST_CORRECTION", settings.limits.correction, "m"),
        _one("LARGEST_OFFSET", settings.limits.offset, "of a course, m"),
        _one("LARGEST_STEP", numbers.largest_step, "m in a cycle"),
        _one("FADE_STEP", numbers.fade_step, "m in a cycle"),
        _one("UNCERTAIN_ABOVE", settings.uncertain_above, "m"),
        _one("HOLD_CYCLES", settings.hold_cycles, whole=True),
        _one("TOLERANCE", 1e-10, "of the self-test, relative"),
    ]


_ALLOWED = set(string.ascii_letters + string.digits + " .,:;_-+()[]#'=<>%^/!")


def remark(text: str) -> str:
    """Return a text that cannot end a C comment or continue its line.

    >>> remark("arm */ int x;")
    'arm  / int x;'
    """
    return "".join(character if character in _ALLOWED else " " for character in text)
