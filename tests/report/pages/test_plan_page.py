"""The interactive page of a plan."""

import base64
import json
import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from elastocal.errors import FileAccessError, PlanningError, SchemaError
from elastocal.report import write_plan_page
from elastocal.units import with_fixed_units
from elastocal.viewer import scene
from support import plans
from support.pages import Page


@pytest.fixture(scope="module")
def written(tmp_path_factory, cell, block, plan, pool):
    return write_plan_page(tmp_path_factory.mktemp("page") / "p.html", cell, block, plan, pool)


@pytest.fixture(scope="module")
def page(written):
    return Page(written.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def shown(page):
    return json.loads(page.data)


def test_page_loads_nothing(page, written):
    for tag, attributes in page.tags:
        assert tag not in {"link", "img", "iframe", "object", "embed", "base"}
        assert not {"src", "srcset", "background", "action"} & attributes.keys()
    style = re.search(r"<style>(.*?)</style>", written.read_text(encoding="utf-8"), re.S)[1]
    assert "url(" not in style
    assert "@import" not in style


def test_a_fine_mesh_is_drawn_coarser_and_the_page_says_so(
    tmp_path, cell, plan, pool, moved_onto, monkeypatch, ball
):
    monkeypatch.setattr(scene, "MOST_OF_TOOLING", 100)
    monkeypatch.setattr(scene, "MOST_OF_LINK", 40)
    path = write_plan_page(tmp_path / "p.html", cell, ball, *moved_onto(ball, plan, pool))
    text = path.read_text(encoding="utf-8")
    said = re.search(r"The tooling is drawn with (\d+) faces in place of 320\.", text)
    assert int(said[1]) <= 100
    assert "Parts of the robot with fine meshes are drawn coarser." in text
    (tooling,) = [
        each for each in json.loads(Page(text).data)["layers"] if each["label"] == "Tooling"
    ]
    assert len(base64.b64decode(tooling["parts"][0]["faces"])) <= 12 * 100


def test_a_mesh_that_is_drawn_whole_needs_no_words(written):
    assert "in place of" not in written.read_text(encoding="utf-8")


def test_the_viewer_is_the_file_that_the_studio_serves(written):
    viewer = resources.files("elastocal.viewer").joinpath("viewer.js").read_text("utf-8")
    assert viewer in written.read_text(encoding="utf-8")


def test_page_is_small(written):
    assert written.stat().st_size < 1e6


def test_page_forbids_itself_the_network(page):
    policy = page.one(**{"http-equiv": "Content-Security-Policy"})["content"]
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy
    assert "connect-src" not in policy


def test_slider_has_a_step_for_home_and_every_pose(page, shown, plan):
    slider = page.one(id="posture")
    assert (slider["type"], slider["min"], slider["max"]) == ("range", "0", str(len(plan.poses)))
    assert len(shown["postures"]) == len(plan.poses) + 1
    assert shown["postures"][0] == "HOME"
    assert shown["postures"][1].startswith("Pose 0:")


def test_every_pose_is_numbered_in_the_view_and_has_a_row(page, shown, plan):
    (poses,) = [each for each in shown["layers"] if each["label"].startswith("Poses")]
    assert poses["parts"][0]["texts"] == [str(pose.id) for pose in plan.poses]
    assert page.count("tr") == 1 + len(plan.poses)


def test_refused_points_are_off(shown, pool):
    off = [layer["label"] for layer in shown["layers"] if not layer["shown"]]
    refused = [layer["label"] for layer in shown["layers"] if layer["label"].startswith("Refused")]
    assert off == refused
    assert f"Refused by reach ({np.count_nonzero(pool.refused_by == 0)})" in off


def test_head_tells_the_key_figures_with_units(written, plan):
    text = written.read_text(encoding="utf-8")
    head = text[: text.index("</header>")]
    radius = f"{1e3 * plan.search.covering_radius:.0f} mm"
    for wanted in (f"<dd>{len(plan.poses)}</dd>", radius, "<dd>7 min 04 s</dd>", "wrist"):
        assert with_fixed_units(wanted) in head
    assert plan.findings[0] in text


def test_names_are_escaped(tmp_path, cell, block, plan, pool):
    bad = "<b>x</b></script><script>alert(1)</script>"
    named = replace(
        plan,
        cell=replace(plan.cell, name=bad),
        findings=(bad,),
        poses=tuple(replace(pose, seen_by=bad) for pose in plan.poses),
    )
    text = write_plan_page(tmp_path / "p.html", cell, block, named, pool).read_text("utf-8")
    assert "<b>x" not in text
    assert "alert(1)</script>" not in text
    assert "&lt;b&gt;x&lt;/b&gt;" in text
    assert Page(text).count("script") == 2


def test_same_plan_gives_the_same_bytes(tmp_path, written, cell, block, plan, pool):
    again = write_plan_page(tmp_path / "p.html", cell, block, plan, pool)
    assert again.read_bytes() == written.read_bytes()


def test_a_pool_of_another_run_is_refused(tmp_path, cell, block, plan, moved_onto, pool):
    _, other = moved_onto(block, plan, pool)
    with pytest.raises(
        SchemaError, match=r"belongs to another plan: its candidate \d+ is not pose 0"
    ):
        write_plan_page(tmp_path / "p.html", cell, block, plan, other)
    assert not list(tmp_path.iterdir())


def test_a_cell_with_another_robot_is_refused(tmp_path, cell, block):
    with pytest.raises(PlanningError, match="the plan is for joints rail, joint_a1"):
        write_plan_page(tmp_path / "p.html", cell, block, plans.plan(), plans.pool())


def test_a_missing_folder_is_named(tmp_path, cell, block, plan, pool):
    with pytest.raises(FileAccessError, match="nowhere"):
        write_plan_page(tmp_path / "nowhere" / "p.html", cell, block, plan, pool)
