"""Reading and welding meshes, and what is refused."""

import numpy as np
import pytest

from elastocal.cell.examples import binary_stl, block_mesh
from elastocal.errors import FileAccessError
from elastocal.planning.surface import SurfaceError, load_surface, read_mesh
from elastocal.planning.surface.mesh import weld

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
    path.write_bytes(binary_stl(block_mesh()))
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
    path.write_bytes(binary_stl(block_mesh()))
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


def refusal(path) -> str:
    with pytest.raises(SurfaceError) as caught:
        read_mesh(path, 1.0)
    return str(caught.value)


def test_a_binary_stl_that_is_cut_short_is_told_from_a_text_that_is_none(tmp_path):
    path = tmp_path / "t.stl"
    whole = binary_stl(block_mesh())
    path.write_bytes(whole[:-1])
    assert f"is cut short, or no STL: its head promises 12 triangles, which take {len(whole)}" in (
        refusal(path)
    )
    path.write_text("# Not a mesh but a letter about one, of more bytes than a head.\n" * 4)
    assert "is no STL: it is a text that does not begin with 'solid'" in refusal(path)


def test_a_binary_stl_whose_head_says_solid_is_read(tmp_path):
    path = tmp_path / "t.stl"
    path.write_bytes(b"solid by some program".ljust(80) + binary_stl(block_mesh())[80:])
    assert len(read_mesh(path, 1e-3).faces) == 12


def test_a_text_stl_is_read_and_its_beginning_is_refused(tmp_path):
    path = tmp_path / "t.stl"
    face = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex {} 0 0\nvertex 0 1 0\nendloop\n"
    text = "solid s\n" + "".join(face.format(i) + "endfacet\n" for i in (1, 2)) + "endsolid s\n"
    path.write_text(text)
    assert len(read_mesh(path, 1.0).faces) == 2
    path.write_text(text[: text.rindex("vertex")])
    assert "is cut short: it begins 2 triangles and ends 1" in refusal(path)


def test_faces_that_stand_twice_either_way_round_are_dropped_and_counted():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = weld(vertices, np.array([[0, 1, 2], [0, 2, 3], [1, 2, 0], [3, 2, 0]]), "m")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[[[0, 1, 2], [0, 2, 3]]])
    assert mesh.duplicate == 2


def test_a_vertex_beyond_all_measure_is_refused():
    vertices = np.array([[0.0, 0, 0], [1e200, 0, 0], [0, 1, 0]])
    with pytest.raises(SurfaceError, match=r"m has a vertex 1e\+200 m from its origin"):
        weld(vertices, np.array([[0, 1, 2]]), "m")
