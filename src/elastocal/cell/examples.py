"""Example cells with toolings that are made by code: always the same bytes."""

import importlib.resources
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import FileAccessError, SchemaError, nearest
from elastocal.files import write_bytes, write_text
from elastocal.results import brief_repr

_DOME_RADII = (2.4, 1.5)
"""Radius and height in m of the ellipsoid of revolution that a rear pressure dome resembles."""
_DOME_POLAR = (0.366, 0.934)
"""Range of the section along the meridian, as ellipse parameter in rad."""
_DOME_AZIMUTH = np.pi / 8.0
"""Half the angle that the section spans about the dome's axis, in rad (one of eight)."""
_DOME_CELLS = 32
BLOCK_SIZE = (0.6, 0.4, 0.3)
"""Edge lengths of the block of raw material along x, y, z in m."""
_STL_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CELL_FILE = "cell.yaml"
PROCESS_FILE = "process.csv"
"""Name of an example's production path."""
_WIRE = re.compile(r"^# devices: .*\n(?:#   .*\n)+", re.M)
"""Section ``devices`` of an example, out of use."""
_WITH_PROCESS = (
    (
        re.compile(r"^  technique: cover\n", re.M),
        "  # technique: cover                  # i_optimal for the process unless one is named\n",
    ),
    (
        re.compile(
            r'^  (?:d_max: "175 mm" .*\n  # poses: (\d+) .*|poses: (\d+) .*\n  # .*)\n', re.M
        ),
        r"  poses: \1\2                           # six to eight may do: `plan --poses 8`"
        '\n  # accuracy: "0.05 mm"               # or the error on production that is wanted\n',
    ),
    (
        re.compile(r"^# process: \{file: process\.csv\} .*\n", re.M),
        "process: {file: process.csv}          # joints or tcp poses and forces of production\n",
    ),
)
"""Lines of an example's cell file and their replacement once its process is named."""


def dome_section() -> FloatArray:
    """Return the triangles of one of eight sections of a dome, open at its border.

    The frame lies at the section's middle, z along the outward normal there, x down the
    meridian.

    Returns
    -------
    ndarray, shape (face, 3, 3)
        Corners, counter-clockwise as seen from outside, in m.
    """
    polar = np.linspace(*_DOME_POLAR, _DOME_CELLS + 1)
    azimuth = np.linspace(-_DOME_AZIMUTH, _DOME_AZIMUTH, _DOME_CELLS + 1)
    t, a = np.meshgrid(polar, azimuth, indexing="ij")
    points = _on_dome(t, a)
    T = _dome_frame()
    own = (points.reshape(-1, 3) - T[:3, 3]) @ T[:3, :3]
    return own[_grid_faces(_DOME_CELLS + 1)]


def block_mesh() -> FloatArray:
    """Return the triangles of a block that stands on z = 0, centred on x = y = 0.

    Returns
    -------
    ndarray, shape (12, 3, 3)
        Corners, counter-clockwise as seen from outside, in m.
    """
    x, y, z = BLOCK_SIZE
    triangles = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            quad = np.zeros((4, 3))
            quad[:, axis] = side
            quad[:, (axis + 1) % 3] = (-1.0, 1.0, 1.0, -1.0)
            quad[:, (axis + 2) % 3] = (-side, -side, side, side)
            triangles += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    return 0.5 * np.array(triangles) * (x, y, z) + (0.0, 0.0, 0.5 * z)


def _on_dome(t: FloatArray, a: FloatArray) -> FloatArray:
    """Return points of the ellipsoid at ellipse parameter t and azimuth a, shape (..., 3)."""
    radius, height = _DOME_RADII
    ring = radius * np.sin(t)
    return np.stack([ring * np.cos(a), ring * np.sin(a), height * np.cos(t)], axis=-1)


