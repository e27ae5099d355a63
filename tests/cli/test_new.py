"""`elastocal new`: a cell file that `check` passes, by options or by answers; and its preview."""

import io
import json
import sys
from pathlib import Path
from unittest import mock

import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import binary_stl, block_mesh, dome_section
from elastocal.cli.questions import answered
from elastocal.robot import catalogue
from elastocal.workflows import NewSettings
from support.cli import elastocal


@pytest.fixture
def dome(tmp_path) -> Path:
    path = tmp_path / "parts of today" / "dome.stl"
    path.parent.mkdir()
    path.write_bytes(binary_stl(dome_section()))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["KR 300 R2700-2", "UR20", "RX160", "R-2000iC/210F"])
def test_a_robot_and_a_mesh_make_a_cell_that_check_passes(tmp_path, dome, robot):
    cell = tmp_path / "cell.yaml"
    begun = elastocal("new", "--robot", robot, "--mesh", dome, "-o", cell)
    assert begun.code == 0, begun.err
    assert elastocal("check", cell).code == 0
    assert load_cell(cell).surface_path.samefile(dome)
    assert not [line for line in cell.read_text().splitlines() if line.endswith(" ")]


def test_a_foreign_urdf_is_taken_by_its_flange_and_metres_by_their_size(tmp_path):
    urdf = catalogue.urdf("IRB 6700-200/2.60").replace('"flange"', '"tool0"')
    (tmp_path / "abb.urdf").write_text(urdf)
    (tmp_path / "block.stl").write_bytes(binary_stl(block_mesh() / 1e3))
    cell = tmp_path / "cell.yaml"
    begun = elastocal(
        *("new", "--robot", tmp_path / "abb.urdf", "--mesh", tmp_path / "block.stl"),
        *("-o", cell, "--press", "800 N", "--tracker", "none"),
    )
    assert begun.code == 0, begun.err
    file = load_cell(cell).file
    assert (file.robot.flange, file.surface.unit, file.trackers) == ("tool0", "m", ())
    assert file.load_cases.fz == 800.0


@pytest.fixture
def staeubli(tmp_path) -> Path:
    """An RX160 with the frames of ROS-Industrial: x out of `flange`, z out of `tool0`."""
    urdf = catalogue.urdf("RX160").replace('"flange"', '"tool0"')
    twin = '<link name="flange"/><joint name="beside" type="fixed"><parent link="link_6"/>'
    path = tmp_path / "rx160.urdf"
    path.write_text(urdf.replace("</robot>", f'{twin}<child link="flange"/></joint></robot>'))
    return path


def test_of_two_flanges_the_one_whose_z_points_out_of_the_arm_carries_the_tool(
    tmp_path, dome, staeubli
):
    cell = tmp_path / "cell.yaml"
    facts = json.loads(elastocal("check", staeubli, "--json").out)
    assert facts["tcp"] == "tool0"
    assert facts["z_of_tcp"] == "out of the arm, along joint_6"
    assert facts["inverse_kinematics"] == "closed form of arms with a spherical wrist"
    assert elastocal("new", "--robot", staeubli, "--mesh", dome, "-o", cell).code == 0
    assert load_cell(cell).file.robot.flange == "tool0"
    known = ("new", "--robot", staeubli, "--mesh", dome, "-o", cell, "--force")
    asked = elastocal(*known, "--flange", "flange").err
    assert "points 90 deg off" in asked
    assert "robot.flange is 'tool0'" in asked


def test_a_mesh_that_the_arm_can_only_work_on_in_inches_is_in_inches(tmp_path):
    small, cell = block_mesh() * 0.5 / 25.4, tmp_path / "cell.yaml"
    (tmp_path / "block.stl").write_bytes(binary_stl(small))
    begun = elastocal("new", "--robot", "UR20", "--mesh", tmp_path / "block.stl", "-o", cell)
    assert begun.code == 0, begun.err
    assert load_cell(cell).file.surface.unit == "in"


