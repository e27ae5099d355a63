"""Files of triangles: STL, OBJ and PLY, of any author, as trimesh reads them.

A damaged STL is refused here, since the messages of readers do not help the user. A binary STL has
a header of 80 bytes, the number of its triangles as 4 bytes, and 50 bytes for each triangle; a text
STL begins with ``solid`` and has ``endfacet`` after each triangle.

Only numbers and keywords of a mesh matter, which are ASCII. Names and comments may have any
encoding, which the file does not state: other letters are dropped, since trimesh would guess the
encoding with a package that elastocal does not require.
"""

import io
import re
from pathlib import Path

import numpy as np
import trimesh

from elastocal.errors import SchemaError
from elastocal.files import read_bytes

SUFFIXES = (".stl", ".obj", ".ply")
"""Kinds of mesh files."""
_HEAD, _TRIANGLE = 84, 50
_BEGIN, _END = re.compile(rb"\bfacet\s+normal\b", re.I), re.compile(rb"\bendfacet\b", re.I)
_LOOKED_AT = 1000
_ASCII = bytes(byte if byte < 128 else ord("?") for byte in range(256))
_PLY_HEAD = re.compile(rb"\A.*?\bend_header\r?\n", re.S)
_PLY_TEXT = re.compile(rb"[\r\n]format\s+ascii\b")
_INCHES = re.compile(rb"\binch(?:es)?\b|\bunits?\W{0,3}in\b", re.I)
"""Spellings of inches in heads or comments; none of the formats has a field for the unit."""


def load_triangles(path: Path) -> trimesh.Trimesh:
    """Return the triangles of a mesh file, in its own unit, unchanged.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    SchemaError
        If its contents are not what its suffix says.
    """
    data, suffix = _bytes_of(path), path.suffix.lower()
    is_text = suffix == ".obj"
    if suffix == ".stl":
        size = _check_stl(data, f"mesh {path}")
        is_text = size is None
        # Data after the last triangle, such as padding or a signature, are ignored.
        data = data if is_text else data[:80].translate(_ASCII) + data[80:size]
    if suffix == ".ply":
        head = _PLY_HEAD.match(data)
        end = head.end() if head else len(data)
        is_text = _PLY_TEXT.search(data[:end]) is not None
        data = data[:end].translate(_ASCII) + data[end:]
    if is_text:
        # Old Macs, and some exporters since, end lines by a carriage return alone.
        data = data.translate(_ASCII).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    try:
        # A float that is no number is refused by who uses the mesh.
        with np.errstate(invalid="ignore"):
            mesh: object = trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False)
    # What the readers of trimesh raise on bad contents is not documented; these were seen, or their
    # like.
    except (
        *(ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, RuntimeError),
        *(TypeError, ValueError),
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(f"mesh {path} is not a readable {suffix[1:]}: {reason}") from error
    for name in ("vertices", "faces"):
        shape = np.shape(getattr(mesh, name, ()))
        if 0 not in shape and shape[1:] != (3,):
            raise SchemaError(f"mesh {path}: its {name} have {shape[-1]} numbers each, not 3")
    # Of a file without triangles some releases of trimesh make an empty scene.
    return mesh if isinstance(mesh, trimesh.Trimesh) else trimesh.Trimesh()


def says_inches(path: Path) -> bool:
    """Return whether the head of a mesh file mentions inches.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    """
    return _INCHES.search(_bytes_of(path)[:_LOOKED_AT]) is not None


def _bytes_of(path: Path) -> bytes:
    return read_bytes(path).removeprefix(b"\xef\xbb\xbf")  # the mark of Windows


def _check_stl(data: bytes, what: str) -> int | None:
    """Return the size of a binary STL, None for a text; refuse invalid or truncated files.

    Parameters
    ----------
    data : bytes
        Contents of the file.
    what : str
        Name of the file, for messages.

    Raises
    ------
    SchemaError
        With what is missing.
    """
    if not data:
        raise SchemaError(f"{what} is empty")
    count = int.from_bytes(data[80:_HEAD], "little")
    promised = _HEAD + _TRIANGLE * count
    if len(data) >= _HEAD and len(data) == promised:
        return promised
    start = data[:_LOOKED_AT]
    # A truncated file may begin with what usually follows the end: a zero, a mark of DOS.
    if start.lstrip()[:5].lower() == b"solid" and (_is_text(start) or _END.search(start)):
        begun, ended = len(_BEGIN.findall(data)), len(_END.findall(data))
        if begun > ended:
            raise SchemaError(
                f"{what} is cut short: it begins {begun} triangles and ends {ended} of them"
            )
        return None
    if _is_text(start):
        raise SchemaError(f"{what} is no STL: it is a text that does not begin with 'solid'")
    if len(data) < _HEAD:
        raise SchemaError(f"{what} is no STL: it has {len(data)} bytes, the head alone has 84")
    if len(data) < promised:
        raise SchemaError(
            f"{what} is cut short, or no STL: its head promises {count} triangles, which take"
            f" {promised} bytes; it has {len(data)}"
        )
    return promised


def _is_text(data: bytes) -> bool:
    return all(byte >= 32 or byte in b"\t\n\r\f" for byte in data)
