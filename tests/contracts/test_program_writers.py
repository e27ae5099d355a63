"""What every writer of robot programs keeps, read back by readers that share no code with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal import workflows
from elastocal.compensation.programs import PathProgram, choose_writer, write_plan_program
from elastocal.compensation.programs.languages import PROGRAM_WRITERS, writer_named
from elastocal.compensation.programs.path_program import BEFORE_PATH, MOST_ROWS
from elastocal.compensation.programs.plan_program import TOUCH_SPEED, plan_program
from elastocal.errors import FileAccessError, PathError, PlanningError
from elastocal.identification import write_model
from elastocal.robot import Robot, catalogue
from elastocal.testing import ProgramSuite
from support import plans, urdfs
from support.paths import euler_columns, force_columns, made_up, read_csv, write_csv
from support.program_readers import READERS

MODELS = {
    "krl": ("KR 120 R2700 extra HA", (0.0, 0.0, 0.0)),
    "rapid": ("IRB 6700-200/2.60", (0.0, 0.0, 0.0)),
    "fanuc": ("R-2000iC/210F", (0.0, 0.0, 0.0)),
    "urscript": ("UR20", (-0.85, -0.3, -0.35)),
    "as": ("BXP210L", (0.0, 0.0, 0.0)),
}
"""A robot of each language, and how far the poses are moved to be within its reach."""
CASES = [
    (name, rail) for name in MODELS for rail in (False, True) if name != "urscript" or not rail
]
MM, DEG = 1e-3, np.radians(1e-3)


def plan_of(language, rail=False):
    model, shift = MODELS[language]
    return plans.plan_for(model, rail, shift)


@pytest.fixture(
    scope="module", params=CASES, ids=lambda case: f"{case[0]}-{'rail' if case[1] else 'still'}"
)
def case(request):
    return request.param


@pytest.fixture(scope="module")
def plan(case):
    return plan_of(*case)


@pytest.fixture(scope="module")
def read(case, plan, tmp_path_factory):
    files = write_plan_program(tmp_path_factory.mktemp("program"), plan, writer_named(case[0]))
    return READERS[case[0]](files)


def test_every_writer_has_a_reader_and_a_robot():
    assert set(PROGRAM_WRITERS) == set(READERS) == set(MODELS)


def test_the_program_has_its_name(read):
    assert read.name == "calib"


def test_poses_are_visited_in_order_by_axes_then_straight(read, plan):
    for pose in plan.poses:
        i = pose.id
        start = read.steps.index(("axes", f"XAPP{i}"))
        names = [step[:2] for step in read.steps[start : start + 7]]
        assert names == [
            ("axes", f"XAPP{i}"),
            ("straight", f"XNEAR{i}"),
            ("stop",),
            ("straight", f"XCON{i}"),
            ("stop",),
            ("straight", f"XNEAR{i}"),
            ("straight", f"XRET{i}"),
        ]
    contacts = [step[1] for step in read.steps if step[0] == "straight" and "XCON" in step[1]]
    assert contacts == [f"XCON{pose.id}" for pose in plan.poses]


def test_it_leaves_home_goes_by_the_via_poses_and_returns(read):
    assert read.steps[0] == read.steps[-1] == ("axes", "XHOME")
    via = read.steps.index(("axes", "XVIA1_1"))
    assert read.steps[via + 1] == ("axes", "XAPP1")


def test_every_target_moves_and_every_move_has_one(read):
    assert {step[1] for step in read.steps if len(step) > 1} == set(read.targets)


def test_axis_positions_are_the_plans(read, plan, case):
    external = 1 if case[1] else 0
    wanted = {f"XAPP{pose.id}": pose.approach_joints for pose in plan.poses}
    wanted |= {"XHOME": plan.robot.home, "XVIA1_1": plan.moves[1].via[0]}
    for name, q in wanted.items():
        target = read.targets[name]
        np.testing.assert_allclose(target.arm, q[external:], rtol=0, atol=DEG)
        np.testing.assert_allclose(target.external[:external], np.array(q[:external]) * 1e3)


def test_straight_moves_end_where_the_plan_has_it(read, plan, case):
    """By frames as they stand, by joints through forward kinematics."""
    robot = Robot.from_urdf(plan.robot.urdf, "tcp")
    for pose in plan.poses:
        for name, away in (("XCON", 0.0), ("XNEAR", plans.NEAR), ("XRET", plans.APPROACH)):
            target = read.targets[f"{name}{pose.id}"]
            wanted = pose.T_base_tcp
            wanted[:3, 3] += away * np.array(pose.normal)
            T = target.T
            if T is None:
                rail = np.array(target.external[:1]) / 1e3 if case[1] else []
                T = robot.forward([*rail, *target.arm])
            np.testing.assert_allclose(T[:3, 3], wanted[:3, 3], rtol=0, atol=2 * MM * MM)
            np.testing.assert_allclose(T[:3, :3], wanted[:3, :3], rtol=0, atol=DEG)
            if case[1]:
                assert target.external[0] == pytest.approx(1e3 * plans.RAIL_AT, abs=1e-3)


def test_an_external_axis_that_is_not_there_moves_nothing(read, case):
    for target in read.targets.values():
        assert not np.any(target.external[1 if case[1] else 0 :])


def test_speeds_are_the_cells_and_slow_at_the_surface(read):
    speeds = {step[1][:4]: set() for step in read.steps if step[0] == "straight"}
    for step in read.steps:
        if step[0] == "straight":
            speeds[step[1][:4]].add(round(step[2], 9))
    assert speeds["XCON"] == {TOUCH_SPEED}
    assert speeds["XRET"] == {plans.CONTACT_SPEED}
    assert speeds["XNEA"] == {TOUCH_SPEED, plans.CONTACT_SPEED}


def test_axes_move_slowly(read, case):
    most = {"krl": 10, "fanuc": 10, "rapid": 100, "urscript": np.radians(12.0) + 1e-9, "as": 10}
    assert 0 < read.axes_speed <= most[case[0]]


def test_the_tool_is_set_or_its_frame_is_told(read):
    if read.tool is not None:
        np.testing.assert_allclose(read.tool, plans.T_FLANGE_TCP, atol=1e-7)
    told = " ".join(read.comments)
    assert "the tcp in link 'flange'" in told
    assert "150.000" in told.replace("0.1500", "150.0000")


def test_the_head_says_that_nothing_was_tried_and_what_to_check(read, plan):
    told = " ".join(read.comments)
    assert "NOT TRIED ON A ROBOT" in told
    assert "Compare before the first motion" in told
    assert "south: -280.0, 0.0, -1100.0 N" in told
    assert all(name in told.replace(" ", "") for name in plan.robot.joints)


def test_lines_are_short_and_numbers_have_no_exponent(read, case):
    assert max(map(len, read.lines)) <= 250
    code = "\n".join(line for line in read.lines if "9E+09" not in line)
    assert "e-0" not in code.replace("None", "")
    assert "nan" not in code.split()
    assert " -0.000 " not in code


def test_names_of_people_cannot_break_out_of_a_comment(case, read, plan, tmp_path):
    evil = 'Zelle ß\r\nPTP {A1 0}\x1b;%{E}\u2028"end\n' + 300 * "x"
    changed = replace(
        plan,
        cell=replace(plan.cell, name=evil),
        contact=replace(plan.contact, load_cases={evil: (0.0, 0.0, -1.0)}),
        poses=tuple(replace(pose, seen_by=evil) for pose in plan.poses),
    )
    found = READERS[case[0]](write_plan_program(tmp_path, changed, writer_named(case[0])))
    assert found.steps == read.steps


class TestEveryWriter(ProgramSuite):
    @pytest.fixture
    def writer(self, case):
        return writer_named(case[0])


def test_an_arm_with_three_joints_is_refused(case):
    robot = Robot.from_urdf(urdfs.planar_arm_urdf(), "tcp")
    writer = writer_named(case[0])
    assert not writer.takes(robot)
    with pytest.raises(PlanningError, match=f"cannot be programmed in {writer.title}: its arm"):
        writer.require_robot(robot)


class TestChoice:
    @pytest.mark.parametrize("language", MODELS)
    def test_the_maker_of_the_robot_chooses(self, language):
        writer, reason = choose_writer(catalogue.load(MODELS[language][0]))
        assert writer.language == language
        assert reason.startswith(writer.title)

    def test_a_robot_of_another_maker_gets_no_program(self):
        writer, reason = choose_writer(catalogue.load("RX160"))
        assert writer is None
        assert reason.startswith("no program: none is written for robots of Staeubli; the table")

    def test_a_robot_of_no_known_maker_gets_none_and_the_option_is_named(self):
        robot = Robot.from_urdf(urdfs.opw_arm_urdf(**urdfs.KR_LIKE), "tcp")
        writer, reason = choose_writer(robot)
        assert writer is None
        assert reason.endswith("give --language krl|rapid|fanuc|urscript|as")
        assert choose_writer(robot, "RAPID")[0].language == "rapid"

    def test_none_can_be_asked_for(self):
        assert choose_writer(catalogue.load("UR20"), "none")[0] is None

    def test_an_unknown_language_is_refused_with_the_known_ones(self):
        with pytest.raises(
            PlanningError,
            match=r"did you mean .rapid.\? \(allowed: none, krl, rapid, fanuc, urscript, as\)",
        ):
            choose_writer(catalogue.load("UR20"), "rapit")

    def test_a_language_that_cannot_program_the_robot_is_refused_when_asked_for(self):
        robot = Robot.from_urdf(
            plans.plan_for("UR20", False, MODELS["urscript"][1]).robot.urdf, "tcp"
        )
        with pytest.raises(PlanningError, match="third axis must turn against its second"):
            choose_writer(robot, "fanuc")


def write_path(folder, plan, rows=12):
    """Write a model and a path of 2 mm steps beside the first pose, pressed; return the poses."""
    robot = Robot.from_urdf(plan.robot.urdf, "tcp")
    write_model(folder / "model.json", made_up(robot))
    pose = plan.poses[0]
    T = np.tile(pose.T_base_tcp, (rows, 1, 1))
    T[:, :3, 3] += 2e-3 * np.arange(rows)[:, None] * T[:, :3, 0]
    force = force_columns(np.tile([50.0, -30.0, -400.0], (rows, 1)), "force_tcp_")
    rail = {f"{name}[m]": np.full(rows, plans.RAIL_AT) for name in robot.joint_names[:-6]}
    write_csv(folder / "path.csv", rail | euler_columns(T) | force)
    return T


def compensate(folder, plan, **options):
    start = ", ".join(
        f"{value} {'m' if name == 'rail' else 'rad'}"
        for name, value in zip(plan.robot.joints, plan.poses[0].joints, strict=True)
    )
    files = {"path": folder / "path.csv", "out": folder / "corrected.csv"}
    return workflows.compensate(folder / "model.json", **files, start=start, **options)


@pytest.fixture(scope="module")
def folder(plan, tmp_path_factory):
    """Return a folder with a path for the case's robot, and its model."""
    folder = tmp_path_factory.mktemp("path")
    write_path(folder, plan)
    return folder


