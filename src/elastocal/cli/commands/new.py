"""``elastocal new``: a cell file by questions and answers, or by options."""

import sys
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from elastocal import workflows
from elastocal.cli import options, output

if TYPE_CHECKING:
    from elastocal.workflows import NewSettings

_QUESTIONS = {
    "robot": "Robot: name of the catalogue, or a URDF file",
    "flange": "Link that carries the tool, its z axis out of the arm",
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
"""What is asked, in this order; the key is the field."""


def _new(  # noqa: PLR0913 - one parameter an option
    out: Annotated[Path, typer.Option(metavar="CELL.yaml", help="Cell file to write.")] = Path(
        "cell.yaml"
    ),
    *,
    robot: Annotated[
        str | None,
        typer.Option(help="Catalogue name, or URDF file.", autocompletion=options.robot_names),
    ] = None,
    mesh: Annotated[Path | None, typer.Option(help="Surface: .stl, .obj or .ply.")] = None,
    flange: Annotated[
        str | None, typer.Option(help="Link that carries the tool; default: by its name.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Of the mesh; default: by its size.")] = None,
    place: Annotated[
        str | None, typer.Option(help="Frame of the mesh in base: 'x, y, z, a, b, c' with units.")
    ] = None,
    tcp: Annotated[
        str | None, typer.Option(help="Tool tip in the flange: 'x, y, z, a, b, c' with units.")
    ] = None,
    tool_mass: Annotated[str | None, typer.Option(help="Of all on the flange, '40 kg'.")] = None,
    tool_centre: Annotated[
        str | None, typer.Option(help="Its centre in the flange: 'x, y, z' with units.")
    ] = None,
    process: Annotated[
        str | None,
        typer.Option(
            metavar="PATH.csv", help="Production path: poses and presses are chosen for it."
        ),
    ] = None,
    press: Annotated[
        str | None, typer.Option(help="Largest force onto the surface, '1 kN'.")
    ] = None,
    force_range: Annotated[
        str | None, typer.Option(help="Of the sensor: 'fx, fy, fz' with units, or none.")
    ] = None,
    moment_range: Annotated[
        str | None, typer.Option(help="Of the sensor: 'mx, my, mz' with units.")
    ] = None,
    tracker: Annotated[
        str | None, typer.Option(help="Place in base: 'x, y, z' with units, or none.")
    ] = None,
    marker: Annotated[
        str | None, typer.Option(help="From the tool tip: 'x, y, z' with units.")
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(help="Largest error that the report lets pass, '0.1 mm'.")
    ] = None,
    poses: Annotated[int, typer.Option(min=1, max=100_000, help="Number of poses.")] = 15,
    ask: Annotated[
        bool | None,
        typer.Option("--ask/--no-ask", help="Ask for what is not given; default: on a terminal."),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Show a preview of the cell.")
    ] = True,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: options.Written = False,
) -> None:
    """Begin a cell file: answer questions, or give options; every question has a default."""
    settings = workflows.NewSettings(
        out, robot, mesh, flange, unit, place, tcp, tool_mass, tool_centre, process, press,
        force_range, moment_range, tracker, marker, tolerance, poses, force,
    )  # fmt: skip
    settings.require_free()
    people = sys.stdin.isatty() and not as_json
    if ask if ask is not None else people:
        settings = _asked(settings)
    result = workflows.new(settings)
    if as_json:
        output.print_json(result)
        return
    screen = output.console()
    screen.print(f"wrote {output.bold(str(out))}: look at every line", soft_wrap=True)
    output.print_remarks(screen, "note", result.findings)
    page = out.with_suffix(".html")
    hint = f"elastocal check {out} --preview {page}"
    plan = f"elastocal plan {out} --out {out.with_name('plan')}"
    if not (browser and people):
        screen.print(f"to see it: `{hint}`", soft_wrap=True)
        screen.print(f"then: `{plan}`", soft_wrap=True)
        return
    workflows.check(out, preview=page, force=force)
    screen.print(f"preview: {page}; then: `{plan}`", soft_wrap=True)
    webbrowser.open(page.resolve().as_uri())


def _asked(settings: "NewSettings") -> "NewSettings":
    """Return settings with the answers of a person; an empty answer takes what is offered."""
    for name, question in _QUESTIONS.items():
        if getattr(settings, name) is not None or _needless(settings, name):
            continue
        answer: dict[str, Any] = {name: _answer(settings, name, question)}
        settings = replace(settings, **answer)
    return settings


def _needless(settings: "NewSettings", name: str) -> bool:
    """Return whether a question has been answered by another: a catalogue says the flange."""
    if name == "flange":
        return not Path(str(settings.robot)).is_file()
    return (name, "none") in (
        ("moment_range", settings.force_range),
        ("marker_place", settings.tracker),
    )


def _answer(settings: "NewSettings", name: str, question: str) -> str:
    """Return a valid answer to one question; one that is not is refused, and asked again."""
    from elastocal.errors import ElastocalError, ProcedureError

    offered = None if name in ("robot", "mesh") else settings.offered(name)
    while True:
        try:
            text: str = typer.prompt(question, default=offered, err=True)
        except (typer.Abort, OSError) as end:
            output.console().print()  # the question has no end of its line
            if isinstance(end, typer.Abort) and not isinstance(end.__context__, EOFError):
                raise KeyboardInterrupt from end
            raise ProcedureError(
                "nobody answers: standard input has ended; give options instead"
            ) from end
        try:
            settings.require_answer(name, text.strip())
        except ElastocalError as error:
            output.console().print(f"   {error}", soft_wrap=True)
        else:
            return text.strip()
