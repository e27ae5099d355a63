"""Programs in ASCII teach pendant form, of FANUC controllers: one file ``.ls``.

All positions are joints, those of straight moves too: a frame would need a CONFIG string, whose
letters depend on the model. J3 is counted from the horizontal, as the pendant does:
``J3 = q3 - q2``. Nothing here was tried on a real robot.
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
from elastocal.errors import PlanningError
from elastocal.robot import Robot, xyzabc_from_T
from elastocal.robot.inverse import arm_axes

_TP_WORDS = "ABORT CALL END GOTO IF JMP LBL OFF ON PAUSE RUN SELECT SKIP WAIT"
_LONGEST_COMMENT = 16
"""Longest comment of a position, in characters."""
_ATTRIBUTES = """OWNER		= MNEDITOR;
COMMENT		= "elastocal";
PROG_SIZE	= 0;
CREATE		= DATE 26-01-01  TIME 00:00:00;
MODIFIED	= DATE 26-01-01  TIME 00:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= {count};
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;"""


class FanucWriter(ProgramWriter):
    """Writes ASCII teach pendant programs for FANUC controllers."""

    language: ClassVar = "fanuc"
    title: ClassVar = "FANUC TP"
    suffixes: ClassVar = (".ls",)
    longest_name: ClassVar = 36
    reserved: ClassVar = frozenset(_TP_WORDS.split())
    most_external: ClassVar = 3
    comment: ClassVar = "  !"
    # A remark of more than 32 characters is cut by older controllers.
    width: ClassVar = 32
    axis_names: ClassVar = ("J", "E")
    words: ClassVar = ProgramWords(
        axis_move="J",
        straight_move="L",
        stop="PAUSE",
        start="CYCLE START",
        slow_mode="T1",
        posture="All positions are by joints, which choose the posture.",
    )

    def require_robot(self, robot: Robot) -> None:
        """Refuse a robot whose third axis is not counted as a FANUC's; see `ProgramWriter`."""
        super().require_robot(robot)
        axes = arm_axes(robot)
        if not axes.direction[1] @ axes.direction[2] < -0.999:
            raise PlanningError(
                f"robot {robot.name!r} cannot be programmed in {self.title}: its third axis must"
                f" turn against its second, as a FANUC's does"
                f" ({', '.join(robot.joint_names[robot.external_axes :][1:3])})"
            )

    def slowest(self) -> float:
        """Return 1 mm/s: the language states whole mm/s."""
        return 1e-3

    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the file; see `ProgramWriter.texts`."""
        orders = [*head, "  UFRAME_NUM=1", "  UTOOL_NUM=1", *self.body(program)]
        lines = [f"/PROG  {program.name.upper()}", "/ATTR"]
        lines += [*_ATTRIBUTES.format(count=len(orders)).split("\n"), "/APPL", "/MN"]
        lines += [f"{index:4d}:{order} ;" for index, order in enumerate(orders, start=1)]
        lines += ["/POS"]
        for index, move in enumerate(program.targets, start=1):
            lines += _position(program.robot, index, move)
        return (controller_text([*lines, "/END"]),)

    def frame_text(self, T: FloatArray) -> str:
        """Return ``X …, Y …, Z …, W …, P …, R …`` in mm and deg: turned about fixed x, y, z."""
        x, y, z, r, p, w = xyzabc_from_T(T)
        values = (*(1e3 * np.array((x, y, z))), *np.degrees((w, p, r)))
        return ", ".join(
            f"{key} {number(value, 3)}" for key, value in zip("XYZWPR", values, strict=True)
        )

    def mover(self, program: RobotProgram) -> Mover:
        """Return the writer of a move; see `ProgramWriter.mover`."""
        numbers = {move.name: index for index, move in enumerate(program.targets, start=1)}

        def lines(move: AxisMove | StraightMove) -> Iterator[str]:
            if isinstance(move, AxisMove):
                yield f"J P[{numbers[move.name]}] {program.axis_percent}% FINE   "
            else:
                # Whole mm/s, rounded down: never faster than the program means.
                speed = int(1e3 * move.speed + 1e-9)
                yield f"L P[{numbers[move.name]}] {speed}mm/sec FINE   "

        return lines

    def halt(self, stop: Stop) -> Iterable[str]:  # noqa: ARG002 - of the protocol
        """Return a PAUSE."""
        return ("  PAUSE",)


def _position(robot: Robot, index: int, move: AxisMove | StraightMove) -> Iterator[str]:
    """Yield the lines of a position by joints, to 1e-5 deg and 1e-5 mm."""
    arm, external = in_shown_units(robot, move.q)
    # The pendant's J3 is the elevation of the forearm, whatever the upper arm does.
    arm[2] -= arm[1]
    values = [f"J{i}={number(value, 5):>13} deg" for i, value in enumerate(arm, start=1)]
    for i, value in enumerate(external):
        unit = "deg" if robot.revolute[i] else " mm"
        values.append(f"E{i + 1}={number(value, 5):>13} {unit}")
    yield f'P[{index}:"{move.name[:_LONGEST_COMMENT]}"]{{'
    yield "   GP1:"
    yield "\tUF : 1, UT : 1,"
    for start in range(0, len(values), 3):
        end = "" if start + 3 >= len(values) else ","
        row = ",\t".join(values[start : start + 3])
        yield f"\t{row}{end}"
    yield "};"
