"""The program of a corrected path: before its first row by axes, then straight through all rows."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.programs.plan_program import LIN_SPEED, PTP_PERCENT
from elastocal.compensation.programs.writer import (
    AxisMove,
    Block,
    ProgramWriter,
    RobotProgram,
    Stop,
    StraightMove,
    render_text,
)
from elastocal.errors import PathError
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import RowName, inverse_for, joints_along_path

BEFORE_PATH = 0.05
"""Distance before the first row at which the program stops, back along the tool, in m."""
MOST_ROWS = 20_000
"""Most rows of one program."""
_LARGEST_TURN = np.pi / 2.0
"""A joint that turns farther between two rows is no straight move."""


@brief_repr
@dataclass(eq=False)
class PathProgram:
    """The program of a path, as its corrected rows come in."""

    robot: Robot
    writer: ProgramWriter
    name: str
    speed: float = LIN_SPEED
    """Speed of the tool along the path, in m/s."""
    _moves: list[StraightMove] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Refuse what the language does not allow.

        Raises
        ------
        PlanningError
            If it is the robot, the name or the speed.
        """
        self.writer.require_robot(self.robot)
        self.writer.check_name(self.name)
        self.writer.check_speed(self.name, self.speed)

    def add(self, q: FloatArray, T_base_tcp: FloatArray, where: RowName) -> None:
        """Take in further rows.

        Parameters
        ----------
        q : ndarray, shape (row, joint)
            Joints to command, in rad or m.
        T_base_tcp : ndarray, shape (row, 4, 4)
            Poses to command, in m.
        where : callable
            Names a row in a refusal.

        Raises
        ------
        PathError
            If a straight move cannot lead to a row, or there are too many.
        """
        before = self._moves[-1].q if self._moves else q[0]
        turns = np.abs(np.diff(np.vstack([before, q]), axis=0)) * self.robot.revolute
        for row in np.flatnonzero(turns.max(axis=1) > _LARGEST_TURN).tolist():
            joint = int(turns[row].argmax())
            raise PathError(
                f"{where(row)}: {self.robot.joint_names[joint]} turns by"
                f" {np.degrees(turns[row, joint]):.1f} deg from the row before, which no straight"
                " move of a program may: divide the path there, or leave out --program"
            )
        if len(self._moves) + len(q) > MOST_ROWS:
            raise PathError(
                f"{where(MOST_ROWS - len(self._moves))}: a program has at most {MOST_ROWS} rows:"
                " divide the path, or leave out --program"
            )
        start = len(self._moves) + 1
        self._moves += [
            StraightMove(f"XROW{index}", T, joints, self.speed)
            for index, (T, joints) in enumerate(zip(T_base_tcp, q, strict=True), start=start)
        ]

    def program(self, *facts: str) -> RobotProgram:
        """Return the program of all rows so far, one at least.

        Parameters
        ----------
        *facts : str
            Where the path comes from.

        Raises
        ------
        PathError
            If the robot cannot reach the place before the first row, or behind the last.
        """
        first, last = self._moves[0], self._moves[-1]
        start, end = self._away("XBEFORE", first), self._away("XAFTER", last)
        values = {
            "words": self.writer.words,
            "rows": len(self._moves),
            "speed": self.speed,
            "before": f"{1e3 * BEFORE_PATH:.0f}",
            "axis_speed": self.writer.axis_speed_text(self.robot, PTP_PERCENT),
        }
        stop = Stop("Before the first row: see that the way to it is free.")
        return RobotProgram(
            name=self.name,
            robot=self.robot,
            axis_percent=PTP_PERCENT,
            blocks=(
                Block("", (AxisMove(start.name, start.q), stop)),
                Block("PATH", (*self._moves, end)),
            ),
            facts=facts,
            motions=tuple(render_text("path_motions.txt", values)),
        )

    def write(self, folder: Path, *facts: str) -> tuple[Path, ...]:
        """Write the files of the program into a folder, all or none; return their paths.

        Raises
        ------
        PathError
            As for `program`.
        FileAccessError
            If a file cannot be written.
        """
        return self.writer.write(folder, self.program(*facts))

    def _away(self, name: str, row: StraightMove) -> StraightMove:
        """Return the move to the place off a row, back along the tool, in the same posture."""
        T = row.T_base_tcp.copy()
        T[:3, 3] -= BEFORE_PATH * T[:3, 2]
        external = row.q[None, : self.robot.external_axes]
        where = f"{1e3 * BEFORE_PATH:.0f} mm off the path ({name})"
        q = joints_along_path(inverse_for(self.robot), T[None], external, row.q, lambda _: where)
        return StraightMove(name, T, q[0], self.speed)
