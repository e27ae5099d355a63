"""Quantities and counts for people, and phrases that can be translated."""

import math
from collections.abc import Mapping, Sequence

_READABLE = {
    "m": (1e3, " mm"),
    "rad": (180.0 / math.pi, "°"),
    "N*m": (1.0, " N·m"),
    "1": (1.0, ""),
    "": (1.0, ""),
}


class Phrase(str):
    """A text that remembers how it was made, so that it can be said in another language.

    It is its English text; whatever takes a string takes a phrase. Make one with `phrase`.
    """

    template: str
    """English, with names of values in braces; empty where it is not known how it was made."""
    parts: Mapping[str, object]
    """Values by name; phrases among them are translated, too."""

    def __str__(self) -> str:
        # Or `str` would forget how the text was made.
        return self


def phrase(template: str, **values: object) -> Phrase:
    """Return a text with values in it.

    >>> phrase("the largest with {error}", error=mm(0.000109))
    'the largest with 0.109 mm'
    """
    made = Phrase(template.format(**values) if values else template)
    made.template, made.parts = template, values
    return made


def phrases(*templates: str) -> tuple[Phrase, ...]:
    """Return texts without values, such as the heads of a table."""
    return tuple(map(phrase, templates))


def in_words(name: str) -> Phrase:
    """Return a name of a file or an option as words for a reader.

    >>> in_words("joint_limits")
    'joint limits'
    """
    return phrase(name.replace("_", " "))


def sentences(texts: Sequence[str], between: str = " ") -> Phrase:
    """Return texts one after the other as one phrase.

    >>> sentences(["One.", "Two."])
    'One. Two.'
    """
    named = {f"_{number}": text for number, text in enumerate(texts)}
    return phrase(between.join(f"{{{name}}}" for name in named), **named)


def readable(value: float, unit: str) -> str:
    """Return an SI value in its usual unit, with three digits.

    >>> readable(0.0123, "m"), readable(0.5, "rad"), readable(1234.0, "N"), readable(0.25, "1")
    ('12.3 mm', '28.6°', '1234 N', '0.25')
    >>> readable(math.inf, "m")
    'no limit'
    """
    if math.isinf(value):
        return phrase("no limit")
    scale, name = _READABLE.get(unit, (1.0, f" {unit}"))
    return f"{_three_digits(value * scale)}{name}"


def plainly(value: object, unit: str = "") -> str:
    """Return a value of a JSON-ready record in words, numbers with their unit.

    >>> plainly(["normal", "north"]), plainly([0, 1, 2, 5]), plainly([]), plainly(True)
    ('normal, north', '0 to 2, 5', 'none', 'yes')
    >>> plainly({"ok": 150, "slipped": 0}), plainly(None), plainly(0.1738763047742587, "m")
    ('ok 150, slipped 0', 'none', '174 mm')
    """
    if value is None or (isinstance(value, Sequence | Mapping) and not value):
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return listed([f"{name} {plainly(each, unit)}" for name, each in value.items()])
    if isinstance(value, list | tuple):
        whole = [each for each in value if isinstance(each, int)]
        return (
            spans(whole)
            if len(whole) == len(value)
            else listed([plainly(each, unit) for each in value])
        )
    return readable(value, unit) if isinstance(value, float) else str(value)


def plus_minus(value: float, half: float) -> tuple[str, str]:
    """Return a value and its half width, both to the second digit of the half width.

    >>> plus_minus(60.02031521, 0.0317), plus_minus(1234.5, 210.0), plus_minus(0.5, 0.0)
    (('60.020', '0.032'), ('1234', '210'), ('0.5', '0'))
    """
    if not (half > 0.0 and math.isfinite(half)):
        return _three_digits(value), _three_digits(half)
    digits = max(0, 1 - math.floor(math.log10(half)))
    return f"{value:.{digits}f}", f"{half:.{digits}f}"


def millimetres(point: tuple[float, float, float]) -> str:
    """Return a point in mm.

    >>> millimetres((1.2345, -0.5, 0.0))
    '1234.5, -500.0, 0.0'
    """
    return ", ".join(f"{1e3 * value + 0.0:.1f}" for value in point)


