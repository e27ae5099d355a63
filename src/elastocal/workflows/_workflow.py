"""How workflows are called: with a record of settings, or with its fields."""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast, overload

from elastocal.progress import Progress, silent

S = TypeVar("S", contravariant=True)
R = TypeVar("R", covariant=True)


class Workflow(Protocol[S, R]):
    """A function from settings to a result."""

    __name__: str

    @overload
    def __call__(self, settings: S, /, progress: Progress = ...) -> R: ...
    @overload
    def __call__(self, source: Any, /, progress: Progress = ..., **options: Any) -> R: ...


def workflow(settings: type[S]) -> Callable[[Callable[[S, Progress], R]], Workflow[S, R]]:
    """Let a function of settings and progress also be called with the fields of its settings.

    Parameters
    ----------
    settings : type
        The record of settings; its first positional field is what the work starts from.
    """

    def mark(function: Callable[[S, Progress], R]) -> Workflow[S, R]:
        @functools.wraps(function)
        def call(source: Any, /, progress: Progress = silent, **options: Any) -> R:
            if isinstance(source, settings):
                given: Any = dataclasses.replace(source, **options)  # type: ignore[type-var]
            else:
                given = settings(source, **options)  # type: ignore[call-arg]
            return function(given, progress)

        return cast("Workflow[S, R]", call)

    return mark