@pytest.fixture(scope="module")
def course(case, plan, folder):
    """Return the program of that path, corrected."""
    found = compensate(folder, plan, program="course", language=case[0], speed=0.02)
    assert {Path(each).stem for each in found.program} == {"course"}
    return READERS[case[0]]([Path(each) for each in found.program])


class TestPath:
    """The program of a path that `compensate` corrected."""

    def test_it_stops_before_the_first_row_and_goes_straight_through_all(self, course):
        assert [step[:2] for step in course.steps] == [
            ("axes", "XBEFORE"),
            ("stop",),
            *(("straight", f"XROW{index}") for index in range(1, 13)),
            ("straight", "XAFTER"),
        ]
        assert {round(step[2], 9) for step in course.steps if step[0] == "straight"} == {0.02}

    def test_its_rows_are_the_corrected_path(self, course, plan, folder, case):
        robot = Robot.from_urdf(plan.robot.urdf, "tcp")
        wanted = 1e-3 * read_csv(folder / "corrected.csv", "x[mm]", "y[mm]", "z[mm]")
        programmed = 1e-3 * read_csv(folder / "path.csv", "x[mm]", "y[mm]", "z[mm]")
        assert np.linalg.norm(wanted - programmed, axis=1).min() > 1e-4
        for index, position in enumerate(wanted, start=1):
            target = course.targets[f"XROW{index}"]
            rail = np.array(target.external[:1]) / 1e3 if case[1] else []
            T = robot.forward([*rail, *target.arm]) if target.T is None else target.T
            np.testing.assert_allclose(T[:3, 3], position, rtol=0, atol=2 * MM * MM)
            np.testing.assert_allclose(
                T[:3, :3], plan.poses[0].T_base_tcp[:3, :3], rtol=0, atol=DEG
            )

    def test_the_place_before_it_is_back_along_the_tool(self, course, plan, folder, case):
        robot = Robot.from_urdf(plan.robot.urdf, "tcp")
        target = course.targets["XBEFORE"]
        rail = np.array(target.external[:1]) / 1e3 if case[1] else []
        back = robot.forward([*rail, *target.arm])
        first = 1e-3 * read_csv(folder / "corrected.csv", "x[mm]", "y[mm]", "z[mm]")[0]
        wanted = first - BEFORE_PATH * plan.poses[0].T_base_tcp[:3, 2]
        np.testing.assert_allclose(back[:3, 3], wanted, rtol=0, atol=2 * MM * MM)

    def test_its_head_says_what_it_is(self, course):
        told = " ".join(" ".join(course.comments).split())
        assert "NOT TRIED ON A ROBOT" in told
        assert "Path path.csv, corrected by elastocal compensate." in told
        assert "all 12 rows at 20 mm/s" in told

    def test_it_replaces_its_own_and_nothing_else(self, case, plan, folder, course, tmp_path):
        again = compensate(folder, plan, program="course", language=case[0])
        assert Path(again.program[0]).stem == course.name
        write_path(tmp_path, plan)
        main = writer_named(case[0]).paths(tmp_path, "mine")[0]
        main.write_text("not ours")
        with pytest.raises(FileAccessError, match="is there already"):
            compensate(tmp_path, plan, program="mine", language=case[0])

    def test_a_row_to_which_no_straight_move_leads_leaves_no_file(self, case, plan):
        robot = Robot.from_urdf(plan.robot.urdf, "tcp")
        program = PathProgram(robot, writer_named(case[0]), "course")
        q = np.tile(plan.poses[0].joints, (3, 1))
        q[2, -1] += np.radians(91.0)
        with pytest.raises(PathError, match=r"row 2: .* turns by 91\.0 deg from the row before"):
            program.add(q, robot.forward(q), lambda row: f"row {row}")

    def test_too_many_rows_are_refused(self, case, plan):
        robot = Robot.from_urdf(plan.robot.urdf, "tcp")
        program = PathProgram(robot, writer_named(case[0]), "course")
        q = np.tile(plan.poses[0].joints, (MOST_ROWS, 1))
        T = np.broadcast_to(plan.poses[0].T_base_tcp, (MOST_ROWS, 4, 4))
        program.add(q, T, str)
        with pytest.raises(PathError, match=f"at most {MOST_ROWS} rows"):
            program.add(q[:1], T[:1], str)

    def test_the_name_is_one_that_the_controller_allows(self, case, plan, folder):
        with pytest.raises(PlanningError, match="cannot name a"):
            compensate(folder, plan, program="2nd", language=case[0])


