"""The printable figure."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from matplotlib.collections import PolyCollection

from elastocal.errors import FileAccessError, SchemaError
from elastocal.planning.surface.mesh import TriangleMesh
from elastocal.planning.surface.surface import build_surface
from elastocal.report import write_plan_figure
from elastocal.report.plots import plan_figure, themed_svg
from elastocal.report.plots.style import new_figure


def _texts(axes):
    return [text.get_text() for text in axes.texts]


@pytest.fixture(scope="module")
def on_block(block, plan, pool, moved_onto):
    return block, *moved_onto(block, plan, pool)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_same_plan_gives_the_same_bytes(tmp_path, on_block, suffix):
    paths = [write_plan_figure(tmp_path / f"{n}.{suffix}", *on_block) for n in "ab"]
    one, other = (path.read_bytes() for path in paths)
    assert len(one) > 5000
    assert one == other


@pytest.fixture(scope="module")
def fine(plan, pool, moved_onto):
    """A bowl of many small faces."""
    mesh = trimesh.creation.icosphere(6, 0.4)
    half = mesh.faces[np.array(mesh.triangles_center)[:, 2] > 0.2]
    surface = build_surface(TriangleMesh(mesh.vertices + np.array([1.5, 0, 0.5]), half))
    return surface, *moved_onto(surface, plan, pool)


@pytest.mark.slow
def test_a_fine_mesh_is_an_image_in_the_svg_and_a_small_one_is_lines(tmp_path, fine, on_block):
    small = write_plan_figure(tmp_path / "s.svg", *on_block).read_text(encoding="utf-8")
    large = write_plan_figure(tmp_path / "l.svg", *fine).read_text(encoding="utf-8")
    colour_bar = 1
    assert small.count("<image") == colour_bar
    assert large.count("<image") == 2 + colour_bar
    assert len(fine[0].mesh.faces) > 10_000
    assert len(large) < 3e6


def test_svg_holds_no_date(tmp_path, on_block):
    text = write_plan_figure(tmp_path / "f.svg", *on_block).read_text(encoding="utf-8")
    assert "<dc:date>" not in text


def test_two_techniques_stand_side_by_side(on_block, plan):
    plan_axes, other_axes, bar = plan_figure(*on_block).axes
    assert plan_axes.get_title() == "COVER (this plan)"
    assert other_axes.get_title() == "IOOPS (for comparison)"
    assert plan_axes.get_xlim() == other_axes.get_xlim()
    assert bar.get_title().endswith("in mm")


def test_without_a_comparison_there_is_one_panel(on_block):
    surface, plan, pool = on_block
    figure = plan_figure(surface, replace(plan, comparison=None), pool)
    assert len(figure.axes) == 2
    width, _ = figure.get_size_inches()
    assert width < 6.0


def test_poses_carry_their_ids_and_what_is_no_pose_of_the_plan_carries_none(on_block):
    plan = on_block[1]
    panels = plan_figure(*on_block).axes[:2]
    numbers = [[text for text in _texts(panel) if text.isdigit()] for panel in panels]
    assert numbers == [[str(pose) for pose in plan.search.order], []]
    # Each stands by its own candidate: the first label is the pose that was chosen first.
    assert sorted(map(int, numbers[0])) == [pose.id for pose in plan.poses]


def test_numbers_under_a_panel_carry_their_units(on_block):
    _, plan, _ = on_block
    texts = _texts(plan_figure(*on_block).axes[0])
    spread = plan.search.spread
    assert f"{1e3 * spread.covering_radius:.0f} mm" in texts
    assert "Covering radius (euclidean)" in texts
    assert texts[texts.index("Observability index O1 (no unit)") + 1] == f"{spread.o1:.3g}"


def test_a_surface_without_edge_has_no_distance_from_it(ball, plan, pool, moved_onto):
    moved, candidates = moved_onto(ball, plan, pool)
    spread = replace(moved.search.spread, boundary_distance=None)
    search = replace(moved.search, spread=spread)
    figure = plan_figure(ball, replace(moved, search=search), candidates)
    texts = _texts(figure.axes[0])
    assert texts[texts.index("Mean distance from the edge") + 1] == "none"


def test_a_dollar_in_a_name_is_no_formula(tmp_path, on_block):
    surface, plan, pool = on_block
    named = replace(plan, cell=replace(plan.cell, name="a$b_$c^"))
    assert write_plan_figure(tmp_path / "f.svg", surface, named, pool).stat().st_size > 5000


def test_another_suffix_is_refused(tmp_path, on_block):
    with pytest.raises(FileAccessError, match=r"suffix '.gif' is not one of .pdf, .png, .svg"):
        write_plan_figure(tmp_path / "f.gif", *on_block)


def test_a_pool_of_another_run_is_refused(tmp_path, on_block, plan):
    surface, _, candidates = on_block
    with pytest.raises(SchemaError, match="belongs to another plan"):
        write_plan_figure(tmp_path / "f.svg", surface, plan, candidates)
    assert not list(tmp_path.iterdir())


def test_the_surface_of_a_page_lets_its_ground_through_and_is_the_same_on_white():
    greys = np.linspace(0.86, 0.96, 500)
    corners = np.arange(500)[:, None, None] + [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    figure = new_figure(2.0, 2.0)
    faces = PolyCollection(list(corners), facecolors=np.repeat(greys[:, None], 3, axis=1))
    figure.add_panel(0.0, 0.0, 2.0, 2.0).add_collection(faces)
    themed_svg(lambda: figure)
    shown = np.array(faces.get_facecolor())
    assert np.all(shown[:, 3] < 0.5)
    on_white = shown[:, :3] * shown[:, 3:] + 1.0 - shown[:, 3:]
    np.testing.assert_allclose(on_white, np.repeat(greys[:, None], 3, axis=1), atol=1e-12)