def duration(seconds: float) -> str:
    """Return a time span.

    >>> duration(42.4), duration(1300.0), duration(7322.0)
    ('42 s', '21 min 40 s', '2 h 02 min')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def _three_digits(value: float) -> str:
    """Return at least three significant digits, without an exponent for everyday sizes."""
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        # A number near the largest is beyond it in a smaller unit.
        return str(value)
    digits = 2 - math.floor(math.log10(abs(value)))
    if digits > 6:
        return f"{value:.2e}"
    text = f"{value:.{max(0, digits)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def lengths_with_interval(
    value: float | None, low: float | None, high: float | None
) -> tuple[str, str]:
    """Return a length and its interval in mm; a lone number where it has none.

    >>> lengths_with_interval(0.00012, 0.0001, 0.0002), lengths_with_interval(None, None, None)
    (('0.120 mm', '0.100 to 0.200'), ('not known', ''))
    """
    if value is None:
        return phrase("not known"), ""
    if low is None or high is None:
        return mm(value), ""
    return mm(value), phrase("{low} to {high}", low=f"{1e3 * low:.3f}", high=f"{1e3 * high:.3f}")


def mm(metres: float, digits: int = 3) -> str:
    """Return a length in mm.

    >>> mm(0.0001234)
    '0.123 mm'
    """
    return f"{1e3 * metres:.{digits}f} mm" if math.isfinite(metres) else phrase("not known")


def um(metres: float) -> str:
    """Return a length in µm.

    >>> um(17.2e-6)
    '17.2 µm'
    """
    return f"{1e6 * metres:.1f} µm"


def springs_and_parameters(springs: int, parameters: int) -> str:
    """Return a number of springs, with that of their parameters where it is another.

    >>> springs_and_parameters(6, 6), springs_and_parameters(9, 11)
    ('6 springs', '9 springs with 11 parameters')
    """
    return counted(springs, "spring") + (
        f" with {counted(parameters, 'parameter')}" if parameters != springs else ""
    )


def counted(number: int, name: str) -> str:
    """Return a number with its noun, as a phrase.

    >>> counted(1, "pose"), counted(3, "pose")
    ('1 pose', '3 poses')
    """
    return phrase(f"{{number}} {name}{'' if number == 1 else 's'}", number=number)


def one_of(names: Sequence[str]) -> str:
    """Return one or two names of which one holds; a text stays as it is.

    >>> one_of(["kN"]), one_of(["kgf", "lbf"]), one_of("kgf or lbf")
    ('kN', 'kgf or lbf', 'kgf or lbf')
    """
    if isinstance(names, str):
        return names
    return phrase("{one} or {other}", one=names[0], other=names[1]) if names[1:] else names[0]


def listed(names: Sequence[str], most: int = 30) -> str:
    """Return names, the first of them where there are too many to read.

    >>> listed(["a", "b"]), listed(["a", "b", "c", "d"], most=2)
    ('a, b', 'a, b and 2 more')
    """
    left = len(names) - most
    shown = ", ".join(names[:most])
    return phrase("{names} and {left} more", names=shown, left=left) if left > 0 else shown


def point(values: Sequence[float | None], scale: float = 1e3, digits: int = 1) -> str:
    """Return coordinates, in mm unless scaled otherwise.

    >>> point([0.1, 0.0, -0.0905])
    '100.0, 0.0, -90.5'
    """
    return ", ".join(
        "?" if v is None else f"{round(scale * v, digits) + 0.0:.{digits}f}" for v in values
    )


def spans(numbers: Sequence[int]) -> str:
    """Return whole numbers with runs shortened.

    >>> spans([0, 1, 2, 5])
    '0 to 2, 5'
    """
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = [
        phrase("{low} to {high}", low=run[0], high=run[-1])
        if len(run) > 2
        else ", ".join(map(str, run))
        for run in runs
    ]
    return sentences(texts, ", ")
