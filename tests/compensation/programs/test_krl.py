"""KUKA programs: what comes back byte for byte, what is corrected, what is refused by line."""

import re

import numpy as np
import pytest

from elastocal.compensation.offline import CorrectionSettings, correct_rows
from elastocal.compensation.programs import compensate_program
from elastocal.errors import FileAccessError, PathError
from elastocal.robot import Robot, T_from_xyzabc, xyzabc_from_T
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.sim.arm.measurement import START
from support import krl
from support.cells import robot
from support.paths import FORCE_TCP, calibrated, dome_course, made_up
from support.urdfs import KR_LIKE, opw_arm_urdf

COURSE = dome_course(4)
BASE = T_from_xyzabc(0.8, -0.1, 0.2, 0.3, 0.0, 0.1)
"""Frame of the program's points."""
EXTERNAL = ",".join(f"E{number} 0.0" for number in range(1, 7))


def posture() -> np.ndarray:
    solver = inverse_for(robot())
    return joints_along_path(solver, COURSE[:1], np.zeros((1, 0)), np.array(START), str)[0]


def position(name: str, T: np.ndarray, base: np.ndarray) -> str:
    pose = xyzabc_from_T(np.linalg.inv(base) @ T) * np.array([1e3] * 3 + [180.0 / np.pi] * 3)
    parts = ",".join(f"{key} {value:.6f}" for key, value in zip("XYZABC", pose, strict=True))
    return f"DECL E6POS {name}={{{parts},{EXTERNAL}}}"


SRC = [
    *krl.HEADER,
    "DEF course( )",
    "; by the cell's programmer: \xe4\x85 %",
    "BAS (#INITMOV,0 )",
    "$TOOL = TOOL_DATA[1]",
    "$BASE = BASE_DATA[1]",
    "PTP XHOME",
    "LASER_ON( )",
    "$VEL.CP = 0.05 ; m/s",
    "LIN XP1 C_DIS",
    "  LIN Xp2 C_DIS ; small letters are the same",
    "SLIN XP3 WITH $VEL.CP=0.1",
    "LIN XP4",
    "PTP XHOME",
    "END",
]


def dat(base: np.ndarray = BASE) -> list[str]:
    axes = ",".join(f"A{i} {v:.6f}" for i, v in enumerate(np.degrees(posture()), start=1))
    return [
        *krl.HEADER,
        "DEFDAT course",
        "EXT BAS (BAS_COMMAND :IN,REAL :IN )",
        f"DECL E6AXIS XHOME={{{axes},{EXTERNAL}}}",
        *(position(f"XP{i}", T, base) for i, T in enumerate(COURSE, start=1)),
        "DECL REAL DEPTH=1.5 ; not ours",
        "ENDDAT",
    ]


FORCES = "point,force_tcp_x[N],force_tcp_y[N],force_tcp_z[N],note\n" + "".join(
    f"XP{i},{FORCE_TCP[0]},{FORCE_TCP[1]},{FORCE_TCP[2]},a\n" for i in range(1, 5)
)


@pytest.fixture
def program(tmp_path):
    """Return a function that writes a program and corrects it; without changes: the one above."""

    def run(src=SRC, data=None, forces=FORCES, base=BASE, settings=None):
        data = dat(base) if data is None else data
        for name, lines in (("course.src", src), ("course.dat", data)):
            (tmp_path / name).write_bytes("".join(f"{x}\r\n" for x in lines).encode("latin-1"))
        (tmp_path / "forces.csv").write_text(forces)
        (tmp_path / "out").mkdir(exist_ok=True)
        out = tmp_path / "out" / "course.src"
        return compensate_program(
            calibrated(), tmp_path / "course.src", tmp_path / "forces.csv", out, settings, base
        )

    return run


def declared(path, name: str) -> krl.Position:
    (line,) = [
        line for line in path.read_bytes().decode("latin-1").split("\r\n") if f" {name}=" in line
    ]
    values = dict(part.split(" ") for part in line.split("{")[1].rstrip("}").split(","))
    return krl.Position(line.split()[1], {key: float(value) for key, value in values.items()})


