"""Options that several commands share, with their help, and small values that people type."""

from pathlib import Path
from typing import Annotated, Any

import typer

from elastocal.errors import CompensationError, UnitError
from elastocal.units import parse_number, parse_quantity

_NARROW = 20
"""Characters that help shows of what an option takes, where a terminal has 80 columns."""
_TECHNIQUES = (
    "cover", "ioops", "i_optimal", "random", "exchange-d", "exchange-a", "exchange-e",
    "exchange-o2", "exchange-o3", "exchange-o4", "exchange-o5",
)  # fmt: skip
CHOICES: dict[str, tuple[str, ...]] = {
    "technique": _TECHNIQUES,
    "technique or none": (*_TECHNIQUES, "none"),
    "springs": (
        "auto", "actuated", "bearing", "bearing-joint", "bearing-ends", "links", "tensor", "gears",
    ),
    "process": ("afp", "machining"),
    "example": ("afp", "machining", "ur20"),
    "language": ("krl", "rapid", "fanuc", "urscript", "none"),
    "page language": ("en", "de", "fr"),
    "loss": ("linear", "huber", "cauchy"),
    "weights": ("none", "sigma"),
    "free frame": ("none", "load_case", "campaign"),
    "posture": ("programmed", "stiffest"),
    "target": ("linux",),
}  # fmt: skip
"""What help lists without importing what knows them; tests/contracts/test_commands.py holds it."""


def choice(kind: str, help: str, file: bool = False) -> Any:
    """Return an option that shows its choices, and that a shell completes.

    What is none of them is refused by the workflow, which says what is nearest.

    Parameters
    ----------
    kind : str
        Of `CHOICES`.
    help : str
        What the option is for.
    file : bool, optional
        Whether a file may be given as well.
    """
    names = CHOICES[kind]
    shown = f"[{'|'.join(names)}]"
    if file or len(shown) > _NARROW:
        # Help would break it in the middle of a name.
        help = f"{help} One of {', '.join(names)}{', or a .yaml file' if file else ''}."
        shown = "NAME|FILE" if file else "NAME"

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return typer.Option(metavar=shown, autocompletion=complete, help=help)


def robot_names(incomplete: str) -> list[str]:
    """Return the robots of the catalogue that begin with a text, for a shell."""
    from elastocal.robot import catalogue  # not for help

    return [name for name in catalogue.names() if name.casefold().startswith(incomplete.casefold())]


START_HELP = (
    "Posture before the first row, a quantity a joint from base to tip:"
    " '0 deg, -90 deg, 90 deg, 0 deg, 45 deg, 0 deg'."
)
RobotName = Annotated[
    str | None,
    typer.Option(
        help="URDF file or catalogue name; default: the dataset's own.",
        autocompletion=robot_names,
    ),
]
TcpLink = Annotated[
    str | None, typer.Option(help="Link at the tool centre point; default: the dataset's.")
]
ToolFrame = Annotated[
    str | None, typer.Option(help="Tcp behind that link: 'x, y, z, a, b, c' with units (Z-Y'-X'').")
]
NewTool = Annotated[
    str | None,
    typer.Option(
        "--tool",
        help="Another tool: its tcp in the calibrated tcp's frame, 'x, y, z, a, b, c' with units.",
    ),
]
NewToolOrFile = Annotated[
    list[str] | None,
    typer.Option(
        "--tool",
        help="Tool file from `elastocal tool` (weight, bias, sensor); and, given again, another"
        " tool: its tcp in the calibrated tcp's frame, 'x, y, z, a, b, c' with units.",
    ),
]
ToolMass = Annotated[
    str | None, typer.Option(help="Mass of that tool, '12 kg'; needs --tool-centre.")
]
ToolCentre = Annotated[
    str | None, typer.Option(help="Its centre in the new tcp's frame: 'x, y, z' with units.")
]
Language = Annotated[
    str | None,
    choice("language", "Language of the robot program. Default: that of the robot's maker."),
]
PageLanguage = Annotated[str, choice("page language", "Language of the page.")]
Geometry = Annotated[
    Path | None,
    typer.Option(help="Model file from geometry: the arm as built, its errors and its sag."),
]
Payload = Annotated[
    str | None, typer.Option(help="With --geometry: mass beyond its description, '12 kg'.")
]
PayloadCentre = Annotated[
    str | None, typer.Option(help="Its centre in that model's tcp: 'x, y, z' with units.")
]
Marker = Annotated[
    str | None,
    typer.Option(help="Marker in the tcp frame: 'x, y, z' with units; default: the dataset's."),
]
Exclude = Annotated[
    list[str] | None, typer.Option(help="Leave out POSE or POSE:LOAD_CASE; repeatable.")
]
CompensatorFile = Annotated[Path | None, typer.Option(help="Settings of the compensator (.yaml).")]
Force = Annotated[
    bool, typer.Option("--force", help="Replace a file that this command did not write.")
]
State = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=VALUE",
        help="For the certificate, e.g. sensor.serial=FT-7; may be repeated.",
    ),
]
Figures = Annotated[bool, typer.Option("--json", help="Print the figures as one JSON object.")]
KeyFigures = Annotated[
    bool, typer.Option("--json", help="Print the key figures as one JSON object.")
]
Written = Annotated[bool, typer.Option("--json", help="Print what was written as one JSON object.")]