def test_what_run_would_refuse_of_the_forces_is_found_by_check(tmp_path, dome):
    cell = tmp_path / "made on the way" / "cell.yaml"
    begun = elastocal("new", "--robot", "UR20", "--mesh", dome, "-o", cell, "--press", "40 N")
    assert begun.code == 0, begun.err
    assert "no run can begin" not in begun.err
    cell.write_text(cell.read_text().replace('contact_force: "10 N"', 'contact_force: "60 N"'))
    *_, found = json.loads(elastocal("check", cell, "--json").out)["findings"]
    assert found.startswith("no run can begin: procedure.contact_force must be below 18 N")


def test_presses_that_the_joints_do_not_bear_are_said_with_those_that_they_do(tmp_path, dome):
    cell = tmp_path / "cell.yaml"
    known = ("new", "--robot", "RX160", "--mesh", dome, "--tracker", "none", "-o", cell)
    begun = elastocal(*known, "--press", "3 kN")
    assert "the joints bear the load cases at 0 of" in begun.err
    fits = begun.err.partition("they bear a press of ")[2].partition(" N")[0]
    assert 100.0 < float(fits) < 1500.0
    assert "the joints bear" not in elastocal(*known, "--force", "--press", f"{fits} N").err


def test_a_refusal_leaves_no_folder(tmp_path, dome):
    out = tmp_path / "a" / "b" / "cell.yaml"
    assert "--robot is missing" in elastocal("new", "--mesh", dome, "-o", out, "--no-ask").reason
    assert not (tmp_path / "a").exists()


def test_presses_follow_the_process_and_poses_are_chosen_for_it(tmp_path, dome):
    cell, path = tmp_path / "cell.yaml", tmp_path / "path.csv"
    path.write_text(
        "x[mm],y[mm],z[mm],a[deg],b[deg],c[deg],force_tcp_x[N],force_tcp_y[N],force_tcp_z[N]\n"
        "700,0,400,0,0,180,15,0,-60\n"
    )
    begun = elastocal(
        *("new", "--robot", "UR20", "--mesh", dome, "-o", cell, "--process", path),
        *("--tolerance", "0.2 mm"),
    )
    assert begun.code == 0, begun.err
    known = load_cell(cell)
    assert (known.technique, known.file.load_cases.fz) == ("i_optimal", 63.0)
    assert known.file.acceptance.tolerance == 0.2e-3


def test_no_file_is_replaced_and_none_is_left_behind_by_a_refusal(tmp_path, dome):
    cell = tmp_path / "cell.yaml"
    cell.write_text("mine")
    known = ("new", "--robot", "UR20", "--mesh", dome, "-o")
    assert "--force" in elastocal(*known, cell).reason
    assert cell.read_text() == "mine"
    far = elastocal(*known, tmp_path / "far.yaml", "--place", "9 m, 0 m, 0 m, 0 deg, 0 deg, 0 deg")
    assert "no cell that check passes" in far.reason
    assert {each.name for each in tmp_path.iterdir()} == {"cell.yaml", dome.parent.name}
    assert elastocal(*known, cell, "--force").code == 0


def test_a_number_without_a_unit_is_named_with_its_option(tmp_path, dome):
    tcp = ("--tcp", "0, 0 mm, 200 mm, 0 deg, 0 deg, 0 deg")
    found = elastocal("new", "--robot", "UR20", "--mesh", dome, *tcp, "-o", tmp_path / "cell.yaml")
    assert found.code == 1
    assert "--tcp '0, 0 mm, 200 mm, 0 deg, 0 deg, 0 deg': " in found.reason


def test_what_is_missing_is_named(tmp_path, dome):
    out = tmp_path / "cell.yaml"
    assert "--robot is missing" in elastocal("new", "--mesh", dome, "-o", out).reason
    assert "--mesh is missing" in elastocal("new", "--robot", "UR20", "-o", out).reason
    assert "'UR20'" in elastocal("new", "--robot", "UR 2", "--mesh", dome, "-o", out).reason


