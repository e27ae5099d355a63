"""Plug-ins: springs, criteria, commands … of other packages, found by their entry points.

A package that is installed beside elastocal names what it adds in its ``pyproject.toml``:

    [project.entry-points."elastocal.springs"]
    creep = "elastocal_creep:Creep"

Names are read from the installed packages without importing them. An object is loaded when it is
asked for by its name, in whatever process that is: a worker, or one that reads a file years later.
Names of elastocal come first; a plug-in cannot replace them.
"""

import importlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from traceback import walk_tb
from types import FrameType
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from elastocal.errors import ElastocalError, PluginError, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_T = TypeVar("_T")
_BROKEN = (
    ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, NameError, OSError,
    RuntimeError, SyntaxError, TypeError, ValueError,
)  # fmt: skip
"""Exceptions that a plug-in's module may raise on import; each is reported in a line."""


@dataclass(frozen=True)
class Kind:
    """Something of which a package may add more."""

    group: str
    """Group of its entry points."""
    home: str
    """Registry of those that elastocal has, ``module:name``."""
    expected: str
    """Class of the object, ``module:name``."""
    is_class: bool = False
    """Whether the entry point names a subclass of it, not an object."""


@dataclass(frozen=True)
class Command(Generic[_T]):
    """A command of the command line: settings in, a result out, shown as blocks."""

    settings: type
    """A frozen dataclass. A field without a default is an argument, one with a default an option;
    its docstring is its help, and `elastocal.options.Option` says what differs. The docstring of
    the class is the help of the command."""
    run: Callable[[Any], _T]
    """Does the work; what it raises is an `ElastocalError`."""
    show: Callable[[_T], Iterable[Any]]
    """Function that returns the blocks of the result (`elastocal.blocks`); ``--json`` prints the
    result itself, a record."""


_FUNCTION = "collections.abc:Callable"
KINDS = {
    "kind of spring": Kind(
        "elastocal.springs", "elastocal.elastic:KINDS", "elastocal.elastic:Spring", True
    ),
    "spring layout": Kind("elastocal.layouts", "elastocal.elastic:LAYOUTS", _FUNCTION),
    "search technique": Kind(
        "elastocal.techniques", "elastocal.planning.search:TECHNIQUES", _FUNCTION
    ),
    "criterion": Kind(
        "elastocal.criteria",
        "elastocal.planning.search:CRITERIA",
        "elastocal.planning.search:Criterion",
        True,
    ),
    "check": Kind(
        "elastocal.checks",
        "elastocal.planning:CHECKS",
        "elastocal.planning.checks:PostureCheck",
        True,
    ),
    "loss": Kind("elastocal.losses", "elastocal.identification:LOSSES", _FUNCTION),
    "filter": Kind(
        "elastocal.filters",
        "elastocal.compensation.conditioning:FILTERS",
        "elastocal.compensation.conditioning:WrenchFilter",
        True,
    ),
    "driver": Kind(
        "elastocal.drivers", "elastocal.drivers:DRIVERS", "elastocal.cell:Driver"
    ),
    "program language": Kind(
        "elastocal.programs",
        "elastocal.compensation.programs:PROGRAM_WRITERS",
        "elastocal.compensation.programs:ProgramWriter",
    ),
    "report section": Kind(
        "elastocal.sections",
        "elastocal.report.document:SECTIONS",
        "elastocal.report.document:Section",
    ),
    "command": Kind(
        "elastocal.commands", "elastocal.cli.commands:COMMANDS", "elastocal.plugins:Command"
    ),
    "words": Kind(
        "elastocal.words", "elastocal.report.language:LANGUAGES", "collections.abc:Mapping"
    ),
}  # fmt: skip
"""Every kind, by the word that messages have for it."""


@cache
def _entries(group: str, path: tuple[str, ...]) -> Mapping[str, tuple["EntryPoint", ...]]:  # noqa: ARG001
    """Return the entry points of other distributions by name; again for another path."""
    from importlib.metadata import entry_points  # takes a third of the time of --help

    found: dict[str, dict[str, EntryPoint]] = {}
    for entry in entry_points(group=group):
        source = entry.dist.name if entry.dist else ""
        if source != "elastocal":
            found.setdefault(entry.name, {})[source] = entry
    return {name: tuple(found[name].values()) for name in sorted(found)}


def entries(kind: str) -> Mapping[str, tuple["EntryPoint", ...]]:
    """Return the entry points of a kind by their name; nothing of a package is imported."""
    return _entries(KINDS[kind].group, tuple(sys.path))


