"""Templates: Jinja2, in which no name may be undefined; texts for controllers, and markup."""

import unicodedata
from functools import cache
from typing import TYPE_CHECKING

from elastocal.errors import ReportError

if TYPE_CHECKING:
    from jinja2 import Environment

_LONGEST_TEXT = 80


@cache
def templates(package: str, markup: bool = False) -> "Environment":
    """Return the templates in the folder ``templates`` of a package.

    Parameters
    ----------
    package : str
        Its full name.
    markup : bool
        Whether they are pages, of which every value is escaped; else texts with their last line
        end, in which every value stays within its line, and the filter `plain`.

    Raises
    ------
    ReportError
        On rendering a text, if a value has a line end or another control sign: it could begin a
        statement of the program that the text is.
    """
    # Takes long to import, and few commands fill templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(package),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=not markup,
        finalize=None if markup else _one_line,
    )
    environment.filters["plain"] = plain
    return environment


def _one_line(value: object) -> object:
    """Return a value as written in a program: from a macro, or one line of text."""
    from markupsafe import Markup

    if isinstance(value, Markup):
        return value
    text = str(value)
    if not text.isprintable():
        raise ReportError(f"{text[:_LONGEST_TEXT]!r} cannot stand in a program: give one line")
    return Markup(text)


def plain(text: str) -> str:
    r"""Return a text that is allowed in a comment: ASCII, one line, without fold parameters.

    >>> plain("Höhe 5 %\nneu")
    'Hohe 5 ? neu'
    """
    folded = unicodedata.normalize("NFKD", text)
    folded = "".join(sign for sign in folded if not unicodedata.combining(sign))
    line = " ".join(folded.encode("ascii", "replace").decode("ascii").split())
    # In the title of a KRL fold a percent sign begins its hidden parameters.
    line = "".join(sign if sign.isprintable() and sign != "%" else "?" for sign in line)
    return line[:_LONGEST_TEXT]
