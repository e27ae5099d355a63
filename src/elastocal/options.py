"""Settings on a command line: the metadata of each field, read from its source.

A class of settings defines each option once: by the field's name, type, default and docstring, and
by ``Annotated[..., Option(...)]`` where the command line differs. `settings_fields` reads that from
the source, so that help imports no numerical library.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, get_args


@dataclass(frozen=True)
class Option:
    """Differences of an option from its field; written with literals only."""

    name: str = ""
    """Name in place of the field's, such as ``--limit``; ``--on/--off`` for both states of a
    switch."""
    argument: bool = False
    """Whether it is given by its place."""
    required: bool = False
    """Whether the command line requires it, although settings in Python do not."""
    metavar: str = ""
    """Placeholder for the value in help."""
    choices: str = ""
    """Key of `CHOICES`, which help lists and a shell completes; or ``robot``: the catalogue's."""
    file: bool = False
    """Whether a file may be given in place of a choice."""
    ends: tuple[str, ...] = ()
    """Endings, in lower case, of which the name of a file to write must have one."""
    read: str = ""
    """Conversion of a text to the value: ``point``, ``direction``, ``numbers``, ``statements``,
    ``list`` (with commas), ``ratio``, ``tolerance``, or a dimension, such as ``length``, of a
    positive quantity. Without the option the default of the settings applies, which ``default``
    shows in help."""
    repeated: bool = False
    """Whether it may be given several times."""
    default: str = ""
    """Default shown in help, where the field has another form of it."""
    help: str = ""
    """Help in place of the docstring, where the command line needs other words."""
    least: float | None = None
    """Smallest number that is taken."""
    most: float | None = None
    """Largest one."""


@dataclass(frozen=True)
class SettingsField:
    """A field of settings as its source has it."""

    name: str
    kind: str
    """Its type, such as ``tuple[Path, ...]``."""
    default: Any
    """A literal; `REQUIRED` without a default, `OWN` where the default is no literal."""
    doc: str
    """Its docstring on one line, without markup."""
    option: Option = Option()

    @property
    def flag(self) -> str:
        """Text to type before its value."""
        return self.option.name or f"--{self.name.replace('_', '-')}"


REQUIRED, OWN = object(), object()
"""Marks of a field without default, and of a default that only the class knows."""
_TECHNIQUES = (
    "cover", "ioops", "i_optimal", "random", "exchange-d", "exchange-a", "exchange-e",
    "exchange-o2", "exchange-o3", "exchange-o4", "exchange-o5",
)  # fmt: skip
CHOICES: dict[str, tuple[str, ...]] = {
    "instrument": ("tracker",),
    "technique": _TECHNIQUES,
    "technique or none": (*_TECHNIQUES, "none"),
    "springs": (
        "auto", "actuated", "bearing", "bearing-joint", "bearing-ends", "links", "tensor",
        "bearing-gears", "gears",
    ),
    "process": ("afp", "machining"),
    "example": ("afp", "machining", "ur20"),
    "language": ("krl", "rapid", "fanuc", "urscript", "as", "none"),
    "page language": ("en", "de", "fr"),
    "loss": ("linear", "huber", "cauchy"),
    "weights": ("none", "sigma"),
    "free frame": ("none", "load_case", "campaign"),
    "posture": ("programmed", "stiffest"),
    "target": ("linux",),
    "purpose": ("elasticity", "geometry", "both"),
    "import purpose": ("elasticity", "geometry"),
    "warmth": ("cold", "warm"),
}  # fmt: skip
"""Choices that help lists without importing their modules; tests/contracts/test_commands.py checks
them."""


ToolFrame = Annotated[
    str | None,
    Option("--tool", help="Tcp behind that link: 'x, y, z, a, b, c' with units (Z-Y'-X'')."),
]
Marker = Annotated[
    tuple[float, float, float] | None,
    Option(
        read="point", help="Marker in the tcp frame: 'x, y, z' with units; default: the dataset's."
    ),
]
Exclude = Annotated[tuple[str, ...], Option(help="Leave out POSE or POSE:LOAD_CASE; repeatable.")]
Statements = Annotated[
    Mapping[str, str],
    Option(
        metavar="KEY=VALUE",
        read="statements",
        repeated=True,
        help="For the certificate, e.g. sensor.serial=FT-7; may be repeated.",
    ),
]
SHARED: dict[str, tuple[str, Option]] = {
    name: (str(kind), option)
    for name, (kind, option) in {
        "ToolFrame": get_args(ToolFrame),
        "Marker": get_args(Marker),
        "Exclude": get_args(Exclude),
        "Statements": get_args(Statements),
    }.items()
}
"""Types of fields that several settings share, by the name used at the field."""


def settings_class(workflow: str) -> str:
    """Return the name of the class of settings of a workflow, or command, of this name."""
    return f"{workflow.title().replace('_', '')}Settings"


