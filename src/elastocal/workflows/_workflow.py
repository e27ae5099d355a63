"""Calls of workflows: with a record of settings, or with its fields.

Each runs under the rule for its outputs (`elastocal.outputs`), made from its settings.
"""

import dataclasses
import functools
import inspect
import itertools
import operator
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from numbers import Integral, Real
from os import PathLike, fspath
from pathlib import Path
from typing import (
    Annotated,
    Any,
    Literal,
    Protocol,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

from elastocal.errors import FileAccessError, described_type, nearest
from elastocal.files import remove_leftovers, require_place
from elastocal.options import settings_fields
from elastocal.outputs import OutputRule, ruled
from elastocal.progress import Progress, silent
from elastocal.workflows._documented import documented

S = TypeVar("S", contravariant=True)
R = TypeVar("R", covariant=True)


class Workflow(Protocol[S, R]):
    """A function from settings to a result."""

    __name__: str

    @overload
    def __call__(self, settings: S, /, progress: Progress = ...) -> R: ...
    @overload
    def __call__(self, source: Any = ..., /, progress: Progress = ..., **options: Any) -> R: ...
    @overload
    def __call__(
        self, source: Any, other: Any, /, progress: Progress = ..., **options: Any
    ) -> R: ...


def workflow(
    settings: type[S],
    *,
    marks: tuple[str, ...] = (),
    outputs: tuple[str, ...] = ("out",),
    record: str = "",
) -> Callable[[Callable[[S, Progress], R]], Workflow[S, R]]:
    """Let a function of settings and progress also be called with the fields of its settings.

    Files may be given as texts, and one item instead of several. Fields without a default may be
    given by place. `inspect.signature` and `help` show the fields (`documented`).

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
    fields = _shown_plainly(settings)
    placed = [name for name, each in fields.items() if each.kind is not each.KEYWORD_ONLY]
    needed = [name for name in placed if fields[name].default is inspect.Parameter.empty]
    by_place = needed or placed[:1]

    def mark(function: Callable[[S, Progress], R]) -> Workflow[S, R]:
        @functools.wraps(function)
        def call(*given: Any, progress: Progress = silent, **options: Any) -> R:
            chosen, hears = _chosen(function.__name__, settings, by_place, given, options)
            files = _places(chosen)
            written = [path for each in (*outputs, record) for path in files.pop(each, ())]
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
            with ruled(rule, (path for paths in files.values() for path in paths), written):
                _require_endings(chosen)
                return function(chosen, *(hears or (progress,)))

        signature = _signature(function, fields, by_place)
        call.__signature__ = signature  # type: ignore[attr-defined]
        call.__doc__ = documented(function, settings)
        return cast("Workflow[S, R]", call)

    return mark


def _chosen(
    name: str,
    settings: type[Any],
    by_place: Sequence[str],
    given: Sequence[Any],
    options: dict[str, Any],
) -> tuple[Any, Sequence[Any]]:
    """Return the settings of a call, and what is left of its arguments without a name."""
    fields = inspect.signature(settings).parameters
    _require_known(name, options, fields)
    is_settings = bool(given) and isinstance(given[0], settings)
    places = 1 if is_settings else _count_places(given, len(by_place))
    rest = given[places:]
    if rest[1:] or not all(map(callable, rest)):
        count = f"{len(by_place)} arguments" if by_place[1:] else "one argument"
        raise TypeError(f"{name}() takes {count} without a name")
    if is_settings:
        stated = {each: getattr(given[0], each) for each in fields} | options
        stated = _as_hinted(name, settings, stated)
        changed = {k: v for k, v in stated.items() if v is not getattr(given[0], k)}
        return dataclasses.replace(given[0], **changed), rest
    options |= _by_name(name, by_place, given[:places], options)
    for each in by_place:
        if each not in options and fields[each].default is inspect.Parameter.empty:
            raise TypeError(f"{name}() needs {each!r}")
    return settings(**_as_hinted(name, settings, options)), rest


def _signature(
    function: Callable[..., Any], fields: Mapping[str, inspect.Parameter], by_place: Sequence[str]
) -> inspect.Signature:
    """Return the signature that shows the fields: those given by place, the progress, the rest."""
    shown = [each.replace(kind=each.KEYWORD_ONLY) for each in fields.values()]
    placed = [
        each.replace(kind=each.POSITIONAL_OR_KEYWORD) for each in shown if each.name in by_place
    ]
    follows = inspect.signature(function).parameters["progress"].replace(default=silent)
    rest = (each for each in shown if each.name not in by_place)
    return inspect.Signature([*placed, follows, *rest])


def _shown_plainly(settings: type[Any]) -> Mapping[str, inspect.Parameter]:
    """Let `help` show the fields of settings without what a command line adds, and return them."""
    signature = inspect.signature(settings.__init__)
    made = {
        each.name: each.default_factory()
        for each in dataclasses.fields(settings)
        if each.default_factory is not dataclasses.MISSING
    }
    shown = [
        each.replace(annotation=_plain(each.annotation), default=made.get(name, each.default))
        for name, each in signature.parameters.items()
    ]
    settings.__init__.__signature__ = signature.replace(parameters=shown)
    return {each.name: each for each in shown[1:]}


def _plain(annotation: Any) -> Any:
    """Return a type without what a command line adds to it."""
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def _count_places(given: Sequence[Any], most: int) -> int:
    """Return how many arguments without a name are fields; what can be called is the progress."""
    fields = itertools.takewhile(lambda each: not callable(each), given[1:most])
    return min(len(given), 1) + sum(1 for _ in fields)


def _by_name(
    function: str, names: Sequence[str], given: Sequence[Any], options: Collection[str]
) -> dict[str, Any]:
    """Return arguments without a name by their fields."""
    found = dict(zip(names, given, strict=False))
    for name in found:
        if name in options:
            raise TypeError(f"{function}() got multiple values for {name!r}")
    return found


def _require_known(function: str, options: Collection[str], fields: Collection[str]) -> None:
    for name in options:
        if name not in fields:
            raise TypeError(f"{function}() has no option {name!r}{nearest(name, fields)}")


def _require_endings(settings: Any) -> None:
    """Refuse names of files to write that say another kind, before the work."""
    kind = type(settings)
    for each in settings_fields(kind.__module__, kind.__name__):
        path, ends = getattr(settings, each.name), each.option.ends
        if ends and path is not None and Path(path).suffix.lower() not in ends:
            raise FileAccessError(f"{each.flag} {path}: its name must end in {' or '.join(ends)}")


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


def _as_hinted(function: str, settings: type[Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of fields with the types of their hints; see `_taken`.

    Raises
    ------
    TypeError
        If a value is of no type that its field takes; it names the field and these types.
    """
    hints, found = get_type_hints(settings), {}
    for name, value in given.items():
        try:
            found[name] = _taken(value, hints[name])
        except _NotTakenError as refused:
            allowed = ", ".join(_words(hints[name]))
            raise TypeError(f"{function}(): {name} is {refused} (allowed: {allowed})") from None
    return found


class _NotTakenError(Exception):
    """A value is of no type that its hint names; its text says of which it is."""


def _taken(value: Any, hint: Any) -> Any:
    """Return a value as its type hint wants it: texts as paths, one item or a list as a tuple.

    Raises
    ------
    _NotTakenError
        If neither the value nor a part of it is of a type that is wanted there.
    """
    allowed = _alternatives(hint)
    if any(_is_one(value, each) for each in allowed):
        return value
    if isinstance(value, str | PathLike) and Path in allowed:
        return Path(value)
    if isinstance(value, PathLike) and str in allowed:
        return fspath(value)
    for each in allowed:
        if (items := _items(value, each)) is not None:
            taken = tuple(_taken(*item) for item in items)
            same = isinstance(value, tuple) and all(map(operator.is_, taken, value))
            return value if same else taken
    raise _NotTakenError(described_type(value))


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """Return the types that a hint names."""
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _is_one(value: Any, hint: Any) -> bool:
    """Return whether a value is of one type of a hint that is no list of several."""
    if get_origin(hint) is Literal:  # the work knows which of its words are allowed
        return any(isinstance(value, type(word)) for word in get_args(hint))
    if _is_list(hint):
        return False
    kind = get_origin(hint) or hint
    if kind is bool:  # NumPy's, too
        return hasattr(type(value), "__bool__")
    if kind is Mapping:  # data frames are none by class
        return hasattr(value, "keys") and hasattr(value, "__getitem__")
    kind = {int: Integral, float: Real}.get(kind, kind)
    is_open = not isinstance(kind, type) or getattr(kind, "_is_protocol", False)
    return is_open or isinstance(value, kind)


def _is_list(hint: Any) -> bool:
    return get_origin(hint) in (tuple, Sequence, Iterable)


def _items(value: Any, hint: Any) -> list[tuple[Any, Any]] | None:
    """Return the items of a value with their hints; None where the hint wants other ones.

    A text is a sequence too, but "12" is not the items "1" and "2".
    """
    if not _is_list(hint):
        return None
    first, *rest = get_args(hint)
    is_single = isinstance(value, str | PathLike) or not isinstance(value, Iterable)
    items = [value] if is_single else list(value)
    if not rest or rest == [Ellipsis]:
        return None if value is None else [(item, first) for item in items]
    return list(zip(items, (first, *rest), strict=True)) if len(items) == len(rest) + 1 else None


_PLAIN_WORDS = {
    str: "text",
    Path: "path",
    PathLike: "path",
    types.NoneType: "None",
    bool: "True or False",
    int: "whole number",
    float: "number",
    Callable: "function",
    Mapping: "columns or values by name",
}


def _words(hint: Any) -> list[str]:
    """Return the names of the types that a hint names, each once."""
    named: dict[str, None] = {}
    kinds = _alternatives(hint)
    for each in kinds:
        if each is str and any((get_origin(other) or other) is PathLike for other in kinds):
            continue
        if get_origin(each) is Literal:
            named |= dict.fromkeys(map(str, get_args(each)))
        elif _is_list(each) and (get_origin(each) is not tuple or get_args(each)[-1] is Ellipsis):
            items = _words(get_args(each)[0])
            named |= dict.fromkeys(items)
            named["several of them"] = None
        elif _is_list(each):
            named[f"{len(get_args(each))} numbers"] = None
        else:
            kind = get_origin(each) or each
            named[_PLAIN_WORDS.get(kind, getattr(kind, "__name__", str(kind)))] = None
    return list(named)
