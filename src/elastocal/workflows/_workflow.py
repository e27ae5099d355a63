"""Calls of workflows: with a record of settings, or with its fields.

Each runs under the rule for its outputs (`elastocal.outputs`), made from its settings.
"""

import dataclasses
import functools
import inspect
import types
from collections.abc import Callable, Collection
from os import PathLike
from pathlib import Path
from typing import (
    Any,
    Protocol,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

from elastocal.errors import nearest
from elastocal.files import remove_leftovers, require_place
from elastocal.outputs import OutputRule, ruled
from elastocal.progress import Progress, silent

S = TypeVar("S", contravariant=True)
R = TypeVar("R", covariant=True)


class Workflow(Protocol[S, R]):
    """A function from settings to a result."""

    __name__: str

    @overload
    def __call__(self, settings: S, /, progress: Progress = ...) -> R: ...
    @overload
    def __call__(self, source: Any = ..., /, progress: Progress = ..., **options: Any) -> R: ...


def workflow(
    settings: type[S],
    *,
    marks: tuple[str, ...] = (),
    outputs: tuple[str, ...] = ("out",),
    record: str = "",
) -> Callable[[Callable[[S, Progress], R]], Workflow[S, R]]:
    """Let a function of settings and progress also be called with the fields of its settings.

    Files may be given as texts, and a single item instead of a list; `inspect.signature` shows the
    fields.

    Parameters
    ----------
    settings : type
        The record of settings; its first positional field is what the work starts from.
    marks : tuple of str, optional
        Texts by which a file is known as a former output, which may be replaced. Without any, no
        file is replaced but in a folder of ours, or where the settings have ``force``. With some,
        the outputs are files, in folders that are there; a folder that is an output is made.
    outputs : tuple of str, optional
        Fields that name what is written; every other one that names a file or folder, an input.
    record : str, optional
        Field with the folder of a run whose record is written; no other workflow may.
    """
    fields = inspect.signature(settings).parameters
    first = next(name for name, each in fields.items() if each.kind is not each.KEYWORD_ONLY)
    required = fields[first].default is inspect.Parameter.empty

    def mark(function: Callable[[S, Progress], R]) -> Workflow[S, R]:
        @functools.wraps(function)
        def call(*given: Any, progress: Progress = silent, **options: Any) -> R:
            source, hears = given[:1], given[1:]
            if len(hears) > 1:
                raise TypeError(f"{function.__name__}() takes one argument without a name")
            _require_known(function.__name__, options, fields)
            if source and isinstance(source[0], settings):
                chosen: Any = dataclasses.replace(source[0], **options)  # type: ignore[type-var]
            elif required and not source and first not in options:
                raise TypeError(f"{function.__name__}() needs {first!r}")
            else:
                chosen = settings(*source, **options)
            chosen = _as_hinted(chosen)
            places = _places(chosen)
            written = [path for name in (*outputs, record) for path in places.pop(name, ())]
            for path in written:
                remove_leftovers(path)
                if marks:  # a file; folders are made
                    require_place(path)
            rule = OutputRule(
                force=getattr(chosen, "force", False),
                marks=marks,
                folder=next(iter(written), None),
                record=written[0] if record else None,
            )
            with ruled(rule, (path for paths in places.values() for path in paths), written):
                return function(chosen, *(hears or (progress,)))

        shown = [each.replace(kind=each.KEYWORD_ONLY) for each in fields.values()]
        shown.sort(key=lambda each: each.name != first)
        shown[0] = shown[0].replace(kind=inspect.Parameter.POSITIONAL_OR_KEYWORD)
        follows = inspect.signature(function).parameters["progress"].replace(default=silent)
        signature = inspect.Signature([shown[0], follows, *shown[1:]])
        call.__signature__ = signature  # type: ignore[attr-defined]
        return cast("Workflow[S, R]", call)

    return mark


def _require_known(function: str, options: Collection[str], fields: Collection[str]) -> None:
    for name in options:
        if name not in fields:
            raise TypeError(f"{function}() has no option {name!r}{nearest(name, fields)}")


def _places(settings: Any) -> dict[str, list[Path]]:
    """Return the files and folders that each field of settings names.

    A text may be a name of something else: it counts where it is a file, or is meant as a place.
    """
    places: dict[str, list[Path]] = {}
    for name, hint in get_type_hints(type(settings)).items():
        value, meant = getattr(settings, name), "Path" in str(hint)
        items = value if isinstance(value, tuple | list) else (value,)
        places[name] = [
            Path(each)
            for each in items
            if isinstance(each, PathLike) or (isinstance(each, str) and (meant or _is_file(each)))
        ]
    return places


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # too long for a name, or not a name
        return False


def _as_hinted(given: Any) -> Any:
    """Return settings whose files and lists have the types of their fields."""
    found = {name: getattr(given, name) for name in inspect.signature(type(given)).parameters}
    hints = get_type_hints(type(given))
    wanted = {name: _converted(value, hints[name]) for name, value in found.items()}
    changed = {name: value for name, value in wanted.items() if value is not found[name]}
    return dataclasses.replace(given, **changed) if changed else given


def _converted(value: Any, hint: Any) -> Any:
    """Return a value as its type hint wants it: texts as paths, one item or a list as a tuple."""
    allowed = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    if isinstance(value, str | PathLike) and Path in allowed and str not in allowed:
        return value if isinstance(value, Path) else Path(value)
    several = [get_args(each)[0] for each in allowed if get_args(each)[1:] == (Ellipsis,)]
    if not several or value is None:
        return value
    # A text is a sequence too: "12" would be the items "1" and "2".
    items = (value,) if isinstance(value, str | PathLike) else tuple(value)
    converted = tuple(_converted(each, several[0]) for each in items)
    return value if value == converted else converted
