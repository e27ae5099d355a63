"""What is odd about a surface is said."""

import numpy as np
import pytest
import trimesh

from elastocal.cell import load_cell
from elastocal.cell.examples import EXAMPLES, block_mesh, dome_section, write_example
from elastocal.findings import Grade
from elastocal.planning.surface import (
    ReachableFrom,
    arm_reach,
    contact_frames,
    first_joint_positions,
    flipped,
    load_surface,
    mesh_findings,
    placement_findings,
    sample_uniform,
    size_findings,
    unit_findings,
)
from elastocal.planning.surface.findings import inverted_finding
from elastocal.planning.surface.surface import build_surface
from elastocal.robot.inverse import inverse_for
from support.tooling import plane, soup

RNG = 11


@pytest.fixture(scope="module", params=sorted(EXAMPLES))
def cell(request, tmp_path_factory):
    return load_cell(write_example(tmp_path_factory.mktemp("cell"), request.param)[0])


def placed(cell, unit=None):
    source = cell.file.surface
    return load_surface(cell.surface_path, unit or source.metres, cell.T_base_surface)


def kinds(cell, surface):
    reachable = ReachableFrom(inverse_for(cell.robot), cell.external_positions)
    stands = first_joint_positions(cell.robot, cell.external_positions)
    rng = np.random.default_rng(RNG)
    found = placement_findings(surface, stands, arm_reach(cell.robot), reachable, rng)
    assert all("\n" not in finding for finding in found)
    return {finding.kind.partition(".")[2]: finding for finding in found}


def test_the_examples_are_well_placed(cell):
    assert kinds(cell, placed(cell)) == {}


def test_inverted_normals_are_found_and_turning_them_is_offered(cell):
    found = kinds(cell, flipped(placed(cell)))
    ((kind, text),) = found.items()
    assert kind in ("inverted", "inside-out")
    assert "flip_normals: true" in text


def test_a_mesh_in_mm_that_is_read_as_m_is_found_by_the_reach(cell):
    found = kinds(cell, build_surface(placed(cell, unit=1.0).mesh, np.eye(4)))
    if cell.name == "machining":
        assert found == {} or "far" in found
    far = build_surface(placed(cell, unit=1.0).mesh, np.diag([1.0, 1, 1, 1]) + _shift(900.0))
    found = kinds(cell, far)
    assert found["far"].grade is Grade.REFUSAL
    assert "mm" in found["far"]


def test_a_surface_that_is_out_of_reach_is_named(cell):
    gone = 4.0 * arm_reach(cell.robot)
    far = build_surface(placed(cell).mesh, np.eye(4) + _shift(gone))
    assert "no part of it is within reach" in kinds(cell, far)["out-of-reach"]


def test_a_mesh_in_m_that_is_read_as_mm_is_tiny(cell):
    assert "tiny" in kinds(cell, placed(cell, unit=1e-6))


def test_a_mesh_in_inches_that_is_read_as_mm_is_named(cell):
    size = np.linalg.norm(np.ptp(placed(cell).mesh.vertices, axis=0))
    small = 0.015 * arm_reach(cell.robot) / size
    found = kinds(cell, placed(cell, unit=small * cell.file.surface.metres))
    assert "is the mesh in inches and read as mm (surface.unit)?" in found["tiny"]


@pytest.mark.parametrize(
    ("head", "unit", "found"),
    [
        ("solid part UNITS=inches", "mm", True),
        ("solid part units: in", "mm", True),
        ("solid Einzelteil, 1 inch", "m", True),
        ("solid part units: in", "in", False),
        ("solid finch in mm", "mm", False),
    ],
)
def test_a_mesh_that_speaks_of_inches_is_named(tmp_path, head, unit, found):
    path = tmp_path / "part.stl"
    path.write_text(f"{head}\n")
    words = list(unit_findings(path, unit, "fixtures.0.mesh"))
    advice = "write fixtures.0.mesh.unit: in, if it is so"
    assert words == (
        [f"part.stl speaks of inches and is read in {unit}: {advice}"] if found else []
    )


@pytest.mark.parametrize(
    ("key", "size", "unit", "mistake"),
    [
        ("tool.shapes.0.mesh", 1500.0, 1.0, "mm and read as m"),
        ("tool.shapes.0.mesh", 1500.0, 1e-3, None),
        ("fixtures.0.mesh", 2000.0 / 25.4, 1.0, "inches and read as m"),
        ("fixtures.0.mesh", 30.0, 1.0, None),
        ("fixtures.0.mesh", 1.5, 1e-3, "m and read as mm"),
    ],
)
def test_a_solid_of_no_likely_size_is_suspected_of_its_unit(tmp_path, key, size, unit, mistake):
    path = tmp_path / "part.stl"
    trimesh.creation.box((size, 0.1, 0.1)).export(path)
    words = list(size_findings(path, unit, key, reach=2.5))
    assert len(words) == (mistake is not None)
    assert all(f"is the mesh in {mistake} ({key}.unit)?" in word for word in words)


