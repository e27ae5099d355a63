"""The shop-floor story without a tracker: plan, run, derive, calibrate, report, on a small cell."""

import json
import re
import shutil
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import elastocal as ec
from elastocal import workflows
from elastocal.cell import load_cell, without_tracker, write_example
from elastocal.codec import read_codec
from elastocal.dataset import read
from elastocal.errors import ElastocalError
from elastocal.planning import read_plan
from elastocal.planning.untracked import TURN, doubled_findings, require_doubled
from elastocal.sim.workcell._contact import ContactLaw, PlaceSpread
from elastocal.verdict.findings import _missing_poses
from elastocal.workflows._operator_and_devices import Supervision, Unattended
from support import drivers
from support.cli import elastocal
from support.kept import kept

_NORMAL = 4e6
_TRUTH = """simulation:
  preset: kind
  seed: 3
  contact: {normal_stiffness: "4 N/um", shear_stiffness: "1.5 N/um", spread: 0.05,
            tooling_stiffness: "10000 N/um", micro_slip: "1 um"}
"""


def written_cell(folder: Path) -> Path:
    """Write a cell without marker, tracker and process, with a disk of which two can be stacked."""
    path = write_example(folder, "machining")[0]
    text = path.read_text()
    for section in ("marker", "trackers", "process", "simulation"):
        text = re.sub(rf"^{section}:.*\n(?:[ #].*\n)*", "", text, flags=re.M)
    text = text.replace("engagement:\n", 'engagement:\n  disk_thickness: "5 mm"\n')
    text = text.replace("  pool: 3000", "  pool: 120")
    path.write_text(text + "\n" + _TRUTH)
    return path


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """Return a folder with a cell, its plan, a run that was derived, and its model."""
    folder = tmp_path_factory.mktemp("untracked") / "story"
    return shutil.copytree(kept("untracked", _make), folder)


def _make(folder: Path) -> None:
    cell, contact, run = written_cell(folder / "cell"), folder / "contact.yaml", folder / "run"
    ec.plan(cell, out=folder / "plan", poses=6, doubled=4, without="tracker", compare="none")
    ec.run(cell, plan=folder / "plan", out=run)
    contact.write_text('contact: {spread: "5 %"}\n')
    ec.calibrate(run, contact=contact, out=run / "model.json", springs="actuated", draws=40)


@pytest.mark.slow
def test_the_cell_of_the_story_has_no_station(story):
    file = load_cell(story / "cell" / "cell.yaml").file
    assert file.marker is None
    assert not file.trackers


@pytest.mark.slow
def test_plan_json_says_which_places_are_pressed_on_two_disks(story):
    data = json.loads((story / "plan" / "plan.json").read_text())
    assert data["without"] == ["tracker"]
    doubles = [pose.get("doubles") for pose in data["poses"]]
    assert doubles[:6] == [None] * 6
    assert len(set(doubles[6:])) == 4
    assert all(pose["seen_by"] is None for pose in data["poses"])


def test_on_two_disks_the_tool_stands_a_thickness_farther_off(story):
    plan = read_plan(story / "plan")
    for pose in plan.poses[6:]:
        single = plan.poses[pose.doubles]
        off = np.subtract(pose.tcp_position, single.tcp_position) @ single.normal
        assert off == pytest.approx(5e-3, abs=1e-6)
        turned = pose.T_base_tcp[:3, :3].T @ single.T_base_tcp[:3, :3]
        np.testing.assert_allclose(turned, np.eye(3), atol=1e-6)


def test_the_second_disk_is_put_on_at_home(story):
    plan = read_plan(story / "plan")
    assert plan.robot.home in plan.moves[6].via


def test_the_dataset_has_contacts_and_no_marker(story):
    data = read(story / "run" / "dataset.nc")
    assert data.marker_displacement is None
    assert len(data.poses) == 6
    doubled = [case.endswith("_doubled") for case in data.load_cases]
    ok = data.status == 0
    assert set(data.contacts[:, doubled][ok[:, doubled]].tolist()) == {2}
    assert set(data.contacts[:, ~np.array(doubled)].ravel().tolist()) == {1}
    assert ok[:, doubled].any(axis=1).sum() == 4


def test_the_springs_and_the_disk_are_found(story):
    found = json.loads((story / "run" / "model.json").read_text())["calibration"]["contact"]
    assert (found["poses"], found["tracked"], found["doubled"]) == (6, 0, 4)
    normal = found["figures"][0]
    assert 1.0 / normal["doubled"] == pytest.approx(_NORMAL, rel=0.1)


