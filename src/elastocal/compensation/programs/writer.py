"""A robot program without a language, and what the writer of a language makes of it.

A further language is a file with a `ProgramWriter` beside `krl_writer`, a text for its head in
``templates``, and its line in `languages.PROGRAM_WRITERS`.
"""

import contextlib
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.files import replacing
from elastocal.results import brief_repr
from elastocal.robot import Robot, T_from_xyzabc, parse_urdf
from elastocal.robot.inverse import arm_base
from elastocal.templating import plain, templates

_ARM_AXES = 6
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_WINDOWS_NAMES = frozenset({"AUX", "CON", "NUL", "PRN"})
"""Controllers keep files on disks of Windows."""


@brief_repr
@dataclass(frozen=True)
class AxisMove:
    """A move of all axes to joint positions, at the program's part of their speeds."""

    name: str
    q: FloatArray
    """External axes first, shape (joint,), in rad or m."""


@brief_repr
@dataclass(frozen=True)
class StraightMove:
    """A move of the tool along a straight line, in the posture in which it begins."""

    name: str
    T_base_tcp: FloatArray
    """Pose at its end, shape (4, 4), in m."""
    q: FloatArray
    """Joints there, shape (joint,), in rad or m."""
    speed: float
    """In m/s."""


@dataclass(frozen=True)
class Remark:
    """Comment for the reader of the program."""

    text: str


@dataclass(frozen=True)
class Stop:
    """Wait of the robot until a person lets it continue."""

    reason: str
    """Reason of the wait."""


Step = AxisMove | StraightMove | Remark | Stop
Mover = Callable[[AxisMove | StraightMove], Iterable[str]]
"""Says one move in a language."""


@brief_repr
@dataclass(frozen=True)
class Block:
    """Steps that belong together."""

    title: str
    """Title for people; empty: none."""
    steps: tuple[Step, ...]


@brief_repr
@dataclass(frozen=True)
class RobotProgram:
    """A program in no language: what moves where, in order."""

    name: str
    robot: Robot
    axis_percent: int
    """Speed of moves of axes, in percent of the axes' largest speeds."""
    blocks: tuple[Block, ...]
    facts: tuple[str, ...]
    """Paragraphs that say where it comes from."""
    motions: tuple[str, ...]
    """Paragraphs that describe its motions."""

    @property
    def targets(self) -> tuple[AxisMove | StraightMove, ...]:
        """Every position once, in the order in which they are first reached."""
        steps = (step for block in self.blocks for step in block.steps)
        moves = (step for step in steps if isinstance(step, AxisMove | StraightMove))
        return tuple({move.name: move for move in moves}.values())

    def tool(self) -> tuple[str, FloatArray]:
        """Return the link that the tcp is fixed to, and the tcp in it, shape (4, 4), in m."""
        for joint in parse_urdf(self.robot.urdf).findall("joint"):
            child, parent = joint.find("child"), joint.find("parent")
            if child is None or parent is None or child.get("link") != self.robot.tip:
                continue
            if joint.get("type") == "fixed":
                return parent.get("link", ""), _origin_of(joint)
        return self.robot.tip, np.eye(4)


def _origin_of(joint: ElementTree.Element) -> FloatArray:
    origin = joint.find("origin")
    if origin is None:
        return np.eye(4)
    xyz, rpy = (map(float, origin.get(key, "0 0 0").split()) for key in ("xyz", "rpy"))
    return T_from_xyzabc(*xyz, *reversed([*rpy]))


@dataclass(frozen=True)
class ProgramWords:
    """A controller's words for what every program does."""

    axis_move: str
    straight_move: str
    stop: str
    start: str
    """Button that a person presses to continue."""
    slow_mode: str
    """The mode in which a program is tried."""
    posture: str
    """Sentence: how straight moves keep the posture."""


