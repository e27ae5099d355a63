"""Languages of robot controllers, and which one a robot is programmed in."""

from elastocal.compensation.programs.as_writer import AsWriter
from elastocal.compensation.programs.fanuc_writer import FanucWriter
from elastocal.compensation.programs.krl_writer import KrlWriter
from elastocal.compensation.programs.rapid_writer import RapidWriter
from elastocal.compensation.programs.urscript_writer import UrScriptWriter
from elastocal.compensation.programs.writer import ProgramWriter
from elastocal.errors import PlanningError
from elastocal.findings import Grade, Kind
from elastocal.plugins import Registry
from elastocal.robot import Robot
from elastocal.robot.catalogue import maker_of

PROGRAM_WRITERS: Registry[ProgramWriter] = Registry(
    "program language",
    {
        writer.language: writer
        for writer in (KrlWriter(), RapidWriter(), FanucWriter(), UrScriptWriter(), AsWriter())
    },
    PlanningError,
)
"""Writers of programs by their language."""
NO_PROGRAM = "none"
"""Name that requests no program, where a language is expected."""
_LANGUAGES = {
    "KUKA": "krl",
    "ABB": "rapid",
    "FANUC": "fanuc",
    "Universal Robots": "urscript",
    "Kawasaki": "as",
}
"""Language of each maker."""


def writer_named(language: str) -> ProgramWriter:
    """Return the writer of a language.

    Raises
    ------
    PlanningError
        If there is none, with the known ones.
    """
    return PROGRAM_WRITERS.named(language.casefold(), (NO_PROGRAM,))


NOT_WRITTEN = Kind("program.not-written", "no program: {reason}", grade=Grade.NOTE)


def choose_writer(robot: Robot, language: str | None = None) -> tuple[ProgramWriter | None, str]:
    """Return the writer for a robot, and in words why it is that one or none.

    Parameters
    ----------
    robot : Robot
        Its maker is known by its name.
    language : str, optional
        Takes the place of the maker's; ``none``: no program.

    Raises
    ------
    PlanningError
        If there is no such language, or it was asked for and cannot program the robot.
    """
    if language is not None:
        if language.casefold() == NO_PROGRAM:
            return None, NOT_WRITTEN(reason="none was asked for")
        writer = writer_named(language)
        writer.require_robot(robot)
        return writer, f"{writer.title}, as asked for"
    maker = maker_of(robot.name)
    if maker is None:
        return None, NOT_WRITTEN(
            reason=f"the maker of robot {robot.name!r} is not known by its name; give"
            f" --language {'|'.join(PROGRAM_WRITERS)}"
        )
    if maker not in _LANGUAGES:
        return None, NOT_WRITTEN(
            reason=f"none is written for robots of {maker}; the table (.csv) has every point,"
            f" and --language {'|'.join(PROGRAM_WRITERS)} writes another maker's"
        )
    writer = PROGRAM_WRITERS[_LANGUAGES[maker]]
    try:
        writer.require_robot(robot)
    except PlanningError as error:
        return None, NOT_WRITTEN(reason=str(error))
    return writer, f"{writer.title}, for a robot of {maker}"