def test_the_report_says_that_no_tracker_measured(story):
    ec.report(story / "run", out=story / "report.html")
    assert "No tracker measured" in (story / "report.html").read_text()


def test_a_place_on_two_disks_is_missing_only_where_it_was_not_pressed(story):
    assert "no usable reading" not in (story / "report.html").read_text()
    plan, data = read_plan(story / "plan"), read(story / "run" / "dataset.nc")
    place = plan.poses[7].doubles
    status = data.status.copy()
    status[data.poses.index(place), data.contacts[place] == 2] = 4
    spoilt = SimpleNamespace(plan=plan, dataset=replace(data, status=status), journal=None)
    (finding,) = _missing_poses(spoilt)
    assert "1 of 10 planned poses has no usable reading (pose 7)" in str(finding)


def test_codec_refuses_readings_that_no_tracker_took_in_one_line(story):
    ran = elastocal(
        "codec", story / "run" / "dataset.nc", "--compare", "springs=actuated,bearing",
        "--out", story / "codec",
    )  # fmt: skip
    assert ran.code == 1
    assert "no marker_displacement" in ran.err
    assert "--contact CONTACT.yaml" in ran.err
    assert "Traceback" not in ran.err


@pytest.mark.slow
def test_the_codec_of_a_campaign_without_a_tracker(story):
    out = story / "codec-contact"
    ran = elastocal(
        "codec", story / "run", "--contact", story / "contact.yaml", "--splits", 3, "--jobs", 1,
        "--compare", "springs=actuated", "--out", out, "--json",
    )  # fmt: skip
    assert ran.code == 0, ran.err
    (curve,) = json.loads(ran.out)["variants"].values()
    # What no model would leave is what the controller travels: a part of a millimetre.
    assert curve["error_mean"][-1] < 0.1 * float(np.median(read_codec(out).zero_error))
    assert "no tracker measured at 6 poses" in " ".join(json.loads(ran.out)["findings"])


def test_the_codec_does_not_ignore_that_the_tip_may_lie_elsewhere(story, tmp_path):
    contact = tmp_path / "contact.yaml"
    contact.write_text('contact: {tip: "5 mm"}\n')
    ran = elastocal(
        "codec", story / "run", "--contact", contact, "--compare", "springs=actuated",
        "--out", tmp_path / "codec",
    )  # fmt: skip
    assert "leave contact.tip out" in ran.reason
    assert not (tmp_path / "codec").exists()


class Person(Unattended):
    """Puts the second disk on when asked, or wants to stop then."""

    answers = True

    def __init__(self, stops=False):
        self.asked, self._stops = [], stops

    @contextmanager
    def supervise(self, poses):  # noqa: ARG002 - the protocol's form
        def ask(what):
            self.asked.append(what)
            return lambda: not self._stops

        yield Supervision(lambda _: None, lambda: self._stops and bool(self.asked), ask)


def test_a_person_puts_the_second_disk_on_where_the_arm_is_real(story, tmp_path, monkeypatch):
    drivers.install(tmp_path / "site", monkeypatch, "fake", drivers.REAL)
    cell = story / "cell" / "real.yaml"
    cell.write_text(
        f"{(story / 'cell' / 'cell.yaml').read_text()}\ndevices: {{arm: fake, sensor: fake}}\n"
    )
    ec.plan(cell, out=tmp_path / "plan", poses=1, doubled=1, without="tracker", compare="none")
    how = {"plan": tmp_path / "plan", "out": tmp_path / "run", "confirmed": True}
    with pytest.raises(ElastocalError, match="nobody can be asked to put the second one on"):
        ec.run(cell, **how)
    assert not (tmp_path / "run").exists()
    stopped = ec.run(cell, **how, operator=(first := Person(stops=True))).figures
    assert (stopped.state, stopped.arm, stopped.committed) == ("interrupted", "at HOME", 1)
    done = ec.run(cell, **how, resume=True, operator=(second := Person())).figures
    assert (done.state, done.committed) == ("done", 2)
    wanted = "the arm is at HOME and disarmed: put the second disk on the first, and leave the cell"
    assert first.asked == second.asked == [wanted]
    assert read(tmp_path / "run" / "dataset.nc").contacts.max() == 2


