"""Protocol of a controller's program: what its correction needs of its language.

A further controller (RAPID, LS, URScript) is a file or folder beside `krl` that reads its programs
into a `ControllerProgram`, and its line in `correct.PROGRAM_READERS`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from elastocal.arrays import FloatArray
from elastocal.results import brief_repr


class ProgramPoint(Protocol):
    """A position that a program moves to; its numbers are checked when they are used."""

    @property
    def name(self) -> str:
        """Name as declared."""

    @property
    def kind(self) -> str:
        """Type of the position in the controller's words."""

    @property
    def by_axes(self) -> bool:
        """Whether it holds axis positions, else a frame."""

    def T_frame_tcp(self) -> FloatArray:
        """Return its pose in the program's frame, shape (4, 4), in m.

        Raises
        ------
        PathError
            If a number is missing.
        """

    def arm_joints(self) -> FloatArray:
        """Return its positions of the arm's axes, shape (axis,), in rad.

        Raises
        ------
        PathError
            If a number is missing.
        """

    def external_joints(self, revolute: Sequence[bool]) -> FloatArray | None:
        """Return its positions of the external axes, shape (axis,), in rad or m; None: not given.

        Raises
        ------
        PathError
            If it gives some of them only.
        """


@dataclass(frozen=True)
class Move:
    """One motion to a point."""

    line: int
    """Line of the program's text, from 1."""
    straight: bool
    """Whether the tool goes along a straight line, else the axes run as they like."""
    order: str
    """The motion in the controller's words, e.g. ``LIN``."""
    name: str | None
    """The point, in capitals; None: values or an expression."""
    axes: ProgramPoint | None = None
    """Axis values written in the motion itself."""

    @property
    def label(self) -> str:
        """Description of the motion for people."""
        return f"line {self.line}, {self.order} {self.name}"


@brief_repr
@dataclass(frozen=True)
class CorrectedPoint:
    """New numbers for a point."""

    arm_joints: FloatArray
    """Positions of the arm's axes to command, shape (axis,), in rad."""
    T_frame_tcp: FloatArray
    """Pose to command in the program's frame, shape (4, 4), in m."""


@dataclass(frozen=True)
class Words:
    """A controller's words for things, for refusals that its user understands."""

    declarations: str
    """The place where points are declared, e.g. ``the .dat file``."""
    axis_position: str
    """A position by axes, with its article."""
    external_axis: str
    """The first external axis."""


class ControllerProgram(Protocol):
    """A robot program of one controller, read from its files."""

    @property
    def moves(self) -> tuple[Move, ...]:
        """Motions in the order of the text."""

    @property
    def points(self) -> Mapping[str, ProgramPoint]:
        """Declared positions that have a value, by name in capitals."""

    @property
    def files(self) -> tuple[Path, Path]:
        """The file that holds the motions, and the one that holds the points."""

    @property
    def words(self) -> Words:
        """Words for refusals."""

    def write(self, out: Path, corrected: Mapping[str, CorrectedPoint]) -> tuple[Path, ...]:
        """Write the program with corrected points, else unchanged; return the files.

        Parameters
        ----------
        out : Path
            Main file to write; others come beside it.
        corrected : mapping of str to CorrectedPoint
            By name in capitals.

        Raises
        ------
        FileAccessError
            If a file cannot be written.
        """

    def notes(self, assumed: Sequence[str], out: Path, frame_given: bool) -> tuple[str, ...]:
        """Return the warnings on a corrected program.

        Parameters
        ----------
        assumed : sequence of str
            Motions whose posture nothing in the program says.
        out : Path
            Main file that was written.
        frame_given : bool
            Whether the program's frame was placed in the model's base by hand.
        """
