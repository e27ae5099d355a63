"""The plan's record: lossless, and refused by name when it contradicts itself."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.planning import PLAN, PlanResult, read_plan, write_plan
from elastocal.planning.plan_result import _SCHEMA as SCHEMA, check_plan
from elastocal.planning.surface.findings import DEGENERATE
from support import plans


@pytest.fixture
def written(tmp_path):
    return write_plan(tmp_path, plans.plan())


def edited(path, change):
    """Change the JSON in place; return its folder."""
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    return path.parent


def refusal(folder, error=SchemaError):
    with pytest.raises(error) as caught:
        read_plan(folder)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 400
    return message


def altered(**changes) -> PlanResult:
    return replace(plans.plan(), **changes)


def pose(number, **changes):
    """The plan's poses with one altered."""
    poses = list(plans.plan().poses)
    poses[number] = replace(poses[number], **changes)
    return tuple(poses)


def test_a_plan_comes_back_as_it_was(tmp_path):
    path = write_plan(tmp_path, plans.plan())
    assert path == tmp_path / PLAN
    assert read_plan(tmp_path) == read_plan(path) == plans.plan()


def test_a_plan_of_an_earlier_version_is_read(tmp_path):
    path = write_plan(tmp_path, plans.plan())
    old = edited(path, lambda data: data["contact"].pop("straight_time"))
    assert read_plan(old) == plans.plan()
    assert plans.plan().contact.straight_time is None


def test_a_plan_of_before_findings_had_kinds_is_read_with_its_hash(tmp_path):
    def as_then(data):
        data["schema"] = "elastocal.plan/1"
        del data["sha256"], data["contact"]["straight_time"], data["production"]
        text = json.dumps(data, separators=(",", ":"))
        data["sha256"] = hashlib.sha256(text.encode()).hexdigest()

    folder = edited(write_plan(tmp_path, plans.plan()), as_then)
    assert read_plan(folder) == plans.plan()
    change = edited(folder / PLAN, lambda data: data["findings"].append("another"))
    assert "was changed by hand" in refusal(change)


def test_findings_keep_their_kinds_and_count_in_the_hash(tmp_path):
    finding = DEGENERATE(name="dome.stl", count=3)
    path = write_plan(tmp_path, altered(findings=(finding,)))
    (read,) = read_plan(tmp_path).findings
    assert (read.kind, dict(read.values)) == (finding.kind, {"name": "dome.stl", "count": 3})
    change = edited(path, lambda data: data["findings"][0]["values"].update(count=4))
    assert "was changed by hand" in refusal(change)


def test_the_time_of_the_straight_ways_counts_in_the_hash(tmp_path):
    plan = plans.plan()
    plan = replace(plan, contact=replace(plan.contact, straight_time=10.5))
    path = write_plan(tmp_path, plan)
    assert read_plan(tmp_path) == plan
    change = edited(path, lambda data: data["contact"].update(straight_time=11.0))
    assert "was changed by hand" in refusal(change)


def test_the_load_cases_keep_their_order(written):
    assert list(read_plan(written).contact.load_cases) == list(plans.LOAD_CASES)


def test_the_keys_of_the_contract_stand_in_the_file(written):
    data = json.loads(written.read_text())
    assert data["schema"] == SCHEMA == "elastocal.plan/2"
    keys = {"id", "joints", "approach_joints", "tcp_position", "normal", "margins"}
    assert keys <= set(data["poses"][0])
    assert {"name", "covering_radius", "order"} <= set(data["search"])


def test_the_frame_of_a_pose_is_where_its_joints_lead():
    reached = plans.robot().forward([pose.joints for pose in plans.plan().poses])
    frames = np.array([pose.T_base_tcp for pose in plans.plan().poses])
    np.testing.assert_allclose(frames, reached, atol=1e-9)
    np.testing.assert_allclose(
        frames[:, :3, 2], [-np.array(pose.normal) for pose in plans.plan().poses], atol=1e-12
    )


def test_the_time_is_that_of_moves_and_contacts():
    plan = plans.plan()
    assert plan.travel_time == sum(4.0 + i for i in range(7))
    assert plan.total_time == plan.travel_time + sum(60.0 + i for i in range(6))


