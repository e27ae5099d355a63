"""The one place that renders templates: Jinja2, every value escaped, no undefined name.

Pages hold all they need, the drawing library included, and ask the network for nothing: their
content security policy forbids it to them, and every script that they did not come with.
"""

import base64
import hashlib
import json
import re
from collections.abc import Callable, Iterable
from functools import cache, partial
from importlib import resources
from typing import TYPE_CHECKING, Any

from elastocal.report.language import ENGLISH, Language, language_of
from elastocal.report.plots import sequential_stops, themed_svg
from elastocal.templating import templates
from elastocal.wording import phrase

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup
    from matplotlib.figure import Figure

_POLICY = "default-src 'none'; script-src {scripts}; style-src {styles}; img-src data: blob:"
"""Lets a page load nothing, and run no script and have no style but its own, by their SHA-256."""
_EMPTY = ""
"""The style that the drawing library begins with, and fills rule by rule."""
_STYLES_SET_BY_RULE = """(() => {
  const set = Element.prototype.setAttribute;
  Element.prototype.setAttribute = function (name, value) {
    if (name === "style") this.style.cssText = value;
    else set.call(this, name, value);
  };
})();
"""
"""Script before the drawing library, which writes some styles as attributes: a policy without
``unsafe-inline`` ignores those, and lets scripts set the same styles as properties."""

_STYLE_OF_MAPS = re.compile(r"(e\.textContent=)'\.maplibregl(?:[^'\\]|\\.)*'")
"""Its only style that is written out in full is for maps, which no page uses."""


def render(template: str, language: Language = ENGLISH, **values: Any) -> str:
    """Return a template with its values.

    Parameters
    ----------
    template : str
        Name of a file in the folder ``templates``.
    language : Language
        In which its phrases are said.
    **values
        For the names in it; one that is missing is an error.
    """
    made = _pages(language.code).get_template(template)
    return made.render(values | {"language": language.code})


def embedded(data: Any) -> "Markup":
    r"""Return JSON that no HTML parser takes for markup.

    >>> str(embedded({"name": "</script>"}))
    '{"name":"\\u003c/script\\u003e"}'

    Raises
    ------
    ValueError
        If a number is not finite: JSON has no sign for it.
    """
    from markupsafe import Markup

    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


@cache
def _pages(code: str) -> "Environment":
    """Return the templates of pages, saying their words in a language."""
    pages, language = templates("elastocal.report.pages", markup=True).overlay(), language_of(code)
    say = language.say
    # An overlay shares these with what it lies over, and each language has its own.
    pages.globals = pages.globals | {
        "policy": _policy,
        "asset": _asset,
        "plotly": _plotly,
        "margin_scale": sequential_stops,
    }
    pages.filters = pages.filters | {
        "embedded": embedded,
        "pieces": _pieces,
        "say": say,
        # For text between tags, not within one.
        "shown": language.markup,
        # Words of the templates themselves.
        "words": lambda text: say(phrase(text)),
        "drawn": partial(_data_url, language),
    }
    return pages


def _data_url(language: Language, draw: "Callable[[], Figure]") -> str:
    svg = themed_svg(draw, None if language is ENGLISH else language.say)
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode('ascii')}"


def _policy(style: str, drawing: str, script: str) -> str:
    """Return the content security policy of a page with this style and these scripts."""
    styles = _hashes([style, _EMPTY] if drawing else [style])
    return _POLICY.format(scripts=_hashes([drawing, script]), styles=styles)


def _hashes(texts: Iterable[str]) -> str:
    digests = (hashlib.sha256(text.encode("utf-8")).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


def _asset(name: str) -> "Markup":
    """Return a style sheet or a script of the templates or of the viewer, unchanged."""
    from markupsafe import Markup

    if name.startswith("viewer."):
        folder = resources.files("elastocal.viewer")
    else:
        folder = resources.files("elastocal.report.pages").joinpath("templates")
    return Markup(folder.joinpath(name).read_text(encoding="utf-8"))


def _plotly() -> "Markup":
    """Return the drawing library: four and a half megabytes. Its styles obey the page's policy."""
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    return Markup(_STYLES_SET_BY_RULE + _STYLE_OF_MAPS.sub(r"\1''", get_plotlyjs()))


def _pieces(text: str) -> list[str]:
    """Return a text in pieces, every second of which was in backticks; markup stays markup.

    >>> _pieces("run `elastocal tool` & see")
    ['run ', 'elastocal tool', ' & see']
    """
    return [type(text)(piece) for piece in re.split(r"`([^`]+)`", text)]
