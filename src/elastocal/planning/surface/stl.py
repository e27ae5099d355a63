"""Whether bytes are a whole STL: readers say of a damaged one what helps nobody.

A binary STL has a header of 80 bytes, the number of its triangles as 4 bytes, and 50 bytes for
each triangle; a text STL begins with ``solid`` and has ``endfacet`` after each triangle.
"""

import re

from elastocal.planning.surface.errors import SurfaceError

_HEAD, _TRIANGLE = 84, 50
_BEGIN, _END = re.compile(rb"\bfacet\s+normal\b", re.I), re.compile(rb"\bendfacet\b", re.I)
_LOOKED_AT = 1000


def check_stl(data: bytes, what: str) -> None:
    """Refuse what is no STL, or only the beginning of one.

    Parameters
    ----------
    data : bytes
        Contents of the file.
    what : str
        Name of the file, for messages.

    Raises
    ------
    SurfaceError
        With what is missing.
    """
    if not data:
        raise SurfaceError(f"{what} is empty")
    count = int.from_bytes(data[80:_HEAD], "little")
    promised = _HEAD + _TRIANGLE * count
    if len(data) >= _HEAD and len(data) == promised:
        return
    if data[:_LOOKED_AT].lstrip()[:5].lower() == b"solid" and _is_text(data[:_LOOKED_AT]):
        begun, ended = len(_BEGIN.findall(data)), len(_END.findall(data))
        if begun > ended:
            raise SurfaceError(
                f"{what} is cut short: it begins {begun} triangles and ends {ended} of them"
            )
        return
    if _is_text(data[:_LOOKED_AT]):
        raise SurfaceError(f"{what} is no STL: it is a text that does not begin with 'solid'")
    if len(data) < _HEAD:
        raise SurfaceError(f"{what} is no STL: it has {len(data)} bytes, the head alone has 84")
    if len(data) < promised:
        raise SurfaceError(
            f"{what} is cut short, or no STL: its head promises {count} triangles, which take"
            f" {promised} bytes; it has {len(data)}"
        )


def _is_text(data: bytes) -> bool:
    return all(byte >= 32 or byte in b"\t\n\r\f" for byte in data)
