"""Reading and welding meshes, and what is refused."""

import numpy as np
import pytest

from elastocal.cell.examples.meshes import binary_stl, block
from elastocal.errors import FileAccessError
from elastocal.planning.surface import SurfaceError, load_surface, read_mesh, weld

PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1000 0 0
0 1000 0
3 0 1 2
"""


def test_an_stl_in_mm_is_welded_and_becomes_metres(tmp_path):
    path = tmp_path / "block.stl"
    path.write_bytes(binary_stl(block()))
    mesh = read_mesh(path, 1e-3)
    assert mesh.vertices.shape == (8, 3)
    assert mesh.faces.shape == (12, 3)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), (0.6, 0.4, 0.3), rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "text"), [("t.ply", PLY), ("t.obj", "v 0 0 0\nv 1000 0 0\nv 0 1000 0\nf 1 2 3\n")]
)
def test_ply_and_obj_are_read(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    surface = load_surface(tmp_path / name, 1e-3, np.eye(4))
    assert surface.area == pytest.approx(0.5)


def test_the_pose_puts_the_surface_into_base(tmp_path):
    path = tmp_path / "block.stl"
    path.write_bytes(binary_stl(block()))
    T = np.array([[0.0, -1, 0, 2], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]])
    surface = load_surface(path, 1e-3, T)
    np.testing.assert_allclose(surface.mesh.vertices.min(axis=0), (1.8, -0.3, 1.0), atol=1e-6)
    assert surface.signed_volume == pytest.approx(0.072, rel=1e-6)


@pytest.mark.parametrize("content", [b"", b"solid nothing\nendsolid\n", b"\x00" * 90, b"hello"])
@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj"])
def test_an_unreadable_mesh_is_refused_in_one_line_with_its_name(tmp_path, content, suffix):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(SurfaceError, match=r"bad\.") as caught:
        read_mesh(path, 1.0)
    assert "\n" not in str(caught.value)


def test_another_suffix_and_a_missing_file_are_refused(tmp_path):
    with pytest.raises(SurfaceError, match=r"'.step' is not one of .stl, .obj, .ply"):
        read_mesh(tmp_path / "part.step", 1.0)
    with pytest.raises(FileAccessError, match="cannot read"):
        read_mesh(tmp_path / "absent.stl", 1.0)


def test_faces_without_area_are_left_out_and_counted():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    mesh = weld(vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 1, 2]]), "m")
    assert len(mesh.faces) == 1
    assert mesh.degenerate == 2
    with pytest.raises(SurfaceError, match="no face with an area"):
        weld(vertices, np.array([[0, 1, 3]]), "m")


def test_vertices_that_are_not_finite_or_not_there_are_refused():
    face = np.array([[0, 1, 2]])
    with pytest.raises(SurfaceError, match="not finite"):
        weld(np.array([[0.0, 0, 0], [1, 0, np.nan], [0, 1, 0]]), face, "m")
    with pytest.raises(SurfaceError, match="names vertex 2; there are 2"):
        weld(np.zeros((2, 3)), face, "m")