def test_the_reach_is_a_bound_that_a_stretched_arm_nearly_attains(cell):
    reach = arm_reach(cell.robot)
    rng = np.random.default_rng(0)
    limits = cell.robot.limits
    q = rng.uniform(limits.lower, limits.upper, (500, len(limits.lower)))
    q[:, : cell.robot.external_axes] = 0.0
    stand = first_joint_positions(cell.robot, np.zeros((1, cell.robot.external_axes)))[0]
    distance = np.linalg.norm(cell.robot.forward(q)[:, :3, 3] - stand, axis=1)
    assert 0.6 * reach < distance.max() <= reach


def test_an_open_mesh_is_said_and_a_closed_one_is_not():
    assert [f.kind for f in mesh_findings(plane())] == ["surface.open"]
    assert "4 edges" in mesh_findings(plane())[0]
    assert mesh_findings(soup(block_mesh())) == ()


def test_a_third_face_at_an_edge_a_turned_and_a_flat_face_are_said():
    triangles = block_mesh()
    fin = np.array(
        [triangles[0][0], triangles[0][1], triangles[0][:2].mean(axis=0) + np.array([-1, 0, 0.3])]
    )
    flat = np.repeat(triangles[0][:1], 3, axis=0)
    turned = triangles.copy()
    turned[3] = turned[3][::-1]
    surface = soup(np.concatenate([turned, [fin, flat]]))
    assert {f.kind for f in mesh_findings(surface)} >= {
        "surface.non-manifold",
        "surface.degenerate",
        "surface.winding",
    }


def test_a_block_inside_out_is_found_without_asking_the_robot():
    def nowhere(poses):
        raise AssertionError("not asked")

    rng = np.random.default_rng(RNG)
    assert inverted_finding(soup(block_mesh()), nowhere, rng) == ()
    (found,) = inverted_finding(soup(block_mesh()[:, ::-1]), nowhere, rng)
    assert "inside out" in found


def test_a_surface_that_is_reached_nowhere_is_not_called_inverted():
    rng = np.random.default_rng(RNG)
    never = lambda poses: np.zeros(len(poses), dtype=bool)  # noqa: E731
    assert inverted_finding(soup(dome_section()), never, rng) == ()


def test_contact_poses_press_into_the_surface_and_turn_about_their_z():
    points = sample_uniform(soup(block_mesh()), 40, np.random.default_rng(0))
    spin = np.linspace(0, np.pi, 5)
    T = contact_frames(points.position, points.normal, spin)
    R = T[..., :3, :3]
    np.testing.assert_allclose(
        R @ R.swapaxes(-1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
    np.testing.assert_allclose(T[..., :3, 2], -np.repeat(points.normal[:, None], 5, axis=1))
    np.testing.assert_allclose(
        np.einsum("pi,psi->ps", R[:, 0, :, 0], R[..., 0]), np.cos([spin] * 40)
    )
    level = np.abs(points.normal[:, 0]) < 0.5
    np.testing.assert_allclose(T[level, 0, 0, 0], 1.0)


def _shift(metres):
    T = np.zeros((4, 4))
    T[0, 3] = metres
    return T


def test_faces_that_stand_twice_are_said_and_do_not_make_the_mesh_non_manifold():
    triangles = block_mesh()
    surface = soup(np.concatenate([triangles, triangles[:5]]))
    (found,) = mesh_findings(surface)
    assert (found.kind, surface.closed) == ("surface.duplicate", True)
    assert "5 faces stood twice" in found


def test_a_strip_with_one_side_is_not_offered_to_be_turned():
    angle = np.linspace(0, 2 * np.pi, 25)
    across = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle)])
    half = 0.2 * np.stack([*across, np.sin(angle / 2)], axis=1)
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    low, high = middle - half, middle + half
    strip = [
        triangle
        for i in range(24)
        for triangle in ((low[i], low[i + 1], high[i]), (high[i], low[i + 1], high[i + 1]))
    ]
    surface = soup(np.array(strip))
    assert not surface.orientable
    only_from_behind = lambda poses: np.arange(len(poses)) >= 0  # noqa: E731
    calls = iter([lambda poses: np.zeros(len(poses), dtype=bool), only_from_behind])
    found = inverted_finding(surface, lambda poses: next(calls)(poses), np.random.default_rng(0))
    assert found == ()