def move_home(data):
    data["robot"]["home"][0] += 1e-6


def swap_loads(data):
    loads = data["contact"]["load_cases"]
    data["contact"]["load_cases"] = dict(reversed(loads.items()))


@pytest.mark.parametrize("change", [move_home, swap_loads])
def test_a_plan_that_was_changed_by_hand_is_refused(written, change):
    assert "was changed by hand: make it anew with `elastocal plan`" in refusal(
        edited(written, change)
    )


def test_another_layout_of_the_same_plan_is_read(written):
    assert read_plan(edited(written, lambda _: None)) == plans.plan()


def test_a_folder_without_plan_is_named(tmp_path):
    message = refusal(tmp_path, FileAccessError)
    assert str(tmp_path / PLAN) in message
    assert "No such file" in message


def test_an_unknown_schema_is_refused_by_name(written):
    folder = edited(written, lambda data: data.update(schema="elastocal.plan/9"))
    assert "'elastocal.plan/9'" in refusal(folder)
    assert "'elastocal.plan/2'" in refusal(folder)


def test_an_unknown_key_is_refused_with_the_nearest_one(written):
    def misspell(data):
        data["poses"][2]["jonts"] = data["poses"][2]["joints"]

    assert "did you mean 'joints'?" in refusal(edited(written, misspell))


def test_text_that_is_no_json_is_refused(written):
    written.write_text(written.read_text()[:200])
    assert "not valid JSON" in refusal(written)


def test_a_number_that_is_not_finite_is_refused(written):
    def spoil(data):
        data["poses"][1]["contact_time"] = float("nan")

    assert "poses.1.contact_time" in refusal(edited(written, spoil))


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (altered(poses=(), moves=()), "poses: there is none"),
        (altered(poses=pose(2, id=7)), "poses.2.id: must be 2"),
        (altered(poses=pose(2, candidate=1000)), "poses.2.candidate: 1000 is not one of 50"),
        (altered(poses=pose(2, candidate=-1)), "poses.2.candidate: -1 is not one of 50"),
        (altered(poses=pose(1, candidate=43)), "a candidate stands twice"),
        (altered(poses=pose(3, margins={"wirst": 1.0})), "poses.3.margins: 'wirst' is no check"),
        (altered(poses=pose(3, joints=(0.0,) * 6)), "poses.3.joints: needs a position of each"),
        (altered(poses=pose(3, approach_joints=())), "poses.3.approach_joints: needs a position"),
        (altered(moves=plans.plan().moves[1:]), "moves: 6 poses need 7 moves, got 6"),
        (altered(moves=plans.plan().moves[::-1]), "moves.0: (start, end) must be (None, 0)"),
    ],
)
def test_a_contradiction_is_named_and_never_written(plan, said, tmp_path):
    with pytest.raises(SchemaError) as caught:
        write_plan(tmp_path, plan)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("order", [(), (0, 1, 2, 3, 4, 4), (0, 1, 2, 3, 4, 6)])
def test_the_search_order_must_hold_each_pose_once(order):
    search = replace(plans.plan().search, order=order)
    with pytest.raises(SchemaError, match=r"search\.order: must hold each pose id once"):
        check_plan(altered(search=search))


def test_joints_of_home_via_points_and_compared_candidates_are_checked_too():
    plan = plans.plan()
    robot = replace(plan.robot, home=(0.0,))
    moves = (replace(plan.moves[0], via=((1.0,),)), *plan.moves[1:])
    comparison = replace(plan.comparison, candidates=(0, 50))
    for changes, said in (
        ({"robot": robot}, r"robot\.home: needs a position of each of 7 joints, got 1"),
        ({"moves": moves}, r"moves\.0\.via\.0: needs"),
        ({"comparison": comparison}, r"comparison\.candidates: must be among 50, got 50"),
    ):
        with pytest.raises(SchemaError, match=said):
            check_plan(altered(**changes))


def test_a_plan_shows_itself_in_a_few_lines():
    assert repr(plans.plan()).splitlines()[0] == "PlanResult"
    assert len(repr(plans.plan()).splitlines()) <= 20
