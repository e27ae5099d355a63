"""The interactive page of a plan of two robots."""

import base64
import json

import numpy as np
import pytest

from elastocal.records import read_json
from elastocal.report import language_of, write_pair_plan_page
from elastocal.two_robots import PairPlan, load_pair_cell
from support import two_arms
from support.pages import Page


@pytest.fixture(scope="module")
def folder():
    return two_arms.finished()


@pytest.fixture(scope="module")
def plan(folder):
    return read_json(folder / "plan.json", PairPlan)


@pytest.fixture(scope="module")
def page(folder):
    """What ``plan-pair`` wrote beside the plan."""
    return Page((folder / "plan.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def shown(page):
    return json.loads(page.data)


def numbers(text, kind="<f4"):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_the_tools_of_both_arms_end_where_they_meet(shown, plan):
    arms = [each for each in shown["layers"] if each["label"] in plan.arms]
    bodies = sum(len(each["parts"]) for each in arms)
    places = numbers(shown["places"]).reshape(len(plan.meetings) + 1, bodies, 4, 4)
    places = places.swapaxes(-1, -2)
    points = np.array([each.point for each in plan.meetings])
    for arm in arms:
        rod = arm["parts"][-1]
        assert rod["colour"] == "--tool"
        vertices = numbers(rod["vertices"]).reshape(-1, 3)
        T = places[1:, rod["part"]]
        own = np.einsum("pij,vj->pvi", T[:, :3, :3], vertices) + T[:, None, :3, 3]
        tip = np.linalg.norm(own - points[:, None], axis=2).min(axis=1)
        assert tip.max() < 1e-5


def test_every_meeting_has_a_step_of_the_slider_a_tag_and_a_row(page, shown, plan):
    count = len(plan.meetings)
    slider = page.one(id="posture")
    assert (slider["min"], slider["max"]) == ("1", str(count))
    assert len(shown["postures"]) == count + 1
    (tags,) = [each["parts"][0] for each in shown["layers"] if each["label"].startswith("Begegn")]
    assert tags["texts"] == [str(each.id) for each in plan.meetings]
    assert page.one(id="pose-table")
    buttons = [a for tag, a in page.tags if tag == "button" and "aria-label" in a]
    assert sum("Zeige Pose" in each["aria-label"] for each in buttons) == count


def test_the_page_is_of_the_language(folder, plan, tmp_path):
    cell = load_pair_cell(folder / "cell.yaml")
    path = write_pair_plan_page(tmp_path / "p.html", cell, plan, language_of("fr"))
    text = path.read_text(encoding="utf-8")
    assert "<title>Plan de deux robots" in text
    assert 'content="elastocal plan-pair"' in text
    assert path.stat().st_size < 1e6