def changed(old: str, new: str, lines: list[str]) -> list[str]:
    assert any(old in line for line in lines)
    return [line.replace(old, new) for line in lines]


def test_points_are_corrected_in_the_programs_frame_to_a_tenth_of_a_micrometre(program):
    result = program()
    solver = inverse_for(robot())
    q = joints_along_path(solver, COURSE, np.zeros((4, 0)), posture(), str)
    load = (COURSE[:, :3, :3] @ FORCE_TCP, None)
    expected = correct_rows(solver, calibrated(), q, COURSE, load, str, may_turn=True)
    shift = np.linalg.norm(expected.T_base_tcp[:, :3, 3] - COURSE[:, :3, 3], axis=1)
    assert shift.min() > 1e-3
    for row in range(4):
        found = BASE @ declared(result.files[1], f"XP{row + 1}").T
        gap = np.linalg.norm(found[:3, 3] - expected.T_base_tcp[row, :3, 3])
        assert gap < 1e-7
        np.testing.assert_allclose(found[:3, :3], COURSE[row, :3, :3], atol=1e-7)
    assert result.summary.rows == 4
    read = result.program
    assert (read.base, read.tool, read.name) == ("BASE_DATA[1]", "TOOL_DATA[1]", "course")


def test_everything_but_the_corrected_numbers_is_the_same_to_the_byte(program, tmp_path):
    src, data = program().files
    assert src.read_bytes() == (tmp_path / "course.src").read_bytes()
    before = (tmp_path / "course.dat").read_bytes().split(b"\r\n")
    after = data.read_bytes().split(b"\r\n")
    different = [new for old, new in zip(before, after, strict=True) if old != new]
    assert len(different) == 4
    for old, new in zip(before, after, strict=True):
        assert old.split(b",A ")[-1] == new.split(b",A ")[-1]
        assert old.split(b"X ")[0] == new.split(b"X ")[0]


def test_a_corrected_program_is_read_again(program, tmp_path):
    first = program().files[1].read_bytes().decode("latin-1").split("\r\n")[:-1]
    again = program(data=first).files[1]
    moved = declared(again, "XP1").T[:3, 3] - declared(tmp_path / "course.dat", "XP1").T[:3, 3]
    assert np.linalg.norm(moved) > 1e-3


def test_axis_positions_with_a_force_are_corrected_by_their_joints(program):
    forces = FORCES.replace("XP1,", "XHOME,", 1) + FORCES.splitlines()[1] + "\n"
    result = program(forces=forces)
    found = np.radians(declared(result.files[1], "XHOME").arm)
    force = robot().forward(posture())[:3, :3] @ FORCE_TCP
    model = calibrated()
    loaded = robot().forward(found)[:3, 3] + model.model.deflection(model.compliance, found, force)
    np.testing.assert_allclose(loaded, COURSE[0, :3, 3], atol=2e-7)


def test_inline_forms_of_the_pendant_are_understood(program):
    src = [line for line in SRC if not line.startswith("$TOOL") and not line.startswith("$BASE")]
    src = changed("LIN XP1 C_DIS", "FDAT_ACT=FP1\r\nLIN XP1 C_DIS", src)
    data = dat()
    data.insert(-1, 'DECL FDAT FP1={TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE,POINT2[] " "}')
    assert program(src, data).program.base == "BASE_DATA[2]"


def test_a_frame_without_posture_needs_one(program):
    src = [line for line in SRC if line != "PTP XHOME"]
    with pytest.raises(PathError, match=r"line 12, LIN XP1: nothing says in which posture"):
        program(src)
    assert program(src, settings=CorrectionSettings(start=posture())).summary.rows == 4


