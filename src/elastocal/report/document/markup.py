"""Pieces of the page: tables that scroll, lists, pictures with words for them."""

from collections.abc import Iterable, Iterator, Sequence
from html import escape

_SHORT = 24
"""Lines of a table up to which it is kept together on paper."""


class Markup(str):
    """HTML that is put into the page as it is; every other text is escaped."""

    __slots__ = ()


def html(value: object) -> str:
    """Return a value as HTML.

    >>> html("a < b"), html(Markup("<b>c</b>"))
    ('a &lt; b', '<b>c</b>')
    """
    return str(value) if isinstance(value, Markup) else escape(str(value))


def paragraph(text: object, kind: str = "") -> str:
    """Return a paragraph, with a class where it has a kind."""
    return f"<p{_kind(kind)}>{html(text)}</p>"


def heading(text: object) -> str:
    """Return a heading below that of a section."""
    return f"<h3>{html(text)}</h3>"


def listed(items: Iterable[object], kind: str = "") -> str:
    """Return a list; empty without items."""
    rows = "".join(f"<li>{html(item)}</li>" for item in items)
    return f"<ul{_kind(kind)}>{rows}</ul>" if rows else ""


def facts(pairs: Iterable[tuple[object, object]]) -> str:
    """Return key figures as name and value with its unit."""
    rows = "".join(
        f"<div><dt>{html(name)}</dt><dd>{html(value)}</dd></div>" for name, value in pairs
    )
    return f'<dl class="figures">{rows}</dl>'


def table(
    caption: object, heads: Sequence[object], rows: Iterable[Sequence[object]], texts: int = 1
) -> str:
    """Return a table that scrolls by itself where the page is narrow.

    Parameters
    ----------
    caption : object
        What it shows.
    heads : sequence
        A heading a column.
    rows : iterable of sequence
        Cells; the first of each names the row.
    texts : int
        Columns that hold text and stand to the left; the others hold numbers.
    """
    top = "".join(
        f'<th scope="col"{_side(k, texts)}>{html(head)}</th>' for k, head in enumerate(heads)
    )
    lines = list(rows)
    body = "".join(
        "<tr>"
        + "".join(
            f'<th scope="row">{html(cell)}</th>'
            if k == 0
            else f"<td{_side(k, texts)}>{html(cell)}</td>"
            for k, cell in enumerate(row)
        )
        + "</tr>"
        for row in lines
    )
    # A table of a few lines stays on one sheet of paper.
    kind = "wide short" if len(lines) <= _SHORT else "wide"
    label = escape(plain(caption), quote=True)
    return (
        f'<div class="{kind}" tabindex="0" role="region" aria-label="{label}">'
        f"<table><caption>{html(caption)}</caption><thead><tr>{top}</tr></thead>"
        f"<tbody>{body}</tbody></table></div>"
    )


def folded(summary: object, inner: str, kind: str = "") -> str:
    """Return what a reader may open; of the kind ``long``, it stays folded on paper."""
    return f"<details{_kind(kind)}><summary>{html(summary)}</summary>{inner}</details>"


def flattened(value: object, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield every leaf of nested settings with its path.

    >>> list(flattened({"a": {"b": 0.5, "c": [1, 2]}, "d": None}))
    [('a.b', '0.5'), ('a.c', '1, 2'), ('d', 'none')]
    """
    if isinstance(value, dict):
        for key, each in value.items():
            yield from flattened(each, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(value, list) and any(isinstance(each, dict) for each in value):
        for number, each in enumerate(value):
            yield from flattened(each, f"{prefix}.{number}")
    else:
        yield prefix, _leaf(value)


def _leaf(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_leaf, value)) or "none"
    if isinstance(value, float):
        return f"{value:.10g}"
    return "none" if value is None else str(value)


def verbatim(text: str) -> str:
    """Return a text as it stands."""
    return f'<pre tabindex="0">{escape(text)}</pre>'


def stamp(text: str) -> Markup:
    """Return a time of day; nothing else differs between reports of equal runs."""
    return Markup(
        f'<time class="stamp" datetime="{escape(text, quote=True)}">{escape(text)}</time>'
    )


def plain(text: object) -> str:
    """Return a text without tags.

    >>> plain(Markup("a <b>b</b>"))
    'a b'
    """
    out, inside = [], False
    for sign in str(text):
        inside = (inside or sign == "<") if sign != ">" else False
        if not inside and sign != ">":
            out.append(sign)
    return "".join(out) if isinstance(text, Markup) else str(text)


def _kind(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _side(column: int, texts: int) -> str:
    return ' class="text"' if column < texts else ""
