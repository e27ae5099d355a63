"""Docstrings of workflows: their parameters are the fields of their settings, said once, there."""

import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

from elastocal.options import OWN, REQUIRED, SettingsField, settings_fields

_SECTION = re.compile(r"\n\n(?=[A-Z]\w+\n-+\n)|\Z")
_CHOICES = re.compile(r"^Literal\[(.*)\]$")
_WIDTH = 96


def documented(function: Callable[..., Any], settings: type) -> str:
    """Return the docstring of a workflow, which has no parameters, with one for every field.

    Parameters
    ----------
    function : callable
        With one parameter for all settings, and the progress.
    settings : type
        The class whose fields are meant.
    """
    text = inspect.getdoc(function) or ""
    fields = sorted(
        settings_fields(settings.__module__, settings.__name__),
        key=lambda each: each.default is not REQUIRED,
    )
    first = fields[0].name
    lines = ["Parameters", "----------"]
    for field in fields:
        lines += _entry(field)
    lines += [
        "progress : callable, optional",
        "    Called with stage, done and total.",
        "",
        *_returned(function, settings, first),
    ]
    parameters = "\n".join(["\n", *lines])
    return _SECTION.sub(lambda found: parameters + found[0], text, count=1)


def _entry(field: SettingsField) -> Iterator[str]:
    """Yield the lines of a parameter."""
    kind = field.kind.replace("[str]", "") if "PathLike" in field.kind else field.kind
    kind = _CHOICES.sub(r"{\1}", kind)
    default = "" if field.default is REQUIRED else ", optional"
    if field.default not in (REQUIRED, OWN, None):
        default = f", default {field.default!r}"
    yield f"{field.name} : {kind}{default}"
    for paragraph in (field.doc or field.option.help).split("\n\n"):
        yield from (f"    {line}" for line in textwrap.wrap(paragraph, _WIDTH - 4))


def _returned(function: Callable[..., Any], settings: type, first: str) -> Iterator[str]:
    """Yield the lines on what is returned, and on settings in place of fields."""
    kind = inspect.signature(function).return_annotation
    name = getattr(kind, "__name__", str(kind))
    yield from ("Returns", "-------", name)
    said = (inspect.getdoc(kind) or "").split("\n\n", maxsplit=1)[0]
    yield from (f"    {line}" for line in textwrap.wrap(" ".join(said.split()), _WIDTH - 4))
    yield from ("", "Notes", "-----")
    yield from textwrap.wrap(
        f"In place of `{first}` and the others, a `{settings.__name__}` may be given.", _WIDTH
    )