def test_axis_values_in_the_motion_itself_tell_the_posture(program):
    values = ", ".join(f"A{i} {v:.6f}" for i, v in enumerate(np.degrees(posture()), start=1))
    expected = program()
    corrected = expected.files[1].read_bytes()
    found = program(changed("PTP XHOME", f"PTP {{E6AXIS: {values}}} C_PTP", SRC))
    assert found.files[1].read_bytes() == corrected
    assert found.assumed == expected.assumed == ()


def test_a_motion_after_a_ptp_that_tells_no_posture_is_named(program):
    src = changed("LIN XP4", "PTP XELSEWHERE\r\nLIN XP4", SRC)
    assert program(src).assumed == ("line 17, LIN XP4",)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("LIN XP4", "LIN {X 1.0,Y 2.0,Z 3.0}", "line 16: LIN '{X 1.0,Y 2.0,Z 3.0}' does not go"),
        ("LIN XP4", "LIN XP4:XP1", "line 16: LIN 'XP4:XP1' does not go"),
        ("LIN XP4", "CIRC XP3, XP4", "line 16: CIRC cannot be corrected"),
        ("LIN XP4", "LIN_REL {Z 5.0}", "line 16: LIN_REL cannot be corrected"),
        ("LIN XP4", "XP4.Z = XP4.Z + DEPTH\r\nLIN XP4", "line 16: the program changes XP4"),
        ("LIN XP4", "$BASE = BASE_DATA[2]\r\nLIN XP4", "line 17: this motion is in $BASE = BASE_D"),
        ("LIN XP4", "$BASE.Z = 5.0\r\nLIN XP4", "line 16: '$BASE.Z = 5.0' moves the frame"),
        ("LIN XP4", "$IPO_MODE=#TCP\r\nLIN XP4", "line 16: '$IPO_MODE=#TCP' moves the frame"),
        ("LIN XP4", "FDAT_ACT=FP9\r\nLIN XP4", "line 16: FP9 is not declared"),
        ("LIN XP4", "LIN XP5", "line 16: LIN XP5 goes to a point that the .dat file does not"),
        ("LIN XP4", "LIN XHOME", "line 16: LIN XHOME goes to axis positions"),
        ("LIN XP4", "LIN XP3", "no motion goes to point 'XP4'"),
    ],
)
def test_a_line_that_is_not_understood_is_refused(program, tmp_path, old, new, why):
    with pytest.raises(PathError) as refusal:
        program(changed(old, new, SRC))
    assert str(refusal.value).startswith(f"{tmp_path / 'course.src'}: {why}")
    assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("DECL E6POS XP2={X", "DECL E6POS XP2={X X", "line 9: XP2 has a component"),
        ("DECL E6POS XP2=", "DECL E6POS XP1=", "line 9: XP1 is declared twice"),
        (",A ", ",Q ", "has no A"),
        ("{X ", "{X 1.0,X ", "has X twice"),
        ("{X ", "{X " + 400 * "9", "and a finite number"),
        ("DECL REAL DEPTH=1.5", "DECL FDAT FP1={TOOL_NO 1,BASE_NO 2,IPO_FRAME #TCP}", "FP1"),
    ],
)
def test_a_declaration_that_is_not_understood_is_refused(program, old, new, why):
    with pytest.raises(PathError) as refusal:
        program(data=changed(old, new, dat()))
    assert why in str(refusal.value)


def test_a_point_without_force_is_refused_by_line(program):
    with pytest.raises(PathError, match=r"line 16: LIN XP4 has no force in .*forces\.csv"):
        program(forces="\n".join(FORCES.splitlines()[:-1]) + "\n")


@pytest.mark.parametrize(
    ("forces", "why"),
    [
        ("point\nXP1\n", "no forces"),
        (FORCES.replace("point", "name"), "one column 'point'"),
        (FORCES + FORCES.splitlines()[1], "row 6: point 'XP1' stands twice"),
        (FORCES.replace("150.0", "nan"), "row 2, column 'force_tcp_x[N]': 'nan'"),
    ],
)
def test_a_table_of_forces_that_is_none_is_refused(program, forces, why):
    with pytest.raises(PathError) as refusal:
        program(forces=forces)
    assert why in str(refusal.value)
    assert "forces.csv" in str(refusal.value)


