"""Break long lines for paper."""

import textwrap


def wrapped(text: str, width: int) -> list[str]:
    """Return a text in lines of at most ``width`` characters.

    >>> wrapped("one two three", 8)
    ['one two', 'three']
    """
    return textwrap.wrap(text, width, break_long_words=True, break_on_hyphens=False)
