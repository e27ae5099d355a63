"""What every controller's program keeps."""

import re
from pathlib import Path

import numpy as np
import pytest

from elastocal.compensation.programs import PROGRAM_READERS
from elastocal.compensation.programs.program import CorrectedPoint
from elastocal.errors import FileAccessError
from elastocal.robot import T_from_xyzabc

KRL = {
    "move.src": """DEF move ( )
BAS (#BASE,1)
PTP XHOME
LIN XP1 ; first contact
LIN XP2 C_DIS
END
""",
    "move.dat": """DEFDAT move
DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 45.0,A6 0.0,E1 0.0}
DECL E6POS XP1={X 900.0,Y 0.0,Z 700.0,A 10.0,B 80.0,C -20.0} ; as taught
DECL E6POS XP2={X 950.0,Y 10.0,Z 700.0,A 10.0,B 80.0,C -20.0}
ENDDAT
""",
}
EXAMPLES = {".src": KRL}
"""A program of each controller: to the axes of a point of HOME, straight to P1 and P2."""


@pytest.fixture(params=EXAMPLES, ids=lambda suffix: suffix.removeprefix("."))
def program(request, tmp_path):
    """Return a program as it was read, and its main file."""
    for name, text in EXAMPLES[request.param].items():
        (tmp_path / name).write_bytes(text.replace("\n", "\r\n").encode())
    (main,) = tmp_path.glob(f"*{request.param}")
    return PROGRAM_READERS[request.param](main), main


def test_every_reader_has_an_example():
    assert set(EXAMPLES) == set(PROGRAM_READERS)


def test_motions_are_in_the_order_of_the_text_and_name_points_that_are_declared(program):
    found, _ = program
    assert [move.straight for move in found.moves] == [False, True, True]
    assert [move.line for move in found.moves] == sorted(move.line for move in found.moves)
    home, *targets = (found.points[move.name] for move in found.moves)
    assert home.by_axes
    assert not any(point.by_axes for point in targets)


def test_points_are_in_si_units(program):
    found, _ = program
    home, first, _ = (found.points[move.name] for move in found.moves)
    expected = np.radians([0.0, -90.0, 90.0, 0.0, 45.0, 0.0])
    np.testing.assert_allclose(home.arm_joints(), expected, atol=1e-12)
    pose = T_from_xyzabc(0.9, 0.0, 0.7, *np.radians([10.0, 80.0, -20.0]))
    np.testing.assert_allclose(first.T_frame_tcp(), pose, atol=1e-12)


def test_external_axes_that_a_point_does_not_give_are_none_not_zero(program):
    found, _ = program
    home, first, _ = (found.points[move.name] for move in found.moves)
    assert home.external_joints((True,)).tolist() == [0.0]
    assert first.external_joints((True,)) is None
    assert first.external_joints(()).shape == (0,)


def test_without_corrections_every_file_is_written_back_to_the_byte(program, tmp_path):
    found, main = program
    (tmp_path / "out").mkdir()
    written = found.write(tmp_path / "out" / main.name, {})
    assert written[0] == tmp_path / "out" / main.name
    for path in written:
        assert path.read_bytes() == (main.parent / path.name).read_bytes()


def test_a_corrected_point_is_read_again_and_the_others_stay(program, tmp_path):
    found, main = program
    (tmp_path / "out").mkdir()
    _, first, second = (move.name for move in found.moves)
    T = found.points[first].T_frame_tcp()
    T[:3, 3] += [1e-3, -2e-3, 5e-4]
    written = found.write(tmp_path / "out" / main.name, {first: CorrectedPoint(np.zeros(6), T)})
    again = PROGRAM_READERS[main.suffix](written[0])
    np.testing.assert_allclose(again.points[first].T_frame_tcp(), T, atol=1e-7)
    np.testing.assert_array_equal(
        again.points[second].T_frame_tcp(), found.points[second].T_frame_tcp()
    )


def test_a_point_by_axes_takes_the_corrected_joints(program, tmp_path):
    found, main = program
    (tmp_path / "out").mkdir()
    home = found.moves[0].name
    q = found.points[home].arm_joints() + 1e-3
    written = found.write(tmp_path / "out" / main.name, {home: CorrectedPoint(q, np.eye(4))})
    again = PROGRAM_READERS[main.suffix](written[0])
    np.testing.assert_allclose(again.points[home].arm_joints(), q, atol=1e-7)


def test_notes_name_the_motions_whose_posture_was_assumed(program):
    found, main = program
    notes = found.notes(("line 4, to P1",), main, frame_given=False)
    assert any("line 4, to P1" in note for note in notes)
    assert not any("line 4" in note for note in found.notes((), main, frame_given=True))


def test_a_file_that_is_not_there_is_refused_by_name(program):
    _, main = program
    missing = Path(main).with_name(f"other{main.suffix}")
    with pytest.raises(FileAccessError, match=re.escape("other")):
        PROGRAM_READERS[main.suffix](missing)