def test_a_point_out_of_reach_is_refused_by_line(program):
    data = dat()
    place = next(i for i, line in enumerate(data) if "XP3" in line)
    data[place] = data[place].replace("{X ", "{X 9")
    with pytest.raises(PathError, match=r"line 15, SLIN XP3: no posture of arm reaches"):
        program(data=data)


def test_one_point_in_two_postures_is_refused(program):
    other = np.degrees(posture()) * [1, 1, 1, 1, -1, 1] + [0, 0, 0, 180.0, 0, 180.0]
    other = (other + 180.0) % 360.0 - 180.0
    axes = ",".join(f"A{i} {v:.6f}" for i, v in enumerate(other, start=1))
    data = [*dat()[:-1], f"DECL E6AXIS XOTHER={{{axes},{EXTERNAL}}}", "ENDDAT"]
    src = changed("LIN XP4", "LIN XP4\r\nPTP XOTHER\r\nLIN XP1", SRC)
    with pytest.raises(PathError, match="line 18, LIN XP1: is reached in another posture"):
        program(src, data)


def test_a_program_without_its_dat_file_is_refused(tmp_path):
    (tmp_path / "a.src").write_text("DEF a( )\nEND\n")
    with pytest.raises(FileAccessError, match="must be beside"):
        compensate_program(calibrated(), tmp_path / "a.src", tmp_path / "f.csv", tmp_path / "b.src")


def test_the_rail_stands_where_e1_has_it_else_where_it_stood(tmp_path):
    arm = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, rail=(-2.0, 2.0)), "tcp")
    q = np.array([[0.5, 0.1, 0.6, 0.9, 0.2, 0.8, 0.0], [0.7, 0.1, 0.6, 0.9, 0.2, 0.8, 0.0]])
    names = ("X", "Y", "Z", "A", "B", "C")
    poses = xyzabc_from_T(arm.forward(q)) * np.array([1e3] * 3 + [180.0 / np.pi] * 3)
    values = [",".join(f"{k} {v:.6f}" for k, v in zip(names, pose, strict=True)) for pose in poses]
    axes = ",".join(f"A{i} {v:.6f}" for i, v in enumerate(np.degrees(q[0, 1:]), start=1))
    data = [
        f"DECL E6AXIS XAPP={{{axes},E1 500.0}}",
        f"DECL FRAME XP1={{{values[0]}}}",
        f"DECL E6POS XP2={{{values[1]},S 2,T 10,E1 700.0,E2 0.0}}",
    ]
    (tmp_path / "a.src").write_text("PTP XAPP\nLIN XP1\nLIN XP2\n")
    (tmp_path / "a.dat").write_text("\n".join(data) + "\n")
    (tmp_path / "f.csv").write_text(
        "point,force_x[N],force_y[N],force_z[N]\nXP1,0,300,900\nxp2,0,300,900\n"
    )
    model = made_up(arm)
    out = tmp_path / "b.src"
    compensate_program(model, tmp_path / "a.src", tmp_path / "f.csv", out)
    load = (np.tile([0.0, 300.0, 900.0], (2, 1)), None)
    expected = correct_rows(inverse_for(arm), model, q, arm.forward(q), load, str)
    for row, name in enumerate(("XP1", "XP2")):
        (line,) = [line for line in (tmp_path / "b.dat").read_text().splitlines() if name in line]
        found = [float(re.search(rf"\b{key} (\S+?),", line)[1]) / 1e3 for key in "XYZ"]
        np.testing.assert_allclose(found, expected.T_base_tcp[row, :3, 3], atol=2e-7)
    assert "S 2,T 10,E1 700.0,E2 0.0}" in (tmp_path / "b.dat").read_text()
