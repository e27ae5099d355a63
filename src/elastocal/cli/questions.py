"""The questions of ``elastocal new``, on a terminal."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elastocal.asking import BACK, SKIP, ask_in_turn
from elastocal.cli import output

if TYPE_CHECKING:
    from elastocal.workflows import NewSettings

_QUESTIONS = {
    "robot": "Robot: name of the catalogue, or a URDF file",
    "flange": "Link that carries the tool, its z axis out of the arm",
    "rail": "Rail that carries the robot: direction in base, both ends (y, -1.5 m, 1.5 m), or none",
    "mesh": "Surface that the tool presses on (.stl, .obj, .ply)",
    "unit": "Unit of its numbers (mm, m, in)",
    "place": "Its frame in the robot's base: x, y, z, a, b, c",
    "tcp": "Tool tip in the flange, z out of the tool: x, y, z, a, b, c",
    "tool_mass": "Mass of all that hangs on the flange",
    "tool_centre": "Its centre in the flange: x, y, z",
    "process": "Production path (.csv) that poses and presses are chosen for, or none",
    "press": "Largest force onto the surface",
    "force_range": "Force sensor, its largest forces: fx, fy, fz, or none",
    "moment_range": "Its largest moments: mx, my, mz",
    "tracker": "Laser tracker, its place in the robot's base: x, y, z, or none",
    "marker_place": "Marker from the tool tip: x, y, z",
    "accepted": "Largest error of a predicted deflection that the report lets pass, or none",
}
"""Questions in their order; the key is the field."""


_HELP = (
    f"Enter takes what is offered; {BACK} returns to the question before; {SKIP} takes what is"
    " offered for all that follow."
)


def answered(settings: "NewSettings") -> "NewSettings":
    """Return settings with the answers of a person; an empty answer accepts the default."""
    screen, given = output.console(), settings

    def put(name: str) -> str | None:
        if getattr(given, name) is not None or _needless(settings, name):
            return None
        return _answer(settings, name)

    def take(name: str, answer: str) -> None:
        nonlocal settings
        said: dict[str, Any] = {name: answer}
        if name == "robot" and answer != settings.robot:
            said["flange"] = given.flange  # a link of another robot
        replace(settings, **said).require_answer(name, answer)
        settings = replace(settings, **said)

    screen.print(_HELP)
    ask_in_turn(
        tuple(_QUESTIONS), put, take, lambda error: screen.print(f"   {error}", soft_wrap=True)
    )
    return settings


def _needless(settings: "NewSettings", name: str) -> bool:
    """Return whether a question has been answered by another: a catalogue says the flange."""
    if name == "flange":
        return not Path(str(settings.robot)).is_file()
    return (name, "none") in (
        ("moment_range", settings.force_range),
        ("marker_place", settings.tracker),
    )


def _answer(settings: "NewSettings", name: str) -> str:
    """Return the answer to one question."""
    from elastocal.errors import ProcedureError

    said = getattr(settings, name)
    offered = said or ("" if name in ("robot", "mesh") else settings.offered(name))
    try:
        text: str = typer.prompt(
            _QUESTIONS[name], default=offered, show_default=bool(offered), err=True
        )
    except (typer.Abort, OSError) as end:
        output.console().print()  # the question has no end of its line
        if isinstance(end, typer.Abort) and not isinstance(end.__context__, EOFError):
            raise KeyboardInterrupt from end
        raise ProcedureError(
            "nobody answers: standard input has ended; give options instead"
        ) from end
    return text
