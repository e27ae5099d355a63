"""Edits of a cell file as text: what is not edited keeps every letter, comments among them.

A place in the file is its keys from the top: ``("surface", "region", "box", "min", 0)``. YAML says
where a value begins and ends; the letters between are replaced, and nothing else.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence

import yaml

from elastocal.errors import SchemaError

Key = str | int
"""Name of a key, or number of an item."""
Value = str | float | Sequence["Value"] | Mapping[str, "Value"]
"""What a place may be given; a text is always written in quotes."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LINE = re.compile(r"[ \t]*(#[^\r\n]*)?(\r\n|\n|\Z)")
"""What may stand behind a value on its line."""


def with_value(text: str, place: Sequence[Key], value: Value) -> str:
    """Return the text with another value at a place; keys that are not there yet are added.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place cannot be there.
    """
    node, depth = _deepest(text, place)
    if depth == len(place):
        return _replaced(text, node, flow(value))
    for key in reversed(place[depth + 1 :]):
        value = {str(key): value}
    return _added(text, node, place[depth], value)


def without(text: str, place: Sequence[Key]) -> str:
    """Return the text without a place; the same text where there is none.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place is in a list or mapping that is written on one line.
    """
    parent, depth = _deepest(text, place[:-1])
    if depth < len(place) - 1:
        return text
    for start, end in _entries(text, parent, place[-1]):
        if _is_flow(parent):
            names = ".".join(map(str, place))
            raise SchemaError(f"{names} is written on one line with others: edit the text")
        return text[: _line_start(text, start)] + text[end:]
    return text


def appended(text: str, place: Sequence[Key], value: Value) -> str:
    """Return the text with one more item at the end of a list, which is made where it is not there.

    Raises
    ------
    SchemaError
        If the text is no YAML, or the place is no list.
    """
    node, depth = _deepest(text, place)
    if depth < len(place):
        return with_value(text, place, [value])
    if not isinstance(node, yaml.SequenceNode):
        raise SchemaError(f"{'.'.join(map(str, place))} is no list")
    if _is_flow(node) or not node.value:
        end = text.rindex("]", node.start_mark.index, node.end_mark.index)
        comma = ", " if node.value else ""
        return f"{text[:end].rstrip()}{comma}{flow(value)}{text[end:]}"
    dash = text.rindex("-", 0, node.value[0].start_mark.index)
    indent = text[_line_start(text, dash) : dash]
    return _inserted(text, _end_of(node), f"{indent}- {flow(value)}")


def count_items(text: str, place: Sequence[Key]) -> int:
    """Return the number of items of a list; 0 where it is not there."""
    node, depth = _deepest(text, place)
    return len(node.value) if depth == len(place) and not isinstance(node, yaml.ScalarNode) else 0


def flow(value: Value) -> str:
    """Return a value as YAML on one line.

    >>> flow({"name": "station 1", "range": ["1 m", 15.0]})
    '{name: "station 1", range: ["1 m", 15]}'

    Raises
    ------
    SchemaError
        If a number is not finite.
    """
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(k)}: {flow(each)}" for k, each in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(flow, value)) + "]"
    if not math.isfinite(value):
        raise SchemaError(f"{value!r} is no number for a cell file")
    return f"{value:.12g}"


def _key(name: str) -> str:
    return name if _PLAIN.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _deepest(text: str, place: Sequence[Key]) -> tuple[yaml.Node, int]:
    """Return the node farthest along a place, and how many of its keys lead there."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark is not None else ""
        raise SchemaError(f"{where}{getattr(error, 'problem', None) or 'is no YAML'}") from error
    if not isinstance(node, yaml.MappingNode):
        raise SchemaError("a cell file has keys and values")
    found: yaml.Node = node
    for depth, key in enumerate(place):
        child = _child(found, key)
        if child is None:
            return found, depth
        found = child
    return found, len(place)


def _child(node: yaml.Node, key: Key) -> yaml.Node | None:
    if isinstance(node, yaml.MappingNode):
        return next((value for name, value in node.value if name.value == str(key)), None)
    if isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
        child: yaml.Node = node.value[key]
        return child
    return None


def _entries(text: str, node: yaml.Node, key: Key) -> list[tuple[int, int]]:
    """Return where the lines of a key or item begin and end: of one, or of none."""
    if isinstance(node, yaml.MappingNode):
        pairs = [(name.start_mark.index, value) for name, value in node.value if name.value == key]
    elif isinstance(node, yaml.SequenceNode) and isinstance(key, int):
        pairs = [
            (text.rfind("-", 0, value.start_mark.index), value)
            for value in node.value[key : key + 1]
        ]
    else:
        pairs = []
    return [(start, _rest_of_line(text, _end_of(value))) for start, value in pairs]


def _replaced(text: str, node: yaml.Node, new: str) -> str:
    """Return the text with other letters for a node; a block becomes what stands on one line."""
    start, end = node.start_mark.index, _end_of(node)
    if isinstance(node, yaml.ScalarNode) or _is_flow(node):
        return text[:start] + new + text[end:]
    line = _line_start(text, start)
    if text[line:start].strip():
        return text[:start] + new + text[end:]
    # The key stands on a line before: its colon is followed by the value from here on.
    colon = text.rindex(":", 0, line)
    return f"{text[: colon + 1]} {new}{text[colon + 1 : line].rstrip()}{text[end:]}"


def _added(text: str, node: yaml.Node, key: Key, value: Value) -> str:
    if not isinstance(node, yaml.MappingNode) or not isinstance(key, str):
        raise SchemaError(f"there is no place for {key!r} in the file")
    if _is_flow(node):
        end = text.rindex("}", node.start_mark.index, node.end_mark.index)
        comma = ", " if node.value else ""
        return f"{text[:end].rstrip()}{comma}{_key(key)}: {flow(value)}{text[end:]}"
    first = node.value[0][0].start_mark.index
    indent = " " * (first - _line_start(text, first))
    return _inserted(text, _end_of(node), f"{indent}{_key(key)}: {flow(value)}")


def _inserted(text: str, end: int, line: str) -> str:
    """Return the text with a line more, behind the one in which a node ends."""
    newline = "\r\n" if "\r\n" in text else "\n"
    place = _rest_of_line(text, end)
    before = text[:place] if text[:place].endswith("\n") else text[:place] + newline
    return f"{before}{line}{newline}{text[place:]}"


def _end_of(node: yaml.Node) -> int:
    """Return where the last letter of a node ends: YAML lets a block reach to the next key."""
    if isinstance(node, yaml.ScalarNode) or _is_flow(node) or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end_of(last[1] if isinstance(node, yaml.MappingNode) else last)


def _is_flow(node: yaml.Node) -> bool:
    """Return whether a node is written in brackets, on one line or several."""
    return isinstance(node, yaml.CollectionNode) and bool(node.flow_style)


def _line_start(text: str, index: int) -> int:
    return text.rfind("\n", 0, index) + 1


def _rest_of_line(text: str, index: int) -> int:
    """Return where the line of an index ends, its comment and its end included."""
    match = _LINE.match(text, index)
    return match.end() if match else index
