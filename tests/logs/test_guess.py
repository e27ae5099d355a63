"""What the headings of makers' logs are taken for."""

from pathlib import Path

import pytest
import yaml

import elastocal as ec
from elastocal.logs.streams import _is_named


def guessed(tmp_path, header, row="10;20;30;40;50;60", rows=9):
    path = tmp_path / "arm.csv"
    stamps = (f"2026-11-20T09:14:{second:02d}.250+01:00" for second in range(rows))
    lines = "".join(f"{stamp};{row}\n" for stamp in stamps)
    path.write_text(f"{header}\n{lines}", encoding="utf-8")
    (found,) = ec.guess_map([path]).logs
    return found


MAKERS = {
    "yaskawa": ("S(deg);L(deg);U(deg);R(deg);B(deg);T(deg)", "deg"),
    "yaskawa bare": ("S;L;U;R;B;T", "deg"),
    "yaskawa axes": (";".join(f"{each}-axis [deg]" for each in "SLURBT"), "deg"),
    "hyundai": ("S(deg);H(deg);V(deg);R2(deg);B(deg);R1(deg)", "deg"),
    "abb": ("rax_1;rax_2;rax_3;rax_4;rax_5;rax_6", "deg"),
    "fanuc": ("J1 (deg);J2 (deg);J3 (deg);J4 (deg);J5 (deg);J6 (deg)", "deg"),
    "in German": (";".join(f"J{n} [Grad]" for n in range(1, 7)), "deg"),
    "in French": (";".join(f"J{n} [degrés]" for n in range(1, 7)), "deg"),
    "kawasaki": ("JT1;JT2;JT3;JT4;JT5;JT6", "deg"),
    "staubli": ("jnt1[rad];jnt2[rad];jnt3[rad];jnt4[rad];jnt5[rad];jnt6[rad]", "rad"),
    "denso": ("J1 position;J2 position;J3 position;J4 position;J5 position;J6 position", "deg"),
    "doosan": (";".join(f"actual_joint_position_{n}" for n in range(6)), "deg"),
    "ur": (";".join(f"actual_q_{n}" for n in range(6)), "deg"),
}  # fmt: skip


@pytest.mark.parametrize("maker", MAKERS)
def test_the_axes_of_a_maker_are_found_from_the_base_on(tmp_path, maker):
    header, unit = MAKERS[maker]
    found = guessed(tmp_path, f"timestamp;{header}")
    when, arm = found.columns
    assert (when.key, when.columns, when.unit) == ("time", ("timestamp",), None)
    assert (arm.key, arm.columns, arm.unit) == ("joints", tuple(header.split(";")), unit)
    assert found.unused == ()


def test_axes_that_stand_in_another_order_are_put_in_theirs(tmp_path):
    found = guessed(tmp_path, "Date;B(deg);L(deg);R(deg);S(deg);T(deg);U(deg)")
    assert found.columns[1].columns == ("S(deg)", "L(deg)", "U(deg)", "R(deg)", "B(deg)", "T(deg)")


def test_measured_angles_go_before_aimed_ones(tmp_path):
    both = [*(f"target_q_{n}" for n in range(6)), *(f"actual_q_{n}" for n in range(6))]
    found = guessed(tmp_path, "timestamp;" + ";".join(both), ";".join(["1"] * 12))
    assert found.columns[1].columns == tuple(both[6:])
    assert found.unused == tuple(both[:6])


def test_a_seventh_axis_in_mm_is_the_rail(tmp_path):
    axes = [f"JT{n}[deg]" for n in range(1, 7)]
    found = guessed(tmp_path, ";".join(["t[s]", *axes, "JT7[mm]"]), "1;2;3;4;5;60;1500")
    assert [each.columns for each in found.columns if each.key == "joints"] == [
        ("JT7[mm]",), tuple(axes),
    ]  # fmt: skip


def test_an_external_axis_that_is_not_there_is_left_out(tmp_path):
    axes = [f"rax_{n}" for n in range(1, 7)]
    found = guessed(tmp_path, ";".join(["time", *axes, "eax_a"]), "10;20;30;40;50;60;9E+09")
    assert [each.columns for each in found.columns if each.key == "joints"] == [tuple(axes)]
    assert found.unused == ("eax_a",)


