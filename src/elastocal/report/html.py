"""Pages that hold all they need and ask the network for nothing."""

import importlib.resources
import json
from typing import Any


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
