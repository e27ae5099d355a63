"""Programs in URScript, of Universal Robots: one file ``.script``, in m and rad.

Axis positions are lists for ``movej``, frames are poses with a rotation vector for ``movel``, in
the feature Base. A straight move goes to the posture nearest to the one in which it begins.
Nothing here was tried on a real robot.
"""

import math
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
    number,
)
from elastocal.robot import Robot
from elastocal.templating import plain

_JOINT_ACCELERATION = 0.5
"""In rad/s²."""
_TOOL_ACCELERATION = 0.1
"""In m/s²."""
_SLOWEST_JOINT = 2.0
"""Largest speed of the slowest joint in rad/s, where the model knows none."""
_UR_WORDS = (
    "AND BREAK CONTINUE DEF ELIF ELSE END ENTER_CRITICAL EXIT_CRITICAL FALSE GLOBAL HALT IF JOIN"
    " KILL LOCAL MOVEC MOVEJ MOVEL MOVEP NOT OR POPUP RETURN RUN SEC SET_TCP SLEEP SYNC TEXTMSG"
    " THREAD TRUE WHILE XOR"
)


class UrScriptWriter(ProgramWriter):
    """Writes URScript for Universal Robots."""

    language: ClassVar = "urscript"
    title: ClassVar = "URScript"
    suffixes: ClassVar = (".script",)
    longest_name: ClassVar = 32
    reserved: ClassVar = frozenset(_UR_WORDS.split())
    most_external: ClassVar = 0
    comment: ClassVar = "# "
    width: ClassVar = 96
    axis_names: ClassVar = ("joint ", "")
    words: ClassVar = ProgramWords(
        axis_move="movej",
        straight_move="movel",
        stop="popup",
        start="Continue",
        slow_mode="manual mode",
        posture="movel goes to the posture nearest to the one in which it begins.",
    )

    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the file; see `ProgramWriter.texts`."""
        _, T_parent_tcp = program.tool()
        body = [f"set_tcp({_pose(T_parent_tcp)})"]
        body += [f"{target.name} = {_value(target)}" for target in program.targets]
        body += self.body(program)
        lines = [*head, f"def {program.name}():"]
        lines += [*(f"  {line}" for line in body), "end", f"{program.name}()"]
        return (controller_text(lines, "\n"),)

    def frame_text(self, T: FloatArray) -> str:
        """Return ``p[x,y,z,rx,ry,rz]`` in m and rad."""
        return _pose(T)

    def axis_speed_text(self, robot: Robot, percent: int) -> str:
        """Return the speed of the leading joint."""
        return f"at {_joint_speed(robot, percent):.4g} rad/s ({percent} percent)"

    def mover(self, program: RobotProgram) -> Mover:
        """Return the writer of a move; see `ProgramWriter.mover`."""
        speed = _joint_speed(program.robot, program.axis_percent)

        def lines(move: AxisMove | StraightMove) -> Iterator[str]:
            if isinstance(move, AxisMove):
                yield f"movej({move.name}, a={_JOINT_ACCELERATION}, v={number(speed, 5)})"
            else:
                yield f"movel({move.name}, a={_TOOL_ACCELERATION}, v={number(move.speed, 6)})"

        return lines

    def halt(self, stop: Stop) -> Iterable[str]:
        """Return a window that waits."""
        reason = plain(stop.reason).replace('"', "'").replace("\\", "/")
        return (f'popup("{reason}", title="elastocal", blocking=True)',)


def _joint_speed(robot: Robot, percent: int) -> float:
    """Return the part of the slowest joint's largest speed, in rad/s, rounded down."""
    fastest = robot.limits.velocity
    known = fastest[np.isfinite(fastest) & (fastest > 0.0)]
    least = float(known.min()) if len(known) else _SLOWEST_JOINT
    return math.floor(1e3 * least * percent) / 1e5


def _value(target: AxisMove | StraightMove) -> str:
    if isinstance(target, AxisMove):
        return f"[{','.join(number(value, 8) for value in target.q)}]"
    return _pose(target.T_base_tcp)


def _pose(T: FloatArray) -> str:
    """Return a pose: 1e-7 m, 1e-8 rad."""
    place = [number(value, 7) for value in T[:3, 3]]
    turn = [number(value, 8) for value in Rotation.from_matrix(T[:3, :3]).as_rotvec()]
    return f"p[{','.join([*place, *turn])}]"
