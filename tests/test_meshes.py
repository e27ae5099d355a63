"""Mesh files as people have them, read without a package that guesses encodings."""

import builtins

import numpy as np
import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.meshes import load_triangles

STL = """solid Prüfling
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid Prüfling
"""
OBJ = "# Gehäuse\nmtllib Grün.mtl\ng Fläche\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = """ply
format ascii 1.0
comment Prüfling, scanned in März
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""
TEXTS = {"stl": STL, "obj": OBJ, "ply": PLY}
TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read bytes as a file of a kind, with nothing installed that guesses encodings."""
    imported = builtins.__import__

    def refusing(name, *rest, **more):
        if name.split(".")[0] in ("charset_normalizer", "chardet", "cchardet"):
            raise ModuleNotFoundError(f"No module named {name!r}")
        return imported(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", refusing)

    def triangles(kind, data):
        path = tmp_path / f"part.{kind}"
        path.write_bytes(data)
        return np.asarray(load_triangles(path).triangles)

    return triangles


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig", "cp437"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_text_in_any_encoding_and_with_any_line_ends_is_read(read, kind, encoding, end):
    data = TEXTS[kind].replace("\n", end).encode(encoding)
    np.testing.assert_array_equal(read(kind, data), [TRIANGLE])


@pytest.mark.parametrize("tail", [b"\x1a", b"\x00", b"\xff", b"\xe9\n", b"\n\n"])
def test_what_stands_behind_an_ascii_stl_is_ignored(read, tail):
    np.testing.assert_array_equal(read("stl", STL.encode("latin-1") + tail), [TRIANGLE])


def test_an_stl_without_normals_is_read(read):
    data = STL.replace(" normal 0 0 1", "").encode("latin-1")
    np.testing.assert_array_equal(read("stl", data), [TRIANGLE])


@pytest.mark.parametrize("tail", [b"", b"\x00", b"signed by CAD \xe9"])
def test_a_binary_stl_has_any_head_and_any_tail(read, tail):
    corners = np.array([[0.0, 0.0, 1.0], *TRIANGLE], dtype="<f4").tobytes() + b"\x00\x00"
    data = "solid Prüfling ".encode("latin-1").ljust(80) + (1).to_bytes(4, "little") + corners
    np.testing.assert_array_equal(read("stl", data + tail), [TRIANGLE])


def test_a_binary_ply_keeps_its_bytes(read):
    head = PLY.partition("end_header")[0].replace("ascii", "binary_little_endian")
    head = head.replace("Prüfling", "made of ascii, Prüfling") + "end_header\n"
    # 2**-7 + 2**-14 has bytes beyond ASCII and a carriage return in its place.
    corners = np.array([[0.0, 0.0, 0.0], [1.0, -13.0, 0.0], [0.0, 1.0, -0.0137]], dtype="<f4")
    faces = b"\x03" + np.arange(3, dtype="<i4").tobytes()
    data = head.encode("latin-1") + corners.tobytes() + faces
    np.testing.assert_array_equal(read("ply", data), [corners])


def test_a_mesh_that_is_none_is_refused_by_name(read, tmp_path):
    with pytest.raises(SchemaError, match=r"part\.obj is not a readable obj"):
        read("obj", b"v a b c\nf 1 2 3\n")
    with pytest.raises(FileAccessError, match=r"cannot read .*none\.stl"):
        load_triangles(tmp_path / "none.stl")