def _dome_frame() -> FloatArray:
    """Return the section's frame in the dome's: z out of the middle, x down the meridian."""
    t = np.array(0.5 * sum(_DOME_POLAR))
    radius, height = _DOME_RADII
    down = np.array([radius * np.cos(t), 0.0, -height * np.sin(t)])
    x, y = down / np.linalg.norm(down), np.array([0.0, 1.0, 0.0])
    T = np.eye(4)
    T[:3, :3] = np.stack([x, y, np.cross(x, y)], axis=1)
    T[:3, 3] = _on_dome(t, np.array(0.0))
    return T


def _grid_faces(n: int) -> IndexArray:
    """Return the two triangles of every cell of an n by n grid of vertices."""
    index = np.arange(n * n).reshape(n, n)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    halves = [np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]
    return np.concatenate([half.reshape(-1, 3) for half in halves])


@brief_repr
@dataclass(frozen=True)
class Example:
    """A cell file of this package with the meshes that it names."""

    template: str
    meshes: dict[str, Callable[[], FloatArray]]
    """Function that makes the triangles of each mesh file, shape (face, 3, 3), in m."""


EXAMPLES = {
    "afp": Example("afp.yaml", {"dome.stl": dome_section}),
    "machining": Example("machining.yaml", {"block.stl": block_mesh}),
    "ur20": Example("ur20.yaml", {"block.stl": block_mesh}),
}
"""Fibre placement on a dome section, and machining of a block: the paper's two case studies."""


def require_example(like: str) -> None:
    """Refuse the name of an example that there is not.

    Raises
    ------
    SchemaError
        Which lists the examples.
    """
    if like not in EXAMPLES:
        raise SchemaError(
            f"no example cell {like!r}{nearest(like, EXAMPLES)} (examples: {', '.join(EXAMPLES)})"
        )


def write_example(
    folder: Path, like: str, force: bool = False, wire: bool = False
) -> tuple[Path, ...]:
    """Write an example cell and return the paths of its files, the cell file first.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    like : str
        A key of `EXAMPLES`.
    force : bool
        Whether files that are there may be replaced.
    wire : bool
        Whether its devices are on the wire: those that `elastocal simulate` then serves.

    Raises
    ------
    SchemaError
        If there is no such example.
    FileAccessError
        If a file is there already, or the folder cannot be written.
    """
    require_example(like)
    example = EXAMPLES[like]
    paths = (folder / _CELL_FILE, *(folder / name for name in example.meshes))
    for path in paths:
        if path.exists() and not force:
            raise FileAccessError(f"{path} is there already: give --force to replace it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileAccessError(f"cannot make folder {folder}: {error.strerror}") from error
    # The cell file comes last: where it is, its meshes are.
    for name, triangles in example.meshes.items():
        write_bytes(folder / name, binary_stl(triangles()))
    template = importlib.resources.files(__package__).joinpath("templates", example.template)
    text = template.read_text(encoding="utf-8")
    write_text(paths[0], _WIRE.sub(_in_use, text) if wire else text)
    return paths


def _in_use(section: re.Match[str]) -> str:
    return re.sub(r"^# ", "", section[0], flags=re.M)


def name_process(text: str) -> str:
    """Return the text of an example's cell file that names its production path, `PROCESS_FILE`.

    The poses are then chosen for production, as many as before.

    Raises
    ------
    SchemaError
        If it is not the text of an example.
    """
    for pattern, replacement in _WITH_PROCESS:
        text, count = pattern.subn(replacement, text)
        if count != 1:
            raise SchemaError(f"a cell file of an example has no line like {pattern.pattern!r}")
    return text


def binary_stl(triangles: FloatArray) -> bytes:
    """Return triangles as a binary STL in mm, the unit that CAD systems write.

    Parameters
    ----------
    triangles : ndarray, shape (face, 3, 3)
        Corners in m.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    faces = np.zeros(len(triangles), _STL_FACE)
    faces["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    faces["corners"] = 1e3 * triangles
    header = b"made by elastocal init; unit mm".ljust(80)
    return header + len(faces).to_bytes(4, "little") + faces.tobytes()
