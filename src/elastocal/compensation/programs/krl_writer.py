"""Programs in KRL, of KUKA controllers: motions in a ``.src`` file, positions in a ``.dat`` file.

Axis positions are for ``PTP``, frames for ``LIN``. A frame carries no status and turn (S and T):
``LIN`` needs none, and which posture a number means depends on the robot (its manuals disagree on
S). The axis positions choose the posture. Nothing here was tried on a real robot.
"""

from collections.abc import Iterator, Sequence
from typing import ClassVar

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.programs.writer import (
    AxisMove,
    Block,
    ProgramWords,
    ProgramWriter,
    Remark,
    RobotProgram,
    Step,
    Stop,
    StraightMove,
    controller_text,
    in_shown_units,
    number,
    plain,
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
_WINDOWS_NAMES = "AUX CON NUL PRN"
"""The controller's disk is a Windows one."""


class KrlWriter(ProgramWriter):
    """Writes KRL for KUKA controllers."""

    language: ClassVar = "krl"
    title: ClassVar = "KRL"
    suffixes: ClassVar = (".src", ".dat")
    # A file name has 24 characters with its suffix; not verified on a controller.
    longest_name: ClassVar = 20
    reserved: ClassVar = frozenset(f"{_KRL_WORDS} {_WINDOWS_NAMES}".split())
    most_external: ClassVar = _EXTERNAL_AXES
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
        src = [*_HEADER, f"DEF {program.name}( )", *(f"; {line}" for line in head), *_INI]
        src.append(f"BAS (#VEL_PTP,{program.axis_percent} )")
        for block in program.blocks:
            src += self._block(block)
        dat = [*_HEADER, f"DEFDAT {program.name}", *_EXT]
        dat += [_declaration(program.robot, target) for target in program.targets]
        return controller_text([*src, "END"]), controller_text([*dat, "ENDDAT"])

    def frame_text(self, T: FloatArray) -> str:
        """Return ``{X …, Y …, Z …, A …, B …, C …}`` in mm and deg."""
        values = zip(_FRAME, _xyzabc(T), strict=True)
        return f"{{{', '.join(f'{key} {number(value, 3)}' for key, value in values)}}}"

    def _block(self, block: Block) -> Iterator[str]:
        lines = [*self._steps(block.steps)]
        if not block.title:
            yield from lines
            return
        yield f";FOLD {block.title}"
        yield from (f"  {line}" for line in lines)
        yield f";ENDFOLD ({block.title})"

    def _steps(self, steps: Sequence[Step]) -> Iterator[str]:
        # A block says its speeds anew: a person may begin in the middle of a program.
        speed: float | None = None
        for step in steps:
            match step:
                case AxisMove():
                    yield f"PTP {step.name}"
                case StraightMove():
                    if step.speed != speed:
                        speed = step.speed
                        yield f"$VEL.CP = {speed:.5f} ; m/s, {1e3 * speed:.4g} mm/s"
                    yield f"LIN {step.name}"
                case Remark():
                    yield from (f"; {line}" for line in self.wrapped(plain(step.text)))
                case Stop():
                    yield from (f"; {line}" for line in self.wrapped(step.reason))
                    # Keeps the interpreter from running ahead of the motion before it.
                    yield from ("WAIT SEC 0", "HALT")


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
