"""Commands generated from settings: one parameter of the command line for each field.

The metadata of a field (`elastocal.options`) becomes a parameter of typer. Given values are passed
to the command by the names of the fields; the settings supply the defaults.
"""

import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from elastocal import plugins
from elastocal.cli import output
from elastocal.options import (
    CHOICES,
    OWN,
    REQUIRED,
    Option,
    SettingsField,
    settings_fields,
    summary_of,
)
from elastocal.results import brief_repr

if TYPE_CHECKING:
    from elastocal.blocks import Block

_NARROW = 20
"""Characters that help shows of what an option takes, where a terminal has 80 columns."""


@brief_repr
@dataclass(frozen=True)
class Given:
    """Values given to a command on the command line."""

    settings: dict[str, Any]
    """Fields of the settings, by name; only those that were given."""
    here: dict[str, Any]
    """Parameters of the command line alone, all of them."""
    as_json: bool


@brief_repr
@dataclass(frozen=True)
class Command:
    """A command of the program."""

    group: str
    """Group in which help lists it."""
    module: str
    """Module of its settings, and of the function whose docstring is the command's."""
    settings: str
    """Class of its settings in that module."""
    function: str
    """The function."""
    run: Callable[[Given], None]
    """Function that carries it out."""
    more: type | None = None
    """Class of the parameters that the command line alone has."""
    hidden: tuple[str, ...] = ()
    """Fields that its parameters replace in another form."""

    @property
    def summary(self) -> str:
        """Its line in the help."""
        return on_a_terminal(summary_of(self.module, self.function))

    def fields(self) -> list[SettingsField]:
        """Return the fields of its settings that can be given on the command line."""
        every = settings_fields(self.module, self.settings)
        return [each for each in every if each.name not in self.hidden and _is_shown(each)]

    def own_fields(self) -> tuple[SettingsField, ...]:
        """Return the fields that the command line alone has."""
        more = self.more
        return () if more is None else settings_fields(more.__module__, more.__name__)

    def shown(self) -> list[SettingsField]:
        """Return all parameters that can be given, in the order of help."""
        return [*_in_order(self.fields(), self.own_fields()), _AS_JSON]

    def callback(self) -> Callable[..., None]:
        """Return the function that typer makes a command of."""
        fields, here = self.fields(), self.own_fields()
        made = [_parameter(each) for each in self.shown()]

        def call(**given: Any) -> None:
            as_json = given.pop("as_json")
            read = {
                each.name: value
                for each in fields
                if (value := _read(each, given[each.name])) is not None
            }
            own = {each.name: _read(each, given[each.name]) for each in here}
            self.run(Given(read, own, as_json))

        call.__doc__ = self.summary
        call.__signature__ = inspect.Signature(made)  # type: ignore[attr-defined]
        call.__annotations__ = {each.name: each.annotation for each in made}
        return call


OTHERS = "Of other packages"
"""Group in which help lists commands of plug-ins."""


def plugged(name: str) -> Command:
    """Return a command of another package; a field without a default is given by its place.

    Raises
    ------
    PluginError
        If it cannot be used.
    """
    found: plugins.Command[Any] = plugins.load("command", name)

    def run(given: Given) -> None:
        with _page_of(given, name) as write:
            settings = found.settings(**given.settings)
            result = plugins.used("command", name, lambda: found.run(settings))
            shown = plugins.used("command", name, lambda: tuple(found.show(result)))
            if given.as_json:
                output.print_json(result)
            else:
                output.print_blocks(output.console(), shown)
            write(shown)

    settings = found.settings
    made = _Plugged(OTHERS, settings.__module__, settings.__name__, settings.__name__, run, _Page)
    plugins.used("command", name, made.callback)  # what cannot be read of its settings is said now
    return made


@dataclass(frozen=True)
class _Page:
    page: Path | None = None
    """Write a page (.html) that shows the result."""
    page_language: Annotated[str, Option(choices="page language")] = "en"
    """Language of that page."""


@contextmanager
def _page_of(given: Given, name: str) -> Iterator[Callable[[Iterable["Block"]], None]]:
    """Yield what writes the page that was asked for, in a place where nothing else is replaced."""
    path, code = given.here["page"], given.here["page_language"]
    if path is None:
        yield lambda _: None
        return
    from elastocal.files import require_place
    from elastocal.outputs import OutputRule, ruled
    from elastocal.report import language_of
    from elastocal.report.document import write_page

    language, maker = language_of(code), f"elastocal {name}"
    require_place(path)
    inputs = [each for each in given.settings.values() if isinstance(each, Path)]
    with ruled(OutputRule(marks=(f'content="{maker}"',), has_force=False), inputs, [path]):
        yield lambda shown: _written(
            write_page(path, name, [("result", name, shown)], language, maker=maker)
        )


