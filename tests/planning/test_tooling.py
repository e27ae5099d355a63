"""The surface that a cell file names."""

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import PlanningError
from elastocal.planning import cell_surface, surface_findings


def example(folder, *changes, like="afp"):
    path, *_ = write_example(folder, like, force=True)
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return load_cell(path)


def kinds(cell):
    found = surface_findings(cell, cell_surface(cell), np.random.default_rng(0))
    return [finding.kind.partition(".")[2] for finding in found]


def test_the_dome_is_open_and_the_block_is_closed(tmp_path):
    assert kinds(example(tmp_path)) == ["open"]
    assert kinds(example(tmp_path, like="machining")) == []


def test_the_surface_stands_where_the_file_says(tmp_path):
    moved = example(tmp_path, ('xyz: ["1.85 m", "0 m", "1.0 m"]', 'xyz: ["2.85 m", "0 m", "1 m"]'))
    shift = cell_surface(moved).mesh.vertices - cell_surface(example(tmp_path)).mesh.vertices
    np.testing.assert_allclose(shift, np.broadcast_to([1.0, 0.0, 0.0], shift.shape), atol=1e-12)


def test_flip_normals_turns_them(tmp_path):
    usual = cell_surface(example(tmp_path))
    turned = cell_surface(example(tmp_path, ("# flip_normals: true ", "flip_normals: true # ")))
    np.testing.assert_allclose(turned.face_normals, -usual.face_normals, atol=1e-12)
    assert "inverted" in kinds(example(tmp_path, ("# flip_normals: true ", "flip_normals: true #")))


def test_a_surface_that_is_out_of_the_world_is_refused(tmp_path):
    cell = example(tmp_path, ("unit: mm", "unit: m"))
    with pytest.raises(PlanningError, match="is the mesh in mm and read as m"):
        kinds(cell)