class ProgramWriter(ABC):
    """Writes programs in one language: what it allows, and how it says each step."""

    language: ClassVar[str]
    """Name as an option."""
    title: ClassVar[str]
    """Name for people."""
    suffixes: ClassVar[tuple[str, ...]]
    """Suffixes of the files of a program, the main one first."""
    other_suffixes: ClassVar[tuple[str, ...]] = ()
    """Suffixes that programs in the language have elsewhere."""
    longest_name: ClassVar[int]
    reserved: ClassVar[frozenset[str]]
    """Words in capitals that cannot name a program."""
    most_external: ClassVar[int]
    """Number of external axes that a target can name."""
    comment: ClassVar[str]
    """Prefix of each line of a comment."""
    width: ClassVar[int]
    """Width of a comment, in characters."""
    words: ClassVar[ProgramWords]
    axis_names: ClassVar[tuple[str, str]]
    """Beginnings of the names of the arm's and of the external axes."""

    @abstractmethod
    def texts(self, program: RobotProgram, head: Sequence[str]) -> tuple[bytes, ...]:
        """Return the contents of the files, in the order of ``suffixes``.

        Parameters
        ----------
        program : RobotProgram
            A program that was checked.
        head : sequence of str
            Comments that a person must read first.
        """

    @abstractmethod
    def mover(self, program: RobotProgram) -> Mover:
        """Return the writer of the moves of one block; every block has its own."""

    @abstractmethod
    def halt(self, stop: Stop) -> Iterable[str]:
        """Return the lines at which the program waits for a person."""

    def titled(self, title: str, lines: Sequence[str]) -> Iterable[str]:
        """Return the lines of a block under its title."""
        return [*self.remark(title), *lines]

    def body(self, program: RobotProgram) -> Iterator[str]:
        """Yield the lines of all blocks."""
        for block in program.blocks:
            move = self.mover(program)
            lines = [line for step in block.steps for line in self._step(step, move)]
            yield from self.titled(block.title, lines) if block.title else lines

    def _step(self, step: Step, move: Mover) -> Iterable[str]:
        match step:
            case Remark():
                return self.remark(plain(step.text))
            case Stop():
                return [*self.remark(step.reason), *self.halt(step)]
            case _:
                return move(step)

    def remark(self, text: str) -> list[str]:
        """Return a text as lines of comment."""
        return [f"{self.comment}{line}" for line in textwrap.wrap(text, self.width)]

    @abstractmethod
    def frame_text(self, T: FloatArray) -> str:
        """Return a frame, shape (4, 4) in m, as the language writes it."""

    def axis_speed_text(self, robot: Robot, percent: int) -> str:  # noqa: ARG002 - of some languages
        """Return the speed of the axes, in words that follow the name of the motion."""
        return f"at {percent} percent"

    def slowest(self) -> float:
        """Return the slowest straight motion that the language can say, in m/s."""
        return 0.0

    def takes(self, robot: Robot) -> bool:
        """Return whether targets of the language can name all joints of a robot."""
        with contextlib.suppress(PlanningError):
            self.require_robot(robot)
            return True
        return False

    def require_robot(self, robot: Robot) -> None:
        """Refuse a robot that cannot be programmed in this language.

        Raises
        ------
        PlanningError
            If the arm has not six revolute joints, or there are too many external axes.
        """
        arm = robot.revolute[robot.external_axes :]
        refused = f"robot {robot.name!r} cannot be programmed in {self.title}"
        if len(arm) != _ARM_AXES or not all(arm):
            raise PlanningError(
                f"{refused}: its arm must have {_ARM_AXES} revolute joints, it has {sum(arm)}"
                f" ({', '.join(robot.joint_names)})"
            )
        if robot.external_axes > self.most_external:
            raise PlanningError(
                f"{refused}: {robot.external_axes} external axes, allowed are {self.most_external}"
            )

    def check_name(self, name: str, taken: frozenset[str] = frozenset()) -> None:
        """Refuse a name that a controller would.

        Parameters
        ----------
        name : str
            Name of the program, and of its files without suffix.
        taken : frozenset of str
            Names that the program uses itself, in capitals.

        Raises
        ------
        PlanningError
            If it is no name of the language, too long, or has a meaning already.
        """
        refused = f"{name!r} cannot name a {self.title} program"
        if not _NAME.fullmatch(name) or len(name) > self.longest_name:
            raise PlanningError(
                f"{refused}: allowed are 1 to {self.longest_name} of the characters A-Z a-z 0-9 _,"
                " not beginning with a digit"
            )
        if name.upper() in self.reserved | _WINDOWS_NAMES | taken:
            raise PlanningError(f"{refused}: the word has a meaning in it")

    def check_speed(self, name: str, speed: float) -> None:
        """Refuse a straight motion that the language cannot say, in m/s.

        Raises
        ------
        PlanningError
            If it is too slow.
        """
        if not speed >= self.slowest():
            raise PlanningError(
                f"{name} at {1e3 * speed:.4g} mm/s cannot be programmed in"
                f" {self.title}: the slowest is {1e3 * self.slowest():.4g} mm/s"
            )

    def paths(self, folder: Path, name: str) -> tuple[Path, ...]:
        """Return the files of a program in a folder, the main one first."""
        return tuple(Path(folder) / f"{name}{suffix}" for suffix in self.suffixes)

    def write(self, folder: Path, program: RobotProgram) -> tuple[Path, ...]:
        """Write the files of a program into a folder, all or none; return their paths.

        Raises
        ------
        PlanningError
            If the language allows the name, the robot or a speed not.
        FileAccessError
            If a file cannot be written.
        """
        self.require_robot(program.robot)
        self.check_name(program.name, frozenset(each.name for each in program.targets))
        for move in program.targets:
            if isinstance(move, StraightMove):
                self.check_speed(move.name, move.speed)
        files = self.paths(folder, program.name)
        texts = self.texts(program, [f"{self.comment}{line}" for line in self.head(program)])
        with contextlib.ExitStack() as stack:
            for path, text in zip(files, texts, strict=True):
                stack.enter_context(replacing(path)).write_bytes(text)
        return files

    def head(self, program: RobotProgram) -> list[str]:
        """Return the first lines, which state the conditions on the controller."""
        robot, external = program.robot, program.robot.external_axes
        parent, T_parent_tcp = program.tool()
        rendered = (
            templates(__package__)
            .get_template(f"{self.language}.txt")
            .render(
                program=program,
                robot=robot,
                words=self.words,
                axes=self._axes(robot),
                frame=self.frame_text,
                tool_parent=parent,
                T_parent_tcp=T_parent_tcp,
                T_base_foot=arm_base(robot, np.zeros(external)) if external else None,
                T_world=np.eye(4),
            )
        )
        return [line for each in _paragraphs(rendered) for line in textwrap.wrap(each, self.width)]

    def _axes(self, robot: Robot) -> list[str]:
        """Return each axis with its joint, in words."""
        arm, external = self.axis_names
        rails = [plain(name) for name in robot.joint_names[: robot.external_axes]]
        names = [plain(name) for name in robot.joint_names[robot.external_axes :]]
        axes = [f"{arm}{i} {name}" for i, name in enumerate(names, start=1)]
        for i, name in enumerate(rails):
            axes.append(f"{external}{i + 1} {name} in {'deg' if robot.revolute[i] else 'mm'}")
        return axes


def in_shown_units(robot: Robot, q: FloatArray) -> tuple[list[float], list[float]]:
    """Return the joints of the arm in deg, and the external axes in deg or mm."""
    external = robot.external_axes
    scale = np.where(robot.revolute, 180.0 / np.pi, 1e3)
    shown = (scale * np.asarray(q, dtype=float)).tolist()
    return shown[external:], shown[:external]


def number(value: float, decimals: int) -> str:
    """Return a decimal number without exponent, never -0.

    >>> number(-1e-9, 3)
    '0.000'
    """
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def render_text(template: str, values: Mapping[str, object]) -> Iterator[str]:
    """Return the paragraphs of a text of this package, each one line."""
    return _paragraphs(templates(__package__).get_template(template).render(values))


def _paragraphs(text: str) -> Iterator[str]:
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        yield " ".join(paragraph.split())


def controller_text(lines: Sequence[str], end: str = "\r\n") -> bytes:
    """Return lines as the bytes of a file: ASCII, by default with the line ends of Windows."""
    return "".join(f"{line}{end}" for line in lines).encode("ascii")
