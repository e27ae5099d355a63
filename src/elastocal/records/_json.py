"""Strict and bounded reader of JSON, used for all JSON.

A repeated key is refused: one reader takes the first value and another the last, so that what one
checks may differ from what the other shows.
"""

import json
import re
from pathlib import Path
from typing import Any

from elastocal import files
from elastocal.errors import SchemaError
from elastocal.files import Limit

MOST_VALUES = Limit("ELASTOCAL_MAX_JSON_VALUES", 2_000_000, "values")
_HALF = re.compile(r"\\[uU](?:0000)?[dD][89a-fA-F]")
"""Escape sequence that may encode half of a letter, in JSON and in YAML."""
_MOST_NESTING = Limit("ELASTOCAL_MAX_NESTING", 64, "levels")
SEAL = "content_sha256"
"""Key or attribute by which a file states the hash of all else that it says."""
_SHOWN = 12
"""Number of digits of a hash that people compare."""


def parse_json(
    text: str | bytes, what: str, *, finite: bool = False, most: Limit = MOST_VALUES
) -> Any:
    """Return the value of a JSON text.

    Parameters
    ----------
    text : str or bytes
        The text; bytes are UTF-8.
    what : str
        The file or the place, for messages.
    finite : bool
        Whether to refuse ``NaN`` and ``Infinity``, which JSON does not know, at once; otherwise
        they are left to the schema.
    most : Limit
        How many values it may hold, counted by its commas and opening brackets.

    Raises
    ------
    SchemaError
        If it is not JSON, holds a key twice, or asks for more memory or stack than it may.
    """
    # A comma takes a byte, the value behind it a hundred times as much.
    if isinstance(text, bytes):
        count = sum(text.count(mark) for mark in (b",", b"[", b"{"))
    else:
        count = sum(text.count(mark) for mark in (",", "[", "{"))
    most.require(count, f"{what} has {count} commas and brackets, which")
    try:
        whole = text.decode() if isinstance(text, bytes) else text
        data = json.loads(
            whole, object_pairs_hook=_unique, parse_constant=_refused if finite else None
        )
    except UnicodeDecodeError as error:
        raise SchemaError(f"{what} is not valid JSON: it is not UTF-8") from error
    except (ValueError, RecursionError) as error:
        raise SchemaError(f"{what} is not valid JSON: {parser_reason(error)}") from error
    require_shallow(data, what)
    require_whole_letters(whole, data, what)
    return data


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in found if names.count(name) > 1)
        raise ValueError(f"key {twice!r:.60} stands twice")
    return found


def _refused(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


def require_written(path: Path, data: Any) -> None:
    """Refuse a JSON file of these data that has another space, digit or escape than we write.

    Raises
    ------
    SchemaError
        If it is not, byte by byte, what `elastocal.files.write_json` writes.
    FileAccessError
        If it cannot be read.
    """
    if files.read_bytes(path) != files.json_text(data).encode():
        raise SchemaError(
            f"{path} is not as it was written: it was edited, or saved by another program; put the"
            " original back"
        )


def require_shallow(data: Any, what: str) -> None:
    """Refuse lists and mappings that are nested so deeply that who follows them runs out of stack.

    Raises
    ------
    SchemaError
        If they are; ``what`` is the file, for the message.
    """
    level, depth, most = [data] if isinstance(data, dict | list) else [], 0, _MOST_NESTING.most
    while level:
        depth += 1
        if depth > most:
            _MOST_NESTING.require(depth, f"{what}: how deeply its brackets are nested")
        level = [
            inner
            for node in level
            for inner in (node.values() if isinstance(node, dict) else node)
            if isinstance(inner, dict | list)
        ]


def require_whole_letters(text: str, data: Any, what: str) -> None:
    r"""Refuse halves of letters, such as ``"\ud800"``: no file or terminal takes them.

    Parameters
    ----------
    text : str
        The file.
    data : object
        What was read of it.
    what : str
        The file, for the message.

    Raises
    ------
    SchemaError
        With the first.
    """
    # Only escapes make them: the text itself is UTF-8.
    waiting = [data] if _HALF.search(text) else []
    while waiting:
        each = waiting.pop()
        if isinstance(each, str) and not each.isascii() and any(map(_is_half, each)):
            raise SchemaError(f"{what} holds {each!a:.60}, half of a letter")
        if isinstance(each, dict):
            waiting += [*each.keys(), *each.values()]
        elif isinstance(each, list):
            waiting += each


def _is_half(letter: str) -> bool:
    return "\ud800" <= letter <= "\udfff"


def parser_reason(error: Exception) -> str:
    """Return why a parser gave up, without its advice to programmers."""
    if isinstance(error, RecursionError):
        return "its brackets are nested too deeply"
    if "set_int_max_str_digits" in str(error):
        return "it holds a number of thousands of digits"
    # PyYAML has seen the text alone, and calls it a string in brackets.
    return " ".join(str(error).split()).replace(' in "<unicode string>",', "")


def json_sha256(data: Any) -> str:
    """Return the SHA-256 of JSON-ready data, the same whatever the order of keys and the spaces.

    The key `SEAL` is left out: a hash cannot count itself.
    """
    kept = {key: each for key, each in data.items() if key != SEAL} if SEAL in data else data
    return files.sha256(json.dumps(kept, sort_keys=True, separators=(",", ":")))


def require_seal(stated: object, found: str, what: str) -> None:
    """Refuse a file that states another hash of its content than its content has.

    Parameters
    ----------
    stated : object
        What it states under `SEAL`.
    found : str
        The hash of its content.
    what : str
        The file, for the message.

    Raises
    ------
    SchemaError
        With the beginning of both hashes, and the remedy.
    """
    if stated != found:
        raise SchemaError(
            f"{what} was changed after it was written: it states {SEAL} {str(stated)[:_SHOWN]!r},"
            f" its content has {found[:_SHOWN]!r}; put the original back or make it again; after an"
            f" edit on purpose take its {SEAL} out, and no report on it is green"
        )
