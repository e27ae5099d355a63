"""Pages that hold all they need and ask the network for nothing."""

import importlib.resources
import json
from typing import Any

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
)
"""What the page may load: nothing but what stands in it."""


def embedded(data: dict[str, Any]) -> str:
    r"""Return JSON that no HTML parser takes for markup.

    >>> embedded({"name": "</script>"})
    '{"name":"\\u003c/script\\u003e"}'

    Raises
    ------
    ValueError
        If a number is not finite: JSON has no sign for it.
    """
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def template(name: str) -> str:
    """Return the text of a file beside the templates of pages."""
    folder = importlib.resources.files(__package__).joinpath("templates")
    return folder.joinpath(name).read_text(encoding="utf-8")