def test_a_rehearsal_says_what_is_to_be_done_by_hand(story, tmp_path):
    cell, plan = story / "cell" / "cell.yaml", story / "plan"
    assert dict(workflows.dry_run(cell, plan=plan, out=tmp_path / "run").facts())["by hand"] == (
        "put the second disk on for pose 6 to 9"
    )


def test_a_run_with_a_plan_for_a_tracker_is_refused_where_there_is_none(story, tmp_path):
    cell = story / "cell" / "cell.yaml"
    ec.plan(cell, out=tmp_path / "plan", poses=3, compare="none")
    with pytest.raises(ElastocalError, match="--without tracker"):
        ec.run(cell, plan=tmp_path / "plan", out=tmp_path / "run")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"without": "camera"}, r"--without 'camera' .*\(allowed: tracker\)"),
        ({"doubled": 3}, "--doubled goes with --without tracker"),
        ({"without": "tracker", "free_poses": 4}, "--positions is for a tracker"),
        ({"without": "tracker", "poses": 3, "doubled": 4}, "at most the 3 poses"),
    ],
)
def test_options_that_do_not_fit_are_refused_by_name(story, tmp_path, options, message):
    with pytest.raises(ElastocalError, match=message):
        ec.plan(story / "cell" / "cell.yaml", out=tmp_path / "plan", **options)


@pytest.mark.parametrize(("option", "value"), [("touch", "cold"), ("until", 5e-5)])
def test_what_a_tracker_judges_is_refused_without_one(story, tmp_path, option, value):
    with pytest.raises(ElastocalError, match="tracker"):
        ec.run(
            story / "cell" / "cell.yaml",
            plan=story / "plan",
            out=tmp_path / "run",
            **{option: value},
        )


@pytest.mark.slow
def test_tools_are_turned_by_up_to_a_radian(story, tmp_path):
    cell = story / "cell" / "cell.yaml"
    ec.plan(cell, out=tmp_path / "plan", poses=6, compare="none")
    # Untracked, points are those of the same draw: the tool differs by its turn alone.
    taken = {each.candidate: each for each in read_plan(tmp_path / "plan").poses}
    shared = [
        (each, taken[each.candidate])
        for each in read_plan(story / "plan").poses
        if each.candidate in taken and each.doubles is None
    ]
    assert shared
    for turned, other in shared:
        R = turned.T_base_tcp[:3, :3].T @ other.T_base_tcp[:3, :3]
        assert abs(np.arctan2(R[1, 0], R[0, 0])) <= TURN + 1e-9


def test_places_differ_by_the_stated_spread_and_each_is_always_the_same():
    places = PlaceSpread.of(0.2, 5)
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (4000, 3))
    found = np.array([places.at(each) for each in points])
    np.testing.assert_allclose(found.mean(axis=0), 1.0, atol=0.02)
    np.testing.assert_allclose(found.std(axis=0), 0.2, rtol=0.1)
    np.testing.assert_array_equal(places.at(points[0]), PlaceSpread.of(0.2, 5).at(points[0]))
    near = places.at(points[0] + [0.5e-3, 0.0, 0.0])
    np.testing.assert_allclose(near, places.at(points[0]), atol=0.01)


def test_two_disks_give_way_twice_as_far():
    law = ContactLaw(4e6, 1.5e6, 1e10, 0.5, 0.0)
    two = law.at(np.zeros(3), 2)
    assert two.normal_stiffness == pytest.approx(2e6)
    assert two.shear_stiffness == pytest.approx(0.75e6)


def test_without_a_tracker_displacements_count_from_light_contact(story):
    cell = load_cell(story / "cell" / "cell.yaml")
    assert cell.file.procedure.reference == "unloaded"
    assert without_tracker(cell).file.procedure.reference == "light_contact"


def test_a_cell_without_disks_to_stack_says_so(story):
    cell = load_cell(story / "cell" / "cell.yaml")
    engagement = cell.file.engagement.model_copy(update={"disk_thickness": None})
    tip = replace(cell, file=cell.file.model_copy(update={"engagement": engagement}))
    assert [each.kind for each in doubled_findings(tip, None, 8)] == ["plan.no-disk-to-stack"]
    with pytest.raises(ElastocalError, match="no disk to stack"):
        require_doubled(tip, 4, 6)
    assert require_doubled(tip, 0, 6) == 0
