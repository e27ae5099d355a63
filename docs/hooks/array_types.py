"""Show array types in the API pages as the docstrings write them.

``q : array_like, shape (..., joint)`` is read as a Python tuple on its way to the page, and
comes out as ``(array_like, shape(..., joint))``. This takes the outer brackets away again, and
those around several errors.
"""

import re

_TUPLE = re.compile(r"<code>\((\w[\w ]*, shape)\((.*?)\)\)</code>", flags=re.DOTALL)
_ERRORS = re.compile(r"<code>\(((?:<[^>]*>|\w+Error|,\s)+)\)</code>")
_AXIS = re.compile(r"[\w ]+")


def on_page_content(html: str, **_: object) -> str:
    """Return the page with array types as ``array_like, shape (..., joint)``.

    >>> on_page_content("<code>(<a>PathError</a>, SchemaError)</code>, <code>(q, force)</code>")
    '<code><a>PathError</a>, SchemaError</code>, <code>(q, force)</code>'
    """
    shaped = _TUPLE.sub(lambda match: f"<code>{match[1]} ({_shape(match[2])})</code>", html)
    return _ERRORS.sub(r"<code>\1</code>", shaped).replace("path - like", "path-like")


def _shape(axes: str) -> str:
    """Return the axes, with the comma that makes a tuple of a single one."""
    return f"{axes}," if _AXIS.fullmatch(axes) else axes
