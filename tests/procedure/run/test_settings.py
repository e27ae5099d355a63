"""A plan is held against its cell before anything moves: what the reviewer changed by hand."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.errors import ProcedureError
from elastocal.planning import read_plan
from elastocal.procedure import check_compatible, registration_warnings
from support.run_cells import planned_cell


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The cell and its plan of four poses."""
    planned = planned_cell(tmp_path_factory.mktemp("planned"))
    return load_cell(planned.cell), read_plan(planned.plan)


def with_pose(plan, number, **changes):
    poses = list(plan.poses)
    poses[number] = replace(poses[number], **changes)
    return replace(plan, poses=tuple(poses))


def with_part(plan, part, **changes):
    return replace(plan, **{part: replace(getattr(plan, part), **changes)})


def moved(joints, by=0.2):
    return (*joints[:2], joints[2] + by, *joints[3:])


def far_via(plan):
    moves = list(plan.moves)
    moves[2] = replace(moves[2], via=((0.5, 99.0, -1.0, 1.0, 0.0, 1.0, 0.0),))
    return replace(plan, moves=tuple(moves))


def heavy(plan):
    return with_part(
        plan,
        "contact",
        load_cases=plan.contact.load_cases | {"normal": (0.0, 0.0, -4000.0)},
    )


def swapped(plan):
    return with_part(plan, "contact", load_cases=dict(reversed(plan.contact.load_cases.items())))


def turned(plan):
    return with_pose(plan, 1, normal=tuple(-x for x in plan.poses[1].normal))


def off(plan):
    return with_pose(plan, 1, approach_joints=moved(plan.poses[1].approach_joints))


def near_off(plan):
    return with_pose(plan, 1, joints=moved(plan.poses[1].joints, 1e-4))


CHANGES = [
    (off, "poses.1.approach_joints lead "),
    (near_off, "poses.1.joints lead "),
    (far_via, "moves.2.via.0: "),
    (heavy, "load case 'normal' is (0, 0, -4000) N, that of the cell (0, 0, -1100) N"),
    (swapped, "contact.load_cases are north, normal, those of the cell normal, north"),
    (lambda p: with_part(p, "contact", near_contact=-0.01), "contact.near_contact is -0.01 m"),
    (lambda p: with_part(p, "contact", approach_distance=0.2), "contact.approach_distance is"),
    (turned, "poses.1: z of the tcp frame is not against the normal"),
    (lambda p: with_part(p, "robot", home=moved(p.robot.home)), "robot.home is "),
    (lambda p: with_pose(p, 0, seen_by="x"), "poses.0.seen_by: 'x' is no tracker of the cell"),
    (lambda p: with_part(p, "robot", joints=p.robot.joints[::-1]), "robot.joints are "),
]


@pytest.mark.slow
def test_a_plan_fits_the_cell_that_it_was_made_for(made):
    cell, plan = made
    check_compatible(plan, cell)


@pytest.mark.parametrize(("change", "message"), CHANGES)
def test_a_plan_with_other_numbers_is_refused_by_name(made, change, message):
    cell, plan = made
    with pytest.raises(ProcedureError) as caught:
        check_compatible(change(plan), cell)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_number_that_is_none_is_refused(made):
    cell, plan = made
    with pytest.raises(ProcedureError, match=r"contact\.near_contact"):
        check_compatible(with_part(plan, "contact", near_contact=np.nan), cell)


def seen_by(plan, *stations):
    poses = [replace(p, seen_by=s) for p, s in zip(plan.poses, stations, strict=True)]
    return replace(plan, poses=tuple(poses))


def test_a_station_with_too_few_poses_is_told(made):
    plan = made[1]
    assert registration_warnings(seen_by(plan, "a", "a", "a", "a")) == ()
    (line,) = registration_warnings(seen_by(plan, "a", "b", "a", "a"))
    assert line.startswith("station b sees 1 of the 3 poses that it needs to be registered")
    assert "at pose 1 will be missing" in line


def test_a_plan_of_which_no_station_could_be_registered_is_refused(made):
    with pytest.raises(ProcedureError, match="no tracker station sees 3 poses of the plan, 2"):
        registration_warnings(seen_by(made[1], "a", "b", "a", "b"))
