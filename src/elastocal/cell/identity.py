"""The identity of a cell: its fingerprint, which ties plans to it, and the files that it names."""

import hashlib
import json
import os
from collections.abc import Iterator
from typing import Any

from elastocal.cell.cell import SECTIONS_OF_OTHERS, Cell
from elastocal.files import read_bytes
from elastocal.robot import is_relative

RUN_SECTIONS = ("acceptance", "certificate", "procedure", "devices", *SECTIONS_OF_OTHERS)
"""Sections of the cell file that say how a plan is carried out and its result is judged; a plan
does not depend on them."""


_WRITTEN_AS_NULL = frozenset(
    {
        *("sensor", "marker", "process", "limits.payload", "limits.torque.provenance"),
        *("motion.provenance", "robot.model", "robot.rail", "robot.urdf", "search.poses"),
        *("search.d_max", "surface.region", "surface.region.box", "surface.region.polygon"),
        *("surface.region.polygon.height", "fixtures.box", "fixtures.cylinder", "fixtures.mesh"),
        *("fixtures.sphere", "tool.shapes.box", "tool.shapes.cylinder", "tool.shapes.mesh"),
        "tool.shapes.sphere",
    }
)
"""Optional keys that count in a fingerprint as null when they are not given: those there were when
keys that are not given began to be left out. Never add one: plans made before would be refused."""


def fingerprint(cell: Cell) -> str:
    """Return a SHA-256 over what a cell file says and the files that it names.

    It changes with every value of the cell file, defaults included, and with every byte of the
    surface, the mesh shapes, the robot's URDF with the meshes of its collision shapes, and the
    process file. It does not change with comments, the order of keys, the way a number is written,
    the place of the folder, optional keys that are not given, or the sections that say how a plan
    is carried out (`RUN_SECTIONS`).

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    FileAccessError
        If a file that the cell names cannot be read.
    """
    contents = _given(cell.file.model_dump(mode="json", exclude=set(RUN_SECTIONS)))
    content = json.dumps(contents, sort_keys=True, allow_nan=False)
    digest = hashlib.sha256(content.encode("utf-8"))
    for name in named_files(cell):
        # Digests have one length, so that no byte can move from one file to the next unseen.
        digest.update(hashlib.sha256(_bytes_of(cell, name)).digest())
    return digest.hexdigest()


def _given(value: Any, path: str = "") -> Any:
    """Return contents of a cell file without the optional keys that are not given."""
    if isinstance(value, list):
        return [_given(each, path) for each in value]
    if not isinstance(value, dict):
        return value
    places = {key: f"{path}.{key}".removeprefix(".") for key in value}
    return {
        key: _given(each, places[key])
        for key, each in value.items()
        if each is not None or places[key] in _WRITTEN_AS_NULL
    }


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
    return read_bytes(cell.find(name))
