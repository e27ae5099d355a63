"""Fill the reference of the commands with their options, from the fields that commands are made of.

A mark ``<!-- options: calibrate -->`` becomes the table of that command's arguments and options,
in the order of its help.
"""

import inspect
import re
from typing import Any, get_args

from typer.models import ArgumentInfo

from elastocal.cli.commands import COMMANDS

_MARK = re.compile(r"^<!-- options: ([\w-]+) -->$", flags=re.MULTILINE)
_DEFAULT = re.compile(r" \[default: (.*)\]$", flags=re.DOTALL)


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return the page with a table in place of each mark."""
    return _MARK.sub(lambda mark: options_table(mark[1]), markdown)


def options_table(name: str) -> str:
    """Return the arguments and options of a command as a table in Markdown."""
    rows = [("argument, option", "default", "meaning"), ("---", "---", "---")]
    rows += [_row(each) for each in COMMANDS[name].parameters()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _row(parameter: inspect.Parameter) -> tuple[str, str, str]:
    hint, note = get_args(parameter.annotation)
    text = " ".join(note.help.replace("\\[", "[").split())
    default = _DEFAULT.search(text)
    return (
        f"`{_typed(parameter.name, str(hint), note)}`",
        f"`{default[1]}`" if default else _default(parameter.default),
        _marked(text[: default.start()] if default else text),
    )


def _typed(name: str, hint: str, note: Any) -> str:
    """Return what a person types."""
    taken = note.metavar or next((word for part, word in _TAKEN.items() if part in hint), "TEXT")
    if isinstance(note, ArgumentInfo):
        return f"{note.metavar or name.upper()}{' …' if 'list' in hint else ''}"
    flag = note.default  # typer keeps the first word there
    return flag.replace("/", "`, `") if "bool" in hint else f"{flag} {taken}"


_TAKEN = {"Path": "PATH", "int": "INTEGER", "float": "NUMBER"}
"""What an option takes, as help shows it, by a word in the type of its parameter."""


def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return "required"
    if isinstance(value, bool):
        return "on" if value else "off"
    return "" if value is None else f"`{value}`"


def _marked(text: str) -> str:
    """Return a text for a cell of a table, the options in it set as code."""
    return re.sub(r"(?<![\w`-])(--[a-z][\w-]*)", r"`\1`", text).replace("|", "\\|")
