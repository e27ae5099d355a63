"""Fingerprint of a cell: whether a plan or a run belongs to the cell as it is now."""

import hashlib
import json
import os
from collections.abc import Iterator

from elastocal.cell.description import Cell
from elastocal.errors import FileAccessError
from elastocal.robot import is_relative

RUN_SECTIONS = ("acceptance", "procedure", "devices", "simulation", "faults")
"""Sections of the cell file that say how a plan is carried out and its result is judged; a plan
does not depend on them."""


def fingerprint(cell: Cell) -> str:
    """Return a SHA-256 over what a cell file says and the files that it names.

    It changes with every value of the cell file, defaults included, and with every byte of the
    surface, the mesh shapes, the robot's URDF with the meshes of its collision shapes, and the
    process file. It does not change with
    comments, the order of keys, the way a number is written, the place of the folder, or the
    sections that say how a plan is carried out (`RUN_SECTIONS`).

    Parameters
    ----------
    cell : Cell
        The cell.

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    FileAccessError
        If a file that the cell names cannot be read.
    """
    contents = cell.file.model_dump(mode="json", exclude=set(RUN_SECTIONS))
    content = json.dumps(contents, sort_keys=True, allow_nan=False)
    digest = hashlib.sha256(content.encode("utf-8"))
    for name in named_files(cell):
        # Digests have one length, so that no byte can move from one file to the next unseen.
        digest.update(hashlib.sha256(_bytes_of(cell, name)).digest())
    return digest.hexdigest()


def named_files(cell: Cell) -> Iterator[str]:
    """Yield the files that a cell file or its URDF names, relative to the cell file.

    A file that is named by an absolute path comes with that path.
    """
    file = cell.file
    yield file.surface.file
    for shape in (*file.tool.shapes, *file.fixtures):
        if shape.mesh is not None:
            yield shape.mesh.file
    if file.robot.urdf is not None:
        yield file.robot.urdf
    folder = cell.path.absolute().parent
    for name, place in cell.robot.meshes:
        yield os.path.relpath(place, folder) if is_relative(name) else str(place)
    if file.process is not None:
        yield file.process.file


def _bytes_of(cell: Cell, name: str) -> bytes:
    path = cell.find(name)
    try:
        return path.read_bytes()
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror or error}") from error
