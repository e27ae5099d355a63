"""The KRL program, read back by a reader that shares no code with the writer."""

import re
from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.programs import write_plan_program
from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.compensation.programs.plan_program import TOUCH_SPEED
from elastocal.errors import FileAccessError, PlanningError, SchemaError
from support import krl, plans

DEG = MM = 1e-3


def write_krl(folder, plan, name="calib"):
    return write_plan_program(folder, plan, KrlWriter(), name)


@pytest.fixture(scope="module", params=[True, False], ids=["rail", "still"])
def rail(request):
    return request.param


@pytest.fixture(scope="module")
def files(rail, tmp_path_factory):
    return write_krl(tmp_path_factory.mktemp("krl"), plans.plan(rail))


@pytest.fixture(scope="module")
def program(files):
    return krl.read(*files)


def assert_axes(position, joints, rail):
    """Axis values in deg, the rail in mm on E1, the other external axes 0."""
    assert position.kind == "E6AXIS"
    arm, external = joints[-6:], [1e3 * joints[0]] if rail else []
    np.testing.assert_allclose(position.arm, np.degrees(arm), rtol=0, atol=DEG)
    wanted = [*external, *[0.0] * (6 - len(external))]
    np.testing.assert_allclose(position.external, wanted, rtol=0, atol=MM)


def test_every_name_that_moves_is_declared_and_every_declared_one_moves(program):
    assert {name for _, name in program.moves()} == set(program.positions)


def test_axis_positions_are_for_ptp_and_frames_for_lin(program):
    wanted = {"PTP": "E6AXIS", "LIN": "E6POS"}
    for kind, name in program.moves():
        assert program.positions[name].kind == wanted[kind]


def test_it_leaves_home_visits_the_poses_in_order_and_returns(program):
    moves = program.moves()
    assert moves[0] == moves[-1] == ("PTP", "XHOME")
    contacts = [name for _, name in moves if name.startswith("XCON")]
    assert contacts == [f"XCON{i}" for i in range(6)]


def test_home_and_via_points_are_the_plans(program, rail):
    plan = plans.plan(rail)
    assert_axes(program.positions["XHOME"], plan.robot.home, rail)
    vias = [name for name in program.positions if name.startswith("XVIA")]
    assert vias == ["XVIA1_1"]
    assert_axes(program.positions["XVIA1_1"], plan.moves[1].via[0], rail)
    moves = program.moves()
    assert moves[moves.index(("PTP", "XVIA1_1")) + 1] == ("PTP", "XAPP1")


def test_via_points_on_the_way_home_are_driven(tmp_path):
    plan = plans.plan()
    last = replace(plan.moves[-1], via=(plan.robot.home, plan.robot.home))
    plan = replace(plan, moves=(*plan.moves[:-1], last))
    moves = krl.read(*write_krl(tmp_path, plan)).moves()
    assert moves[-3:] == [("PTP", "XVIA6_1"), ("PTP", "XVIA6_2"), ("PTP", "XHOME")]


def test_every_position_is_the_plans(program, rail):
    plan = plans.plan(rail)
    for pose in plan.poses:
        assert_axes(program.positions[f"XAPP{pose.id}"], pose.approach_joints, rail)
        for name, away in (("XCON", 0.0), ("XNEAR", plans.NEAR), ("XRET", plans.APPROACH)):
            position = program.positions[f"{name}{pose.id}"]
            T = position.T
            wanted = np.array(pose.tcp_position) + away * np.array(pose.normal)
            np.testing.assert_allclose(1e3 * T[:3, 3], 1e3 * wanted, rtol=0, atol=MM)
            R = pose.T_base_tcp[:3, :3]
            np.testing.assert_allclose(T[:3, :3], R, rtol=0, atol=np.radians(DEG))
            np.testing.assert_allclose(
                position.external, [312.5 if rail else 0.0, 0, 0, 0, 0, 0], atol=MM
            )


def test_ptp_and_lin_describe_the_same_approach_pose(program, rail):
    """The axis values, through forward kinematics, lead to the frame that LIN retreats to."""
    for number in range(6):
        axes, frame = (program.positions[f"{name}{number}"] for name in ("XAPP", "XRET"))
        external = [axes.values["E1"] / 1e3] if rail else []
        reached = plans.robot(rail).forward([*external, *np.radians(axes.arm)])
        np.testing.assert_allclose(reached, frame.T, rtol=0, atol=2e-6)


