"""Say where lines of a page may end: before no unit or arrow, in code only between words.

Pages are written with plain spaces. Code keeps its characters, so that it can be copied.
"""

import re
from collections.abc import Iterator

from elastocal.units import with_fixed_units

_TAG = re.compile(r"(?s)<(pre|script|style)\b.*?</\1>|<[^>]*>")
"""A tag, or a whole block whose lines are its own."""
_NAME = re.compile(r"<(/?)(\w*)")
_SHORT, _MIDDLE, _LONG = 12, 16, 30
"""Characters of code that stay on one line, of code that does so on wide screens, and of code that
is divided outside tables, too."""
_HEADINGS = ("h1", "h2", "h3")
_OPTION = re.compile(r"(?<![\w-])(?:--[a-z]+|-[A-Za-z]\w*)")
_EXPONENT = re.compile(r"(?<=\de-)(?=\d)")
_QUANTITY = re.compile(r"[\d.]+\xa0[^\s\"]+")
_JOINED = re.compile(
    r" (?=→)|(?<=\d) (?=\d{3}\b)|(?<=\d) (?=to [-+−]?\d)|(?<=\d to) (?=[-+−]?\d)|(?<=→) (?=\d)"
)
"""Beside an arrow, in a number with groups of digits, and in an interval."""
_WORD_END = re.compile(r"(?<=\w[_|/+=\\])(?=\w\w)|(?<=\w\.)(?=\w{5})|(?<=[(;,])(?=\w)")
"""Where a name may be divided, but before no ending of a file."""


def on_page_content(html: str, **_: object) -> str:
    r"""Return the page with the places where lines may and may not end.

    >>> on_page_content("0.3 mm <td><code>base_transform --no-fit</code></td>").replace("\xa0", "~")
    '0.3~mm <td><code>base_<wbr>transform <span class="whole">--no</span>-fit</code></td>'
    """
    return "".join(_pieces(html))


def _pieces(html: str) -> Iterator[str]:
    end, within = 0, dict.fromkeys(("code", "td", "th", *_HEADINGS), False)
    for tag in _TAG.finditer(html):
        text = html[end : tag.start()]
        if within["code"]:
            yield _code(text, within["td"] or within["th"])
        elif any(within[each] for each in _HEADINGS):
            yield _WORD_END.sub("<wbr>", _prose(text))
        else:
            yield _prose(text)
        yield tag[0]
        end = tag.end()
        slash, name = _NAME.match(tag[0]).groups()
        if name in within:
            within[name] = not slash
    yield _prose(html[end:])


def _prose(text: str) -> str:
    joined = _EXPONENT.sub("\N{WORD JOINER}", _JOINED.sub("\N{NO-BREAK SPACE}", text))
    return with_fixed_units(joined)


def _code(text: str, in_cell: bool) -> str:
    if not text.strip():
        return text
    if len(text) <= _SHORT:
        return _whole(text)
    divided = _WORD_END.sub("<wbr>", text) if in_cell or len(text) > _LONG else text
    marked = _OPTION.sub(lambda option: _whole(option[0]), divided)
    fixed = with_fixed_units(marked)
    if fixed.replace("\xa0", " ") == marked:  # it writes 5% as 5 %
        marked = _QUANTITY.sub(lambda found: _whole(found[0].replace("\xa0", " ")), fixed)
    return _whole(marked, "whole wide") if len(text) <= _MIDDLE else marked


def _whole(text: str, kind: str = "whole") -> str:
    return f'<span class="{kind}">{text}</span>'
