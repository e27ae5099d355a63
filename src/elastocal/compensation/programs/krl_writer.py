"""Programs in KRL, of KUKA controllers: motions in a ``.src`` file, positions in a ``.dat`` file.

Axis positions are for ``PTP``, frames for ``LIN``. A frame carries no status and turn (S and T):
``LIN`` needs none, and which posture a number means depends on the robot (its manuals disagree on
S). The axis positions choose the posture. Nothing here was tried on a real robot.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.programs.writer import (
    AxisMove,
    Mover,
    ProgramWords,
    ProgramWriter,
    RobotProgram,
    Stop,
    StraightMove,
    controller_text,
    in_shown_units,
    number,
)
from elastocal.robot import Robot, xyzabc_from_T

_HEADER = (
    "&ACCESS RVP",
    "&REL 1",
    r"&PARAM TEMPLATE = C:\KRC\Roboter\Template\vorgabe",
    "&PARAM EDITMASK = *",
)
_INI = (
    ";FOLD INI",
    "  ;FOLD BASISTECH INI",
    "    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )",
    "    INTERRUPT ON 3",
    "    BAS (#INITMOV,0 )",
    "  ;ENDFOLD (BASISTECH INI)",
    ";ENDFOLD (INI)",
    "$TOOL = TOOL_DATA[1]",
    "$BASE = BASE_DATA[1]",
)
_EXT = (
    ";FOLD BASISTECH EXT",
    "  EXT BAS (BAS_COMMAND :IN,REAL :IN )",
    ";ENDFOLD (BASISTECH EXT)",
)
_EXTERNAL_AXES = 6
"""E1 to E6 of an E6AXIS."""
_FRAME = ("X", "Y", "Z", "A", "B", "C")
_LENGTHS = ("X", "Y", "Z")
_KRL_WORDS = (
    "AND ANIN ANOUT AXIS B_AND B_EXOR B_NOT B_OR BAS BASE_DATA BOOL BRAKE CASE CHAR CIRC CIRC_REL"
    " CONFIRM CONST CONTINUE DATA DECL DEF DEFAULT DEFDAT DEFFCT DELAY DIGIN DO E6AXIS E6POS ELSE"
    " END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP ENDSWITCH ENDWHILE ENUM EXIT EXOR EXT EXTFCT FALSE"
    " FOR FRAME GLOBAL GOTO HALT IF IMPORT INT INTERRUPT IR_STOPM IS LIN LIN_REL LOOP MAXIMUM"
    " MINIMUM NOT OFF ON OR POS PRIO PTP PTP_REL PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC"
    " SIGNAL SLIN SPLINE SPTP STRUC SWITCH THEN TO TOOL_DATA TRIGGER TRUE UNTIL WAIT WHEN WHILE"
)


class KrlWriter(ProgramWriter):
    """Writes KRL for KUKA controllers."""

    language: ClassVar = "krl"
    title: ClassVar = "KRL"
    suffixes: ClassVar = (".src", ".dat")
    # A file name has 24 characters with its suffix; not verified on a controller.
    longest_name: ClassVar = 20
    reserved: ClassVar = frozenset(_KRL_WORDS.split())
    most_external: ClassVar = _EXTERNAL_AXES
    comment: ClassVar = "; "
    width: ClassVar = 96
    axis_names: ClassVar = ("A", "E")
    words: ClassVar = ProgramWords(
        axis_move="PTP",
        straight_move="LIN",
        stop="HALT",
        start="START",
        slow_mode="T1",
        posture="Frames have no S and T: they are only for LIN.",
    )

    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the ``.src`` and the ``.dat`` file; see `ProgramWriter.texts`."""
        src = [*_HEADER, f"DEF {program.name}( )", *head, *_INI]
        src += [f"BAS (#VEL_PTP,{program.axis_percent} )", *self.body(program)]
        dat = [*_HEADER, f"DEFDAT {program.name}", *_EXT]
        dat += [_declaration(program.robot, target) for target in program.targets]
        return controller_text([*src, "END"]), controller_text([*dat, "ENDDAT"])

    def frame_text(self, T: FloatArray) -> str:
        """Return ``{X …, Y …, Z …, A …, B …, C …}`` in mm and deg."""
        values = zip(_FRAME, _xyzabc(T), strict=True)
        return f"{{{', '.join(f'{key} {number(value, 3)}' for key, value in values)}}}"

    def mover(self, program: RobotProgram) -> Mover:  # noqa: ARG002 - of the protocol
        """Return the writer of a move; see `ProgramWriter.mover`."""
        # Each block sets its speeds, since a person may start in the middle of a program.
        speed: float | None = None

        def lines(move: AxisMove | StraightMove) -> Iterator[str]:
            nonlocal speed
            if isinstance(move, AxisMove):
                yield f"PTP {move.name}"
                return
            if move.speed != speed:
                speed = move.speed
                yield f"$VEL.CP = {speed:.5f} ; m/s, {1e3 * speed:.4g} mm/s"
            yield f"LIN {move.name}"

        return lines

    def halt(self, stop: Stop) -> Iterable[str]:  # noqa: ARG002 - of the protocol
        """Return a HALT that keeps the interpreter from running ahead of the motion before it."""
        return "WAIT SEC 0", "HALT"

    def titled(self, title: str, lines: Sequence[str]) -> Iterable[str]:
        """Return the lines in a fold."""
        return [f";FOLD {title}", *(f"  {line}" for line in lines), f";ENDFOLD ({title})"]


def _declaration(robot: Robot, target: AxisMove | StraightMove) -> str:
    """Return the line that declares a position in the ``.dat`` file."""
    arm, external = in_shown_units(robot, target.q)
    external += [0.0] * (_EXTERNAL_AXES - len(external))
    parts = [(f"E{index}", value) for index, value in enumerate(external, start=1)]
    if isinstance(target, AxisMove):
        kind, parts = "E6AXIS", [*((f"A{i}", v) for i, v in enumerate(arm, start=1)), *parts]
    else:
        kind, parts = "E6POS", [*zip(_FRAME, _xyzabc(target.T_base_tcp), strict=True), *parts]
    # 1e-4 mm for lengths, 1e-5 deg for angles (and 1e-5 mm on a rail).
    texts = (f"{key} {number(value, 4 if key in _LENGTHS else 5)}" for key, value in parts)
    return f"DECL {kind} {target.name}={{{','.join(texts)}}}"


def _xyzabc(T: FloatArray) -> list[float]:
    """Return X, Y, Z in mm and A, B, C in deg."""
    xyzabc = xyzabc_from_T(T)
    return [*(1e3 * xyzabc[:3]).tolist(), *np.degrees(xyzabc[3:]).tolist()]
