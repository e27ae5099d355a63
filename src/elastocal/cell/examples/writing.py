"""Write an example cell into a folder."""

import importlib.resources
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from elastocal.arrays import FloatArray
from elastocal.cell.examples.meshes import binary_stl, block, dome_section
from elastocal.errors import FileAccessError, SchemaError, nearest
from elastocal.files import replacing, write_text

CELL_FILE = "cell.yaml"


@dataclass(frozen=True)
class Example:
    """A cell file of this package with the meshes that it names."""

    template: str
    meshes: dict[str, Callable[[], FloatArray]]
    """What makes the triangles of each mesh file, shape (face, 3, 3), in m."""


EXAMPLES = {
    "afp": Example("afp.yaml", {"dome.stl": dome_section}),
    "machining": Example("machining.yaml", {"block.stl": block}),
}
"""Fibre placement on a dome section, and machining of a block: the paper's two case studies."""


def check_like(like: str) -> None:
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


def write_example(folder: Path, like: str, force: bool = False) -> tuple[Path, ...]:
    """Write an example cell and return the paths of its files, the cell file first.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    like : str
        A key of `EXAMPLES`.
    force : bool
        Whether files that are there may be replaced.

    Raises
    ------
    SchemaError
        If there is no such example.
    FileAccessError
        If a file is there already, or the folder cannot be written.
    """
    check_like(like)
    example = EXAMPLES[like]
    paths = (folder / CELL_FILE, *(folder / name for name in example.meshes))
    for path in paths:
        if path.exists() and not force:
            raise FileAccessError(f"{path} is there already: give --force to replace it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileAccessError(f"cannot make folder {folder}: {error.strerror}") from error
    # The cell file comes last: where it is, its meshes are.
    for name, triangles in example.meshes.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(binary_stl(triangles()))
    text = importlib.resources.files(__package__).joinpath(example.template)
    write_text(paths[0], text.read_text(encoding="utf-8"))
    return paths