@pytest.mark.parametrize(
    ("axes", "turns", "order"),
    [
        ([f"J{n}" for n in range(1, 7)], ["W", "P", "R"], ("R", "P", "W")),
        (list("SLURBT"), ["Rx", "Ry", "Rz"], ("Rz", "Ry", "Rx")),
    ],
)
def test_angles_about_fixed_axes_become_a_b_c(tmp_path, axes, turns, order):
    header = ";".join(["Timestamp", *axes, "X", "Y", "Z", *turns])
    found = guessed(tmp_path, header, "10;20;30;40;50;60;1500;0;900;179;1;2")
    keys = {each.key: each.columns for each in found.columns}
    assert keys["pose.angles"] == order
    assert keys["pose.position"] == ("X", "Y", "Z")


def test_angles_of_other_conventions_are_not_taken(tmp_path):
    header = ";".join(
        ["Clock", *(f"JT{n}" for n in range(1, 7)), *"XYZ", "O[deg]", "A[deg]", "T[deg]"]
    )
    found = guessed(tmp_path, header, "10;20;30;40;50;60;1500;0;900;1;2;3")
    assert "pose.angles" not in [each.key for each in found.columns]
    assert found.unused == ("Clock", "O[deg]", "A[deg]", "T[deg]")


ARM = "time;J1;J2;J3;J4;J5;J6\n" + "".join(f"{n};10;20;30;40;50;60\n" for n in range(9))


def test_a_point_list_of_spatial_analyzer_with_dates_is_a_marker(tmp_path):
    rows = "".join(f"A, main, p{n}, 1200.5, 3.2, 10.1, 11/24/2026 10:03:0{n}\n" for n in range(9))
    (tmp_path / "points.txt").write_text("// A, main: X, Y, Z in mm\n" + rows)
    (tmp_path / "arm.csv").write_text(ARM)
    _, found = ec.guess_map([tmp_path / "arm.csv", tmp_path / "points.txt"]).logs
    assert {each.key: each.columns for each in found.columns} == {
        "time": ("7",), "markers": ("4", "5", "6"),
    }  # fmt: skip


def test_a_log_of_which_nothing_is_known_is_not_left_out_in_silence(tmp_path):
    (tmp_path / "notes.csv").write_text("word;number\n" + "a;1\n" * 9)
    (tmp_path / "arm.csv").write_text(ARM)
    found = ec.guess_map([tmp_path / "arm.csv", tmp_path / "notes.csv"])
    assert "no column looks like joints, a force or a marker" in dict(found.facts())["notes.csv"]
    assert "- log: notes.csv" in found.text


def test_what_is_not_used_is_listed_in_the_map(tmp_path):
    axes = ";".join(f"J{n}" for n in range(1, 7))
    found = guessed(tmp_path, f"time;{axes};Program;Override", "10;20;30;40;50;60;main;100")
    assert "    # not used: Program, Override" in found.lines()


@pytest.mark.parametrize(
    ("log", "means"),
    [("krc.csv", True), ("day1/krc.csv", True), ("./day1/krc.csv", True), ("../day1/krc.csv", True),
     ("day2/krc.csv", False), ("day?/k*.csv", True)],
)  # fmt: skip
def test_a_log_is_named_by_its_file_or_its_path_from_the_map(tmp_path, log, means):
    assert _is_named(tmp_path / "day1" / "krc.csv", log) is means


@pytest.mark.slow
def test_a_map_names_the_cell_file_from_its_own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cell = ec.init("cells", kind="afp").cell
    (tmp_path / "arm.csv").write_text("time;A1;A2;A3;A4;A5;A6\n" + "1;1;2;3;4;5;6\n" * 9)
    guessed = ec.guess_map("arm.csv", out=Path("maps") / "map.yaml", cell=cell)
    assert yaml.safe_load(guessed.text)["cell"] == "../cells/cell.yaml"
