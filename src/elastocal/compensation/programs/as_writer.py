"""Programs in the AS language, of Kawasaki controllers: one file ``.as``.

All positions are joints, those of straight moves too: ``#PPOINT`` leaves neither the posture nor
the frame open, and has the external axes behind the six of the arm. Nothing here was tried on a
real robot.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import ClassVar

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

_AS_WORDS = (
    "ABORT ABS ACCEL ACCURACY ALIGN ALWAYS AND BASE BREAK CALL CASE CLAMP CLOSE CONTINUE CP"
    " DECEL DELAY DEPART DO DRAW DRIVE ELSE END EXECUTE FALSE FOR FRAME FTOOL GOTO HALT HERE"
    " HOME IF JAPPRO JDEPART JMOVE LAPPRO LDEPART LMOVE MOD NOT NULL OFF ON OPEN OR PAUSE"
    " POINT PROGRAM RETURN RUN SCASE SET SHIFT SIGNAL SPEED STABLE STEP STOP SWAIT SWITCH"
    " TDRAW THEN TIMER TO TOOL TRANS TRUE TWAIT UNTIL VALUE WAIT WHERE WHILE XOR"
)
_STRAIGHT_UP = 1e-9
"""Sine of angle A below which only the sum of O and T is determined."""


class AsWriter(ProgramWriter):
    """Writes the AS language for Kawasaki controllers."""

    language: ClassVar = "as"
    title: ClassVar = "AS"
    suffixes: ClassVar = (".as",)
    other_suffixes: ClassVar = (".pg",)
    longest_name: ClassVar = 15
    reserved: ClassVar = frozenset(_AS_WORDS.split())
    most_external: ClassVar = 2
    comment: ClassVar = "; "
    width: ClassVar = 96
    axis_names: ClassVar = ("JT", "external ")
    words: ClassVar = ProgramWords(
        axis_move="JMOVE",
        straight_move="LMOVE",
        stop="PAUSE",
        start="CONTINUE",
        slow_mode="check mode",
        posture="All positions are by joints, which choose the posture.",
    )

    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the file; see `ProgramWriter.texts`."""
        _, T_parent_tcp = program.tool()
        orders = [
            f"TOOL {self.frame_text(T_parent_tcp)}",
            "ACCURACY 1 ALWAYS",
            *(_declaration(program, target) for target in program.targets),
            *self.body(program),
        ]
        lines = [f".PROGRAM {program.name}()", *head, *orders]
        indented = [lines[0], *(f"  {line}" for line in lines[1:]), ".END"]
        return (controller_text(indented),)

    def frame_text(self, T: FloatArray) -> str:
        """Return ``TRANS(x,y,z,o,a,t)`` in mm and deg: turned about z, the new y, the new z."""
        place = [number(1e3 * value, 4) for value in T[:3, 3]]
        turn = [number(math.degrees(value), 5) for value in _oat(T)]
        return f"TRANS({','.join([*place, *turn])})"

    def mover(self, program: RobotProgram) -> Mover:
        """Return the writer of a move; see `ProgramWriter.mover`. A speed holds until changed."""
        last = ""

        def lines(move: AxisMove | StraightMove) -> Iterator[str]:
            nonlocal last
            if isinstance(move, AxisMove):
                order, speed = "JMOVE", f"SPEED {program.axis_percent} ALWAYS"
            else:
                order, speed = "LMOVE", f"SPEED {number(1e3 * move.speed, 3)} MM/S ALWAYS"
            if speed != last:
                yield speed
            last = speed
            yield f"{order} #{move.name}"
            # Else the next step begins, and the corner is cut, before the tool has arrived.
            yield "BREAK"

        return lines

    def halt(self, stop: Stop) -> Iterable[str]:  # noqa: ARG002 - of the protocol
        """Return a PAUSE."""
        return ("PAUSE",)


def _declaration(program: RobotProgram, target: AxisMove | StraightMove) -> str:
    """Return the line that declares a position: the arm's joints, then the external axes."""
    arm, external = in_shown_units(program.robot, target.q)
    values = ",".join(number(value, 5) for value in (*arm, *external))
    return f"POINT #{target.name} = #PPOINT({values})"


def _oat(T: FloatArray) -> tuple[float, float, float]:
    """Return O, A, T of a rotation ``Rz(O) Ry(A) Rz(T)``, in rad; O = 0 where z is vertical."""
    R = T[:3, :3]
    sine = math.hypot(R[0, 2], R[1, 2])
    if sine < _STRAIGHT_UP:
        return 0.0, math.atan2(sine, R[2, 2]), math.atan2(R[1, 0], R[1, 1])
    return (
        math.atan2(R[1, 2], R[0, 2]),
        math.atan2(sine, R[2, 2]),
        math.atan2(R[2, 1], -R[2, 0]),
    )