class TestPathChoice:
    """One rule for `plan` and `compensate`."""

    def test_the_maker_of_the_robot_chooses(self, tmp_path):
        plan = plan_of("urscript")
        robot = Robot.from_urdf(plan.robot.urdf, "tcp")
        write_path(tmp_path, plan, rows=2)
        if choose_writer(robot)[0] is None:
            with pytest.raises(PlanningError, match="give --language"):
                compensate(tmp_path, plan, program="course")
        else:
            found = compensate(tmp_path, plan, program="course")
            assert [Path(each).name for each in found.program] == ["course.script"]
            assert any("URScript, for a robot of Universal Robots" in note for note in found.notes)

    def test_a_language_without_a_name_is_refused(self, tmp_path):
        plan = plan_of("urscript")
        write_path(tmp_path, plan, rows=2)
        with pytest.raises(PlanningError, match="--language rapid needs --program NAME"):
            compensate(tmp_path, plan, language="rapid")

    def test_no_program_is_written_unasked(self, tmp_path):
        plan = plan_of("urscript")
        write_path(tmp_path, plan, rows=2)
        assert compensate(tmp_path, plan).program == ()
        assert compensate(tmp_path, plan, program="course", language="none").program == ()
        assert not list(tmp_path.glob("course.*"))


def test_the_words_of_the_head_are_those_of_the_language():
    writer = writer_named("urscript")
    assert "movej" in " ".join(plan_program(plan_of("urscript"), writer).motions)
