"""Names from files inside C comments."""

import string

_ALLOWED = set(string.ascii_letters + string.digits + " .,:;_-+()[]#'=<>%^/!")


def remark(text: str) -> str:
    """Return a text that cannot end a C comment or continue its line.

    >>> remark("arm */ int x;")
    'arm  / int x;'
    """
    return "".join(character if character in _ALLOWED else " " for character in text)