def _written(path: Path) -> None:
    output.console().print(f"written to {output.bold(path)}", soft_wrap=True)


class _Plugged(Command):
    """Command of another package, described by its settings."""

    def fields(self) -> list[SettingsField]:
        """Return the fields; required ones keep their position."""
        return [
            replace(each, option=replace(each.option, argument=True))
            if each.default is REQUIRED
            else each
            for each in super().fields()
        ]


_AS_JSON = SettingsField(
    "as_json", "bool", False, "Print the result as one JSON object.", Option("--json")
)


def _in_order(
    fields: Iterable[SettingsField], here: Iterable[SettingsField]
) -> list[SettingsField]:
    """Return fields in the order of help: positional, required, optional."""

    def place(each: SettingsField) -> tuple[bool, bool, bool]:
        # What guards files is read last.
        guards = each.name == "force" and each.kind == "bool"
        return guards, not each.option.argument, not _is_required(each)

    return sorted((*fields, *here), key=place)


def _is_required(each: SettingsField) -> bool:
    return each.default is REQUIRED or each.option.required


@dataclass(frozen=True)
class Described:
    """A field as help and the reference show it."""

    text: str
    """Description, and the choices if `taken` does not show them."""
    taken: str
    """Placeholder for its value; empty if the type suffices."""
    kind: type
    """Type that is read from the command line."""
    is_repeated: bool
    """Whether it may be given several times."""
    default: Any
    """`REQUIRED`; None where the settings have it and the text says which."""


def on_a_terminal(text: str) -> str:
    """Return a docstring's text without the marks of code, which a terminal does not set apart."""
    return text.replace("``", "")


def described(each: SettingsField) -> Described:
    """Return the text on a field in help and the reference."""
    option = each.option
    text, taken = option.help or each.doc, option.metavar
    names = CHOICES.get(option.choices)
    if names:
        taken = f"[{'|'.join(names)}]"
        if option.file or len(taken) > _NARROW:
            # Help would break it in the middle of a name.
            text += f" One of {', '.join(names)}{', or a .yaml file' if option.file else ''}."
            taken = "NAME|FILE" if option.file else "NAME"
    default: Any = option.default or _typed_default(each)
    if _is_required(each):
        default = REQUIRED
    return Described(text, taken, _type(each), _is_repeated(each), default)


def _typed_default(each: SettingsField) -> Any:
    """Return the default that a command line has, too; None where the settings alone have it."""
    # What is read from a text is no default of a text.
    if each.default in (REQUIRED, OWN) or each.option.required or each.option.read:
        return None
    return None if isinstance(each.default, tuple) else each.default


def _parameter(each: SettingsField) -> inspect.Parameter:
    """Return the parameter of a field."""
    option, shown = each.option, described(each)
    required, default = _is_required(each), _typed_default(each)
    help = on_a_terminal(shown.text)
    if option.default and not required:
        help = f"{help} [default: {option.default}]"
    # A bracket without the backslash would be a mark-up of rich's, and would not be printed.
    words: dict[str, Any] = {"help": help.replace("[", "\\[")}
    if shown.taken:
        words["metavar"] = shown.taken
    if option.choices:
        words["autocompletion"] = _completion(option.choices)
    if shown.kind in (int, float):
        words |= {"min": option.least, "max": option.most}
    if not required and not isinstance(default, bool):
        words["show_default"] = default is not None
    hint: Any = list[shown.kind] if shown.is_repeated else shown.kind  # type: ignore[name-defined]
    if default is None and not required:
        hint = hint | None
    note = typer.Argument(**words) if option.argument else typer.Option(each.flag, **words)
    return inspect.Parameter(
        each.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if required else default,
        annotation=Annotated[hint, note],
    )


def _completion(kind: str) -> Callable[[str], list[str]]:
    """Return the completer of choices for a shell; the work refuses anything else."""
    if kind == "robot":
        return _robot_names

    def complete(incomplete: str) -> list[str]:
        return [name for name in CHOICES[kind] if name.startswith(incomplete)]

    return complete