@cache
def settings_fields(module: str, name: str) -> tuple[SettingsField, ...]:
    """Return the fields of a class of settings, its own before those of its bases.

    Parameters
    ----------
    module : str
        Module that has the class; it is read, not imported.
    name : str
        Name of the class.

    Raises
    ------
    LookupError
        If the module has no such class.
    """
    tree = _source(module)
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.name == name:
            own = tuple(_own_fields(module, node))
            bases = (base.id for base in node.bases if isinstance(base, ast.Name))
            above = (each for base in bases for each in settings_fields(module, base))
            names = {each.name for each in own}
            return (*own, *(each for each in above if each.name not in names))
        if isinstance(node, ast.ImportFrom) and name in (alias.name for alias in node.names):
            return settings_fields(_defining(node.module or "", name), name)
    raise LookupError(f"module {module} has no class {name}")


def summary_of(module: str, name: str) -> str:
    """Return the docstring of a function, or class, up to its first section, by the source.

    Raises
    ------
    LookupError
        If the module has neither of that name, or it has no docstring.
    """
    # A list of all commands asks for thirty: a pattern is quicker than a parser.
    pattern = rf'^(?:def|class) {name}\b.*?"""(.*?)(?:\n\s*\n    [A-Z]\w+\n    ---|""")'
    found = re.search(pattern, _text(module), re.DOTALL | re.MULTILINE)
    if found is None:
        raise LookupError(f"module {module} has no function or class {name} with a docstring")
    return _plain(found[1])


@cache
def _source(module: str) -> ast.Module:
    return ast.parse(_text(module))


def _text(module: str) -> str:
    found = find_spec(module)
    if found is None or found.origin is None:
        raise LookupError(f"there is no module {module}")
    return Path(found.origin).read_text(encoding="utf-8")


def _defining(module: str, name: str) -> str:
    """Return the module that defines a name, since a face of a package re-exports it."""
    found = find_spec(module)
    stub = Path(str(found.origin if found else "")).with_suffix(".pyi")
    if stub.name != "__init__.pyi" or not stub.is_file():
        return module
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and name in (alias.name for alias in node.names):
            return _defining(f"{module}.{node.module}", name)
    return module


def _own_fields(module: str, node: ast.ClassDef) -> Iterator[SettingsField]:
    for each, after in zip(node.body, [*node.body[1:], None], strict=True):
        if not isinstance(each, ast.AnnAssign) or not isinstance(each.target, ast.Name):
            continue
        kind, option = _option(module, each.annotation)
        default: Any = REQUIRED
        if each.value is not None:
            default = _default(each.value)
        text = after.value if isinstance(after, ast.Expr) else None
        doc = str(text.value) if isinstance(text, ast.Constant) else ""
        yield SettingsField(each.target.id, kind, default, _plain(doc), option)


def _default(value: ast.expr) -> Any:
    """Return a default by its source, that of ``field(default=...)`` too."""
    if isinstance(value, ast.Call):
        value = next((word.value for word in value.keywords if word.arg == "default"), value)
    try:
        return ast.literal_eval(value)
    except ValueError:
        return OWN


def _option(module: str, annotation: ast.expr) -> tuple[str, Option]:
    """Return the type of a field, and what ``Annotated`` says of its option."""
    if isinstance(annotation, ast.Name) and annotation.id in SHARED:
        return SHARED[annotation.id]
    if isinstance(annotation, ast.Name):
        annotation = _meant(module, annotation)
    if isinstance(annotation, ast.Subscript) and ast.unparse(annotation.value) == "Annotated":
        parts = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else []
        kind, notes = parts[0], parts[1:]
        for note in notes:
            if isinstance(note, ast.Call) and ast.unparse(note.func) == Option.__name__:
                places = dict(zip(("name",), map(ast.literal_eval, note.args), strict=False))
                words = {str(word.arg): ast.literal_eval(word.value) for word in note.keywords}
                return ast.unparse(_meant(module, kind)), Option(**places, **words)
        return ast.unparse(_meant(module, kind)), Option()
    return ast.unparse(annotation), Option()


def _meant(module: str, kind: ast.expr) -> ast.expr:
    """Return a type, written out if it is a name that a module of elastocal gives another."""
    if not isinstance(kind, ast.Name):
        return kind
    for node in _source(module).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == kind.id:
            return node.value
        if isinstance(node, ast.ImportFrom) and kind.id in (alias.name for alias in node.names):
            origin = node.module or ""
            if origin.startswith("elastocal."):
                return _meant(_defining(origin, kind.id), kind)
    return kind


def _plain(text: str) -> str:
    """Return a docstring with each paragraph on one line."""
    paragraphs = (" ".join(part.split()) for part in text.split("\n\n"))
    return "\n\n".join(paragraphs).strip()
