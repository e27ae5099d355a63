r"""Programs in RAPID, of ABB controllers (IRC5, OmniCore): one module ``.mod``.

Axis positions are ``jointtarget``, frames ``robtarget`` with quaternions. Configurations are not
monitored (``ConfL\Off``): a straight move goes on in the posture in which it begins, and the four
numbers of each ``robtarget`` say nothing. Nothing here was tried on a real robot.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

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
from elastocal.robot import Robot

_EXTERNAL_AXES = 6
"""eax_a to eax_f of an extjoint."""
_NOT_THERE = "9E+09"
"""An external axis that the robot has not."""
_AXES_SPEED = "vAxes"
_AXES_TCP = 100.0
"""Fastest motion of the tcp while axes move, in mm/s: RAPID states no part of axis speeds."""
_AXES_TURN = 10.0
"""The same for its orientation and for external axes that turn, in deg/s."""
_LOAD = "[-1,[0,0,0],[1,0,0,0],0,0,0]"
_RAPID_WORDS = (
    "ALIAS AND BACKWARD BOOL CASE CONNECT CONST DEFAULT DIV DO ELSE ELSEIF ENDFOR ENDFUNC ENDIF"
    " ENDMODULE ENDPROC ENDRECORD ENDTEST ENDTRAP ENDWHILE ERROR EXIT FALSE FINE FOR FROM FUNC"
    " GOTO IF INOUT JOINTTARGET LOCAL MAIN MOD MODULE MOVEABSJ MOVEJ MOVEL NOSTEPIN NOT NOVIEW NUM"
    " OR PERS PROC RAISE READONLY RECORD RETRY RETURN ROBTARGET SPEEDDATA STEP STOP STRING"
    " SYSMODULE TASK TCALIB TEST THEN TO TOOL0 TOOLDATA TRAP TRUE TRYNEXT UNDO USER VAR VAXES"
    " VIEWONLY WCALIB WHILE WITH WOBJ0 WOBJDATA XOR"
)


class RapidWriter(ProgramWriter):
    """Writes RAPID for ABB controllers."""

    language: ClassVar = "rapid"
    title: ClassVar = "RAPID"
    suffixes: ClassVar = (".mod",)
    # 32 characters with the M_ of the module; not verified on a controller.
    longest_name: ClassVar = 30
    reserved: ClassVar = frozenset(_RAPID_WORDS.split())
    most_external: ClassVar = _EXTERNAL_AXES
    comment: ClassVar = "! "
    width: ClassVar = 96
    axis_names: ClassVar = ("axis ", "eax ")
    words: ClassVar = ProgramWords(
        axis_move="MoveAbsJ",
        straight_move="MoveL",
        stop="Stop",
        start="Start",
        slow_mode="manual reduced speed",
        posture="Configurations are not monitored (ConfL\\Off): MoveL keeps the posture.",
    )

    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the module; see `ProgramWriter.texts`."""
        _, T_parent_tcp = program.tool()
        lines = [
            *("%%%", "  VERSION:1", "  LANGUAGE:ENGLISH", "%%%", ""),
            f"MODULE M_{program.name}",
            *(f"  {line}" for line in head),
            f"  PERS tooldata tCalib := [TRUE,{_pose(T_parent_tcp)},{_LOAD}];",
            f'  PERS wobjdata wCalib := [FALSE,TRUE,"",{_pose(np.eye(4))},{_pose(np.eye(4))}];',
            *(f"  {line}" for line in self._speeds(program)),
            *(
                f"  {line}"
                for move in program.targets
                for line in _declaration(program.robot, move)
            ),
            f"  PROC {program.name}()",
            *("    ConfJ\\Off;", "    ConfL\\Off;"),
            *(f"    {line}" for line in self.body(program)),
        ]
        return (controller_text([*lines, "  ENDPROC", "ENDMODULE"]),)

    def frame_text(self, T: FloatArray) -> str:
        """Return ``[[x,y,z],[q1,q2,q3,q4]]`` in mm, scalar first."""
        return _pose(T)

    def axis_speed_text(self, robot: Robot, percent: int) -> str:  # noqa: ARG002 - of the protocol
        """Return the speed of the tcp: RAPID has no percentage of the axes'."""
        return (
            f"so that the tcp goes at most {_AXES_TCP:.0f} mm/s and {_AXES_TURN:.0f} deg/s (the"
            f" times are estimated for {percent} percent of the axes' speeds)"
        )

    def _speeds(self, program: RobotProgram) -> Iterator[str]:
        axes = ",".join(number(v, 1) for v in (_AXES_TCP, _AXES_TURN, _AXES_TCP, _AXES_TURN))
        yield f"CONST speeddata {_AXES_SPEED} := [{axes}];"
        for name, speed in _speed_names(program).items():
            # A rail and a turntable keep up with the tool, whatever it does.
            yield f"CONST speeddata {name} := [{number(1e3 * speed, 3)},{_AXES_TURN},5000,1000];"

    def mover(self, program: RobotProgram) -> Mover:  # noqa: ARG002 - of the protocol
        """Return the writer of a move; see `ProgramWriter.mover`."""

        def lines(move: AxisMove | StraightMove) -> Iterator[str]:
            if isinstance(move, AxisMove):
                order = f"MoveAbsJ {move.name},{_AXES_SPEED}"
            else:
                order = f"MoveL {move.name},{_speed_name(move.speed)}"
            yield f"{order},fine,tCalib\\WObj:=wCalib;"

        return lines

    def halt(self, stop: Stop) -> Iterable[str]:  # noqa: ARG002 - of the protocol
        """Return a Stop."""
        return ("Stop;",)


def _speed_name(speed: float) -> str:
    """Return the name of a speed, in µm/s, which is distinct for each speed as written.

    >>> _speed_name(0.02)
    'vUm20000'
    """
    return f"vUm{round(1e6 * speed)}"


def _speed_names(program: RobotProgram) -> dict[str, float]:
    steps = (step for block in program.blocks for step in block.steps)
    return {_speed_name(s.speed): s.speed for s in steps if isinstance(s, StraightMove)}


def _declaration(robot: Robot, target: AxisMove | StraightMove) -> Iterator[str]:
    """Yield the lines that declare a position: 1e-4 mm, 1e-5 deg, quaternions to 1e-8."""
    arm, external = in_shown_units(robot, target.q)
    rest = [_NOT_THERE] * (_EXTERNAL_AXES - len(external))
    extra = f"[{','.join([number(value, 5) for value in external] + rest)}]"
    if isinstance(target, AxisMove):
        axes = ",".join(number(value, 5) for value in arm)
        yield f"CONST jointtarget {target.name} := [[{axes}],"
        yield f"  {extra}];"
    else:
        yield f"CONST robtarget {target.name} := [{_pose(target.T_base_tcp)[1:-1]},[0,0,0,0],"
        yield f"  {extra}];"


def _pose(T: FloatArray) -> str:
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    place = ",".join(number(1e3 * value, 4) for value in T[:3, 3])
    return f"[[{place}],[{','.join(number(value, 8) for value in (w, x, y, z))}]]"