def _robot_names(incomplete: str) -> list[str]:
    """Return the robots of the catalogue that begin with a text, for a shell."""
    from elastocal.robot import catalogue  # not for help

    return [name for name in catalogue.names() if name.casefold().startswith(incomplete.casefold())]


def _type(each: SettingsField) -> type:
    """Return the type that typer reads."""
    if each.option.read:
        return str
    return next((kind for name, kind in _TYPES.items() if name in each.kind), str)


_TYPES: dict[str, type] = {"Path": Path, "bool": bool, "str": str, "int": int, "float": float}
"""Types of options, by a word in the type of a field; the first counts."""


def _is_shown(each: SettingsField) -> bool:
    """Return whether the value of a field can be given on the command line."""
    typed = not re.search("Callable|Mapping", each.kind) and any(n in each.kind for n in _TYPES)
    return typed or bool(each.option.choices or each.option.read)


def _is_repeated(each: SettingsField) -> bool:
    several = "..." in each.kind or "Sequence[" in each.kind
    return each.option.repeated or (several and not each.option.read)


def _read(each: SettingsField, given: Any) -> Any:
    """Return the value for a field; None where nothing was given."""
    if given is None or given == []:
        return None
    if each.option.read:
        return _READERS.get(each.option.read, _quantity(each.option.read))(given, each.flag)
    return tuple(given) if isinstance(given, list) else given


def _quantity(dimension: str) -> Callable[[str, str], float]:
    """Return the reader of a quantity above zero."""

    def read(text: str, flag: str) -> float:
        from elastocal.errors import UnitError
        from elastocal.units import parse_quantity

        try:
            value = parse_quantity(text, dimension)
        except UnitError as error:
            raise UnitError(f"{flag}: {error}") from error
        if not value > 0.0:
            raise UnitError(f"{flag} {text!r} must be above 0")
        return value

    return read


def _point(text: str, _flag: str) -> tuple[float, float, float]:
    from elastocal.units import parse_point

    return parse_point(text)


def _numbers(text: str, flag: str) -> tuple[float, ...]:
    from elastocal.errors import CompensationError
    from elastocal.units import parse_number

    try:
        return tuple(parse_number(part) for part in text.split(",") if text)
    except ValueError as error:
        raise CompensationError(f"{flag} {text!r} must be numbers, e.g. '0.5,-1'") from error


def _direction(text: str, flag: str) -> tuple[float, float, float]:
    from elastocal.errors import CompensationError

    try:
        x, y, z = _numbers(text, flag)
    except (CompensationError, ValueError) as error:
        raise CompensationError(
            f"direction {text!r} must be three numbers, e.g. '0, 0, -1'"
        ) from error
    return x, y, z


def _statements(texts: list[str], _flag: str) -> Any:
    from elastocal.cell import read_statements

    return read_statements(tuple(texts))


def _names(text: str, _flag: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(","))


def _ratio(text: str, _flag: str) -> float:
    """Return training over verification poses from ``"A/B"`` or a number."""
    from elastocal.errors import CodecError
    from elastocal.units import parse_number

    above, _, below = text.partition("/")
    try:
        return parse_number(above) / parse_number(below or "1")
    except (ValueError, ZeroDivisionError) as error:
        raise CodecError(f"ratio {text!r} must be two numbers above 0, e.g. '70/30'") from error


def _tolerance(text: str, _flag: str) -> Any:
    """Return a tolerance from ``"PART %, LENGTH"``; the length may be left out."""
    from elastocal.codec import Tolerance
    from elastocal.errors import CodecError, UnitError
    from elastocal.units import parse_number, parse_quantity

    part, _, length = (each.strip() for each in text.partition(","))
    percent = part.endswith("%")
    try:
        relative = parse_number(part.removesuffix("%")) / (100.0 if percent else 1.0)
        floor = parse_quantity(length, "length") if length else Tolerance.floor
    except (ValueError, UnitError) as error:
        raise CodecError(
            f"tolerance {text!r} must be a part and a length, e.g. '5 %, 5 um'"
        ) from error
    return Tolerance(relative, floor)


_READERS: dict[str, Callable[[Any, str], Any]] = {
    "point": _point,
    "numbers": _numbers,
    "direction": _direction,
    "statements": _statements,
    "list": _names,
    "ratio": _ratio,
    "tolerance": _tolerance,
}
