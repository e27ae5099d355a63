"""Fill the reference of the commands with their options, from the fields that commands are made of.

A mark ``<!-- options: calibrate -->`` becomes the table of that command's arguments and options,
in the order of its help.
"""

import re
from pathlib import Path
from typing import Any

from elastocal.cli.commands import COMMANDS
from elastocal.cli.generator import Described, described
from elastocal.options import REQUIRED, SettingsField

MARK = re.compile(r"^<!-- options: ([\w-]+) -->$", flags=re.MULTILINE)
_KINDS = {Path: "PATH", int: "INTEGER", float: "NUMBER", str: "TEXT"}
"""What stands for a value of which the field says no more than its type."""


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return the page with a table in place of each mark."""
    return MARK.sub(lambda mark: options_table(mark[1]), markdown)


def options_table(name: str) -> str:
    """Return the arguments and options of a command as a table in Markdown."""
    rows = [("argument, option", "default", "meaning"), ("---", "---", "---")]
    rows += [_row(each) for each in COMMANDS[name].shown()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _row(field: SettingsField) -> tuple[str, str, str]:
    shown = described(field)
    return f"`{_typed(field, shown)}`", _default(shown.default), _meaning(shown.text)


def _typed(field: SettingsField, shown: Described) -> str:
    """Return what a person types."""
    if field.option.argument:
        return f"{shown.taken or field.name.upper()}{' …' if shown.is_repeated else ''}"
    if shown.kind is bool:
        return field.flag.replace("/", "`, `")
    return f"{field.flag} {shown.taken or _KINDS[shown.kind]}"


def _default(value: Any) -> str:
    if value is REQUIRED:
        return "required"
    if isinstance(value, bool):
        return "on" if value else "off"
    return "" if value is None else f"`{value}`"


def _meaning(text: str) -> str:
    """Return a text for a cell of a table, the options in it set as code; code stays as it is."""
    line = " ".join(text.split()).replace("|", "\\|").replace("``", "`")
    parts = re.split("(`[^`]*`)", line)
    parts[::2] = [re.sub(r"(?<![\w-])(--[a-z][\w-]*)", r"`\1`", each) for each in parts[::2]]
    return "".join(parts)