def test_each_pose_stops_before_contact_and_in_contact(program):
    pose = [
        ("PTP", "XAPP3"),
        ("VEL.CP", plans.CONTACT_SPEED),
        ("LIN", "XNEAR3"),
        ("WAIT SEC 0", None),
        ("HALT", None),
        ("VEL.CP", TOUCH_SPEED),
        ("LIN", "XCON3"),
        ("WAIT SEC 0", None),
        ("HALT", None),
        ("LIN", "XNEAR3"),
        ("VEL.CP", plans.CONTACT_SPEED),
        ("LIN", "XRET3"),
    ]
    start = program.orders.index(pose[0])
    assert program.orders[start : start + len(pose)] == pose
    assert program.orders.count(("HALT", None)) == 12


def test_nothing_moves_fast(program):
    speeds = {value for kind, value in program.orders if kind == "VEL.CP"}
    assert max(speeds) <= 0.05
    assert "BAS (#VEL_PTP,10 )" in program.setup


def test_tool_and_base_are_used_and_never_written(program, files):
    setup = program.setup
    assert setup.index("$TOOL = TOOL_DATA[1]") > setup.index("BAS (#INITMOV,0 )")
    assert "$BASE = BASE_DATA[1]" in setup
    code = [line.split(";")[0] for path in files for line in krl.lines_of(path)]
    assert not [line for line in code if line.strip().startswith(("TOOL_DATA", "BASE_DATA"))]


def test_lines_are_short_and_comments_plain(files):
    for path in files:
        assert max(map(len, krl.lines_of(path))) <= 200


def test_the_number_of_poses_does_not_make_names_too_long(tmp_path):
    names = krl.read(*write_krl(tmp_path, plans.plan())).positions
    assert max(map(len, names)) <= 24 - 3


def test_names_of_people_cannot_break_out_of_a_comment(tmp_path):
    evil = "Zelle ß\r\nPTP {A1 0}\x1b;%{E}\u2028" + 300 * "x"
    plan = plans.plan()
    plan = replace(
        plan,
        cell=replace(plan.cell, name=evil),
        robot=replace(plan.robot, name=evil),
        contact=replace(plan.contact, load_cases={evil: (0.0, 0.0, -1.0)}),
        poses=tuple(replace(pose, seen_by=evil) for pose in plan.poses),
    )
    harmless = krl.read(*write_krl(tmp_path, plans.plan()))
    found = krl.read(*write_krl(tmp_path, plan))
    assert found.orders == harmless.orders
    assert not [line for line in found.comments if "%" in line]


@pytest.mark.parametrize("name", ["", "2nd", "a b", "naïve", "a.b", "../x", "$x", "a" * 21])
def test_a_name_that_krl_does_not_allow_is_refused(name, tmp_path):
    with pytest.raises(PlanningError) as caught:
        write_krl(tmp_path, plans.plan(), name)
    assert str(caught.value).startswith(f"{name!r} cannot name a KRL program: allowed are 1 to 20")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["lin", "Halt", "XHOME", "xcon3", "aux"])
def test_a_name_with_a_meaning_is_refused(name, tmp_path):
    with pytest.raises(PlanningError, match="has a meaning"):
        write_krl(tmp_path, plans.plan(), name)


def test_a_name_of_twenty_characters_fills_the_file_name(tmp_path):
    src, dat = write_krl(tmp_path, plans.plan(), 20 * "a")
    assert len(src.name) == len(dat.name) == 24
    assert krl.read(src, dat).name == 20 * "a"


def test_both_files_are_written_or_none(tmp_path):
    (tmp_path / "calib.dat").mkdir()
    with pytest.raises(FileAccessError, match=r"calib\.dat"):
        write_krl(tmp_path, plans.plan())
    assert [path.name for path in tmp_path.iterdir()] == ["calib.dat"]


def test_a_plan_that_contradicts_itself_is_not_programmed(tmp_path):
    plan = plans.plan()
    with pytest.raises(SchemaError, match="moves"):
        write_krl(tmp_path, replace(plan, moves=plan.moves[1:]))


def test_poses_are_named_by_their_ids_alone(tmp_path):
    plan = plans.plan()
    text = write_krl(tmp_path, plan)[0].read_text()
    last = len(plan.poses) - 1
    assert re.findall(r"^;FOLD (POSE .*?): about", text, re.MULTILINE) == [
        f"POSE {pose.id} of 0 to {last}" for pose in plan.poses
    ]
    assert "candidate" not in text