def test_questions_are_asked_again_until_they_are_answered(tmp_path, dome):
    cell = tmp_path / "cell.yaml"
    rail = ["sideways, 1 m, 2 m", "y, 1 m, -1 m", "y, -1 m, 1 m"]
    answers = [
        "UR 2",
        "UR10e",
        *rail[:1],
        "back",
        "UR20",
        *rail[1:],
        "none.stl",
        "",
        str(dome),
        "um",
        *[""] * 6,
        "80 kg",
        "80 N",
        "none",
        *[""] * 3,
    ]
    with mock.patch.object(sys, "stdin", io.StringIO("\n".join([*answers, ""]))):
        begun = elastocal("new", "-o", cell, "--ask")
    assert begun.code == 0, begun.err
    for complaint in (
        "no robot 'UR 2'",
        "none.stl",
        "nothing is offered here: an answer is needed",
        "its numbers taken for um: another unit is meant",
        "unit 'kg' is not a force",
        "must be x, y or z of base",
        "the first end of the travel must be the smaller",
    ):
        assert complaint in begun.err
    found = load_cell(cell)
    file = found.file
    assert (file.robot.model, file.load_cases.fz, file.sensor) == ("UR20", 80.0, None)
    assert (file.robot.rail.axis, file.robot.rail.travel) == ((0.0, 1.0, 0.0), (-1.0, 1.0))
    assert found.robot.joint_names[0] == "rail"
    assert found.home[0] == 0.0


def test_another_robot_forgets_the_link_that_was_answered_for_the_first(tmp_path):
    for name in ("UR10e", "UR20"):
        urdf = catalogue.urdf(name).replace('"flange"', f'"hand of {name}"')
        (tmp_path / f"{name}.urdf").write_text(urdf)
    answers = [str(tmp_path / "UR10e.urdf"), "link_3", "back", "back", str(tmp_path / "UR20.urdf")]
    for more, flange in ((["", "skip"], "hand of UR20"), (["back", "UR20", "skip"], None)):
        with mock.patch.object(sys, "stdin", io.StringIO("\n".join([*answers, *more, ""]))):
            found = answered(NewSettings())
        assert found.flange == flange
    given = NewSettings(flange="link_3")
    with mock.patch.object(sys, "stdin", io.StringIO("UR10e\nback\nUR20\nskip\n")):
        assert answered(given).flange == "link_3"


def test_questions_that_nobody_answers_end_in_a_refusal(tmp_path):
    with mock.patch.object(sys, "stdin", io.StringIO("")):
        begun = elastocal("new", "-o", tmp_path / "cell.yaml", "--ask")
    assert begun.code == 1
    assert begun.err.splitlines()[-1].startswith("elastocal: nobody answers: standard input has")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_at_a_question_is_an_interruption(tmp_path):
    keyboard = io.StringIO()
    keyboard.readline = mock.Mock(side_effect=KeyboardInterrupt)
    with mock.patch.object(sys, "stdin", keyboard):
        assert elastocal("new", "-o", tmp_path / "cell.yaml", "--ask").code == 130


def test_a_preview_shows_a_cell_and_replaces_only_its_own_page(tmp_path, dome):
    cell, page = tmp_path / "cell.yaml", tmp_path / "look here.html"
    assert elastocal("new", "--robot", "UR20", "--mesh", dome, "-o", cell).code == 0
    for _ in range(2):
        shown = elastocal("check", cell, "--preview", page)
        assert shown.code == 0, shown.err
    assert "a first look" in page.read_text(encoding="utf-8")
    page.write_text("mine")
    assert "look here.html" in elastocal("check", cell, "--preview", page).reason
    assert page.read_text() == "mine"
    robot = tmp_path / "arm.urdf"
    robot.write_text(catalogue.urdf("UR20"))
    assert "a preview is of a cell" in elastocal("check", robot, "--preview", "p.html").reason
