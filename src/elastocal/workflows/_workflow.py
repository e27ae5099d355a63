"""How workflows are called: with a record of settings, or with its fields."""

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


def workflow(settings: type[S]) -> Callable[[Callable[[S, Progress], R]], Workflow[S, R]]:
    """Let a function of settings and progress also be called with the fields of its settings.

    Files may be given as texts, and one item instead of several; `inspect.signature` shows the
    fields.

    Parameters
    ----------
    settings : type
        The record of settings; its first positional field is what the work starts from.
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
            return function(_as_hinted(chosen), *(hears or (progress,)))

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


def _as_hinted(given: Any) -> Any:
    """Return settings whose files and lists are of the types that their fields name."""
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