def source_of(entry: "EntryPoint") -> str:
    """Return the distribution of an entry point and its version."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value


def require_distributions(needed: object, what: str) -> None:
    """Refuse a file that needs distributions which are not installed.

    Parameters
    ----------
    needed : object
        What the file says: distributions with the versions that made it. Anything but a mapping is
        left to the reader of the file.
    what : str
        The file, for messages.

    Raises
    ------
    PluginError
        With the first that is missing.
    """
    if not needed or not isinstance(needed, Mapping):
        return
    from importlib.metadata import distributions

    installed = {each.name for each in distributions()}
    for name, version in needed.items():
        if name not in installed:
            raise PluginError(f"{what} needs {name} (made with {version}), which is not installed")


def load(kind: str, name: str) -> Any:
    """Return the plug-in of a name.

    Raises
    ------
    PluginError
        If two distributions have one of that name, it cannot be imported, or is no such thing. The
        message names the distribution.
    """
    entry, *others = entries(kind)[name]
    if others:
        sources = " and ".join(sorted(map(source_of, (entry, *others))))
        raise PluginError(f"{kind} {name!r} is in {sources}: one of them has to be removed")
    return _loaded(kind, entry)


def load_all(kind: str, name: str) -> list[Any]:
    """Return the plug-ins of every distribution that has one of this name, such as a language.

    Raises
    ------
    PluginError
        As by `load`, for each.
    """
    return [_loaded(kind, entry) for entry in entries(kind).get(name, ())]


def _loaded(kind: str, entry: "EntryPoint") -> Any:
    name = entry.name
    what = f"{kind} {name!r} of {source_of(entry)}"
    try:
        found = entry.load()
    except _BROKEN as error:
        raise PluginError(f"{what} cannot be loaded: {_reason(error)}") from error
    form, wanted = KINDS[kind], imported(KINDS[kind].expected)
    if form.is_class:
        fits, words = isinstance(found, type) and wanted in found.__mro__, "a subclass of"
    else:
        fits, words = isinstance(found, wanted), "a"
    if not fits:
        raise PluginError(f"{what}: {entry.value} is not {words} {wanted.__name__}")
    missing = sorted(getattr(found, "__abstractmethods__", ()))
    if form.is_class and missing:
        raise PluginError(f"{what}: {entry.value} does not define {', '.join(missing)}")
    return found


def used(kind: str, name: str, make: Callable[[], _T]) -> _T:
    """Return the product of a plug-in; where it fails, the message names its distribution.

    Parameters
    ----------
    kind, name : str
        As for `load`; what elastocal itself has may be named as well, and fails as it is.
    make : callable
        Calls the plug-in.

    Raises
    ------
    PluginError
        With what the plug-in raised.
    """
    found = entries(kind).get(name)
    if not found:
        return make()
    try:
        return make()
    except ElastocalError:
        raise
    except _BROKEN as error:
        what = f"{kind} {name!r} of {source_of(found[0])}"
        place = _place(error, found[0].module.partition(".")[0])
        raise PluginError(f"{what} cannot be used: {_reason(error)}{place}") from error


def _reason(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _place(error: BaseException, package: str) -> str:
    """Return where a package's own code was when something was raised; empty where it was not."""
    frames = [each for each in walk_tb(error.__traceback__) if _package_of(each[0]) == package]
    return f" ({Path(frames[-1][0].f_code.co_filename).name}:{frames[-1][1]})" if frames else ""


def _package_of(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def imported(place: str) -> Any:
    """Return the object at a place ``module:name``."""
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


class Registry(Mapping[str, _T], Generic[_T]):
    """All of a kind by name: those of elastocal, then those of other packages.

    Parameters
    ----------
    kind : str
        Kind of `KINDS`.
    own : mapping, or callable that returns it
        Those of elastocal; a text ``module:name`` is imported when it is used.
    error : type
        Error for an unknown name.
    """

    def __init__(
        self,
        kind: str,
        own: Mapping[str, _T | str] | Callable[[], Mapping[str, _T | str]],
        error: type[ElastocalError],
    ) -> None:
        self.kind, self._own, self._error = kind, own, error
        self._added: dict[str, _T | str] = {}

    @property
    def own(self) -> Mapping[str, _T | str]:
        """Names of elastocal, and those that this process has added."""
        found = self._own() if callable(self._own) else self._own
        return {**found, **self._added} if self._added else found

    def add(self, name: str, each: _T) -> None:
        """Add one for this process alone, as a script does; a package has an entry point for it.

        Raises
        ------
        ElastocalError
            If there is one of this name already.
        """
        if name in self:
            raise self._error(f"there is a {self.kind} {name!r} already")
        self._added[name] = each

    def __getitem__(self, name: str) -> _T:
        own = self.own
        if name not in own:
            return cast("_T", load(self.kind, name))
        found = own[name]
        if not isinstance(found, str):
            return found
        try:
            return cast("_T", imported(found))
        except ImportError as error:  # of an extra that is not installed
            raise self._error(f"{self.kind} {name!r} cannot be loaded: {error}") from error

    def __contains__(self, name: object) -> bool:
        return name in self.own or name in entries(self.kind)

    def __iter__(self) -> Iterator[str]:
        yield from dict.fromkeys((*self.own, *entries(self.kind)))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def sources(self, names: Iterable[str]) -> dict[str, str]:
        """Return the distributions that are not elastocal's and have these, with their versions."""
        own, found = self.own, entries(self.kind)
        others = (found[name][0].dist for name in names if name in found and name not in own)
        return {dist.name: dist.version for dist in others if dist}

    def named(self, name: str, beside: Sequence[str] = (), more: str = "") -> _T:
        """Return the object of a name.

        Parameters
        ----------
        beside : sequence of str
            Further names that the caller accepts, for the message.
        more : str
            What the caller also accepts, in words.

        Raises
        ------
        ElastocalError
            If there is none, with the nearest and all known names; of the kind's own type.
        PluginError
            If it is a plug-in that cannot be used.
        """
        if name not in self:
            known = list(dict.fromkeys((*beside, *self)))
            raise self._error(
                f"unknown {self.kind} {name!r}{nearest(name, known)}"
                f" (allowed: {', '.join(known)}{more})"
            )
        return self[name]