def parse_limit(text: str, option: str = "--limit") -> float:
    """Return a limit in m from a length with its unit.

    >>> parse_limit("0.1 mm")
    0.0001

    Raises
    ------
    UnitError
        If the text is not a length above 0.
    """
    try:
        limit = parse_quantity(text, "length")
    except UnitError as error:
        raise UnitError(f"{option}: {error}") from error
    if not limit > 0.0:
        raise UnitError(f"{option}: {text!r} is not above 0")
    return limit


def parse_direction(text: str) -> tuple[float, float, float]:
    """Return a direction from ``"x, y, z"``.

    >>> parse_direction("0, 0, -1")
    (0.0, 0.0, -1.0)

    Raises
    ------
    CompensationError
        If the text is not three numbers.
    """
    try:
        x, y, z = (parse_number(part) for part in text.split(","))
    except ValueError as error:
        raise CompensationError(
            f"direction {text!r} must be three numbers, e.g. '0, 0, -1'"
        ) from error
    return x, y, z


def parse_loads(text: str | None) -> tuple[float, ...]:
    """Return shares of a load from ``"0.5,-1"``.

    >>> parse_loads("0.5,-1")
    (0.5, -1.0)

    Raises
    ------
    CompensationError
        If a part is not a number.
    """
    try:
        return tuple(parse_number(part) for part in (text or "").split(",") if text)
    except ValueError as error:
        raise CompensationError(f"--load {text!r} must be numbers, e.g. '0.5,-1'") from error


def split_tools(given: list[str] | None) -> tuple[tuple[Path, ...], str | None]:
    """Return the tool files, and the frame of another tool, among the values of ``--tool``.

    >>> split_tools(["tool.json", "0 mm, 0 mm, 100 mm, 0 deg, 0 deg, 0 deg"])[1]
    '0 mm, 0 mm, 100 mm, 0 deg, 0 deg, 0 deg'

    Raises
    ------
    CompensationError
        If there are several frames.
    """
    frames = [text for text in given or () if "," in text and not Path(text).exists()]
    if len(frames) > 1:
        raise CompensationError(f"--tool names {len(frames)} tcps: a model is for one tool")
    files = tuple(Path(text) for text in given or () if text not in frames)
    return files, frames[0] if frames else None


def only_tool(files: tuple[Path, ...]) -> Path | None:
    """Return the only tool file; None where there is none.

    Raises
    ------
    CompensationError
        If there are several.
    """
    if len(files) > 1:
        raise CompensationError(f"--tool names {len(files)} tool files: a compensator has one")
    return files[0] if files else None
