"""The commands: each calls its workflow with the given options and shows the result.

The options are those of the settings (`elastocal.cli.generator`); only what concerns the terminal
is defined here.
"""

import sys
import webbrowser
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from elastocal import workflows
from elastocal.cli import output
from elastocal.cli.generator import Command, Given
from elastocal.options import CHOICES, Option, settings_class

if TYPE_CHECKING:
    from elastocal.blocks import Block

COMMANDS: dict[str, Command] = {}
"""Commands by name, in the order of help."""


def command(
    group: str,
    *,
    module: str = "",
    settings: str = "",
    function: str = "",
    more: type | None = None,
    hidden: tuple[str, ...] = (),
) -> Callable[[Callable[[Given], None]], Callable[[Given], None]]:
    """Make a command of a function; by default it is that of the workflow of its name.

    Parameters
    ----------
    group : str
        Where help lists it.
    module, settings, function : str, optional
        Module of the settings, their class, and the function whose docstring is the command's.
    more : type, optional
        Class of the parameters that the command line alone has.
    hidden : tuple of str, optional
        Fields that those stand for in another form.
    """

    def mark(run: Callable[[Given], None]) -> Callable[[Given], None]:
        name = run.__name__.strip("_")
        COMMANDS[name.replace("_", "-")] = Command(
            group,
            module or f"{workflows.__name__}.{name}",
            settings or settings_class(name),
            function or name,
            run,
            more,
            hidden,
        )
        return run

    return mark


def _say(*lines: str) -> None:
    screen = output.console()
    for line in lines:
        screen.print(line, soft_wrap=True)


def _show(given: Given, data: object, shown: "Iterable[Block]", *lines: str) -> None:
    """Print data as JSON where that was asked for, else blocks, and where they were written."""
    if given.as_json:
        output.print_json(data)
        return
    screen = output.console()
    output.print_blocks(screen, shown)
    for path in (given.settings.get(name) for name in ("out", "figure")):
        if path is not None and not {**given.settings, **given.here}.get("dry_run"):
            screen.print(f"written to {output.bold(path)}", soft_wrap=True)
    for line in lines:
        screen.print(line, soft_wrap=True)


def _as_file(result: object) -> dict[str, Any]:
    """Return the content of a result's file, without its schema: figures of a JSON object."""
    return {key: value for key, value in _figures(result).items() if key != "schema"}


def _figures(result: object) -> dict[str, Any]:
    """Return the figures of a result as a JSON object has them."""
    from elastocal.records import to_data  # not for help

    found: dict[str, Any] = to_data(result)
    return found


def _worked(work: Callable[..., Any], given: Given, **more: Any) -> Any:
    """Return the result of long work, whose progress is shown."""
    with output.progress_bars() as progress:
        return work(progress=progress, **given.settings, **more)


def plain(
    group: str,
    name: str,
    figures: Callable[[Any], object] = lambda result: result,
    *,
    module: str = "",
    slow: bool = False,
) -> None:
    """Make a command that shows what the workflow of its name returns, and nothing else.

    Parameters
    ----------
    group, name : str
        Where help lists it, and the workflow.
    figures : callable, optional
        What of the result ``--json`` prints; by default all of it.
    module : str, optional
        Module of the settings.
    slow : bool
        Whether its progress is shown.
    """

    def run(given: Given) -> None:
        work = getattr(workflows, name)
        result = _worked(work, given) if slow else work(**given.settings)
        _show(given, figures(result), result.show())

    run.__name__ = name
    command(group, module=module)(run)


@dataclass(frozen=True)
class _Robots:
    name: Annotated[str | None, Option(argument=True, choices="robot")] = None
    """Show one robot in full."""
    urdf: bool = False
    """Print the named robot's URDF on standard output."""


@command("Prepare", module=__name__, settings="_Robots", function="_robots")
def _robots(given: Given) -> None:
    """List the robots that elastocal knows, with the source of each number."""
    from elastocal.errors import RobotError
    from elastocal.robot import catalogue

    name = given.settings.get("name")
    if given.settings["urdf"]:
        if name is None:
            raise RobotError("--urdf needs the name of a robot (see `elastocal robots`)")
        text = catalogue.urdf(name)
        if given.as_json:
            output.print_json({"robot": catalogue.entry(name).name, "urdf": text})
        else:
            typer.echo(text, nl=False)
        return
    names = [name] if name else catalogue.names()
    shown = catalogue.show_robot(name) if name else catalogue.show_robots(names)
    _show(given, {"robots": [catalogue.robot_figures(each) for each in names]}, shown)


@dataclass(frozen=True)
class _New:
    ask: Annotated[bool | None, Option("--ask/--no-ask")] = None
    """Ask for what is not given; default: on a terminal."""
    browser: Annotated[bool, Option("--browser/--no-browser")] = True
    """Show a preview of the cell."""


@command("Prepare", more=_New)
def _new(given: Given) -> None:
    from elastocal.cli.questions import answered

    settings = workflows.NewSettings(**given.settings)
    settings.require_free()
    people = sys.stdin.isatty() and not given.as_json
    ask = given.here["ask"]
    if ask if ask is not None else people:
        settings = answered(settings)
    with output.progress_bars() as progress:
        result = workflows.new(settings, progress)
    if given.as_json:
        output.print_json(result)
        return
    out = Path(settings.out)
    _say(f"wrote {output.bold(str(out))}: look at every line")
    output.print_remarks(output.console(), "note", result.findings)
    page = out.with_suffix(".html")
    plan = f"elastocal plan {out} --out {out.with_name('plan')}"
    if not (given.here["browser"] and people):
        _say(f"to see it: `elastocal check {out} --preview {page}`")
        _say(f"then: `{plan}`")
        return
    workflows.check(out, preview=page, force=settings.force)
    _say(f"preview: {page}; then: `{plan}`")
    webbrowser.open(page.resolve().as_uri())


@command("Prepare")
def _init(given: Given) -> None:
    result = workflows.init(**given.settings)
    _show(given, result, result.show(), f"edit it, then `elastocal check {result.cell}`")


@dataclass(frozen=True)
class _Check:
    browser: Annotated[bool, Option("--browser/--no-browser")] = False
    """Show that page in a browser."""


@command("Prepare", more=_Check)
def _check(given: Given) -> None:
    result, preview = workflows.check(**given.settings), given.settings.get("preview")
    if preview is not None and given.here["browser"]:
        webbrowser.open(preview.resolve().as_uri())

    data = {"file": result.file, "kind": result.kind, **result.holds}
    if not given.as_json:
        _say(f"{output.green('ok')} {result.file} is a {result.kind}")
    lines = () if preview is None else (f"preview: {preview}",)
    _show(given, data, result.show(), *lines)


@command("Prepare")
def _watch(given: Given) -> None:
    from elastocal.cli._operator import following_devices, interruption
    from elastocal.errors import DeviceError

    with interruption() as interrupted, following_devices(output.console()) as tell:
        result = workflows.watch(**given.settings, show=tell, interrupted=interrupted)
        ended = not interrupted()
    _show(given, result.figures, result.show())
    if ended and result.problem is not None:
        raise DeviceError(result.problem)


@dataclass(frozen=True)
class _Studio:
    no_browser: bool = False
    """Only print the address."""


@command("Prepare", more=_Studio)
def _studio(given: Given) -> None:
    def show(found: workflows.StudioResult) -> None:
        if given.as_json:
            output.print_json(found.figures)
        else:
            output.print_lines([found.figures.address])
        output.print_remarks(output.console(), "warning", found.figures.notes)
        _say("Ctrl-C ends it; whoever has the address can use it")
        if not given.here["no_browser"]:
            found.open_page()
        try:
            found.wait()
        finally:
            if found.session.is_running:
                _say("stopping the run: the arm is brought to safety")

    workflows.studio(**given.settings, while_open=show)


def _purpose(here: Mapping[str, Any], choices: str) -> str:
    """Return what a command is for, one of its choices."""
    given: str = here["purpose"]
    if given not in CHOICES[choices]:
        known = ", ".join(CHOICES[choices])
        raise typer.BadParameter(f"{given!r} is not one of {known}.", param_hint="--for")
    return given


@dataclass(frozen=True)
class _Plan:
    purpose: Annotated[str, Option("--for", choices="purpose")] = "elasticity"
    """elasticity: presses on the tooling; geometry: positions in free space for elastocal geometry;
    both: presses, then positions, in one program."""
    search: Annotated[str | None, Option(choices="technique")] = None
    """With --for geometry: search technique; default: i_optimal."""
    program: str | None = None
    """Name of the robot program; default: calib, or positions."""


@command("Prepare", more=_Plan, hidden=("program",))
def _plan(given: Given) -> None:
    from elastocal.errors import PlanningError

    asked, here = given.settings, given.here
    purpose, free_poses = _purpose(here, "purpose"), asked.pop("free_poses", None)
    if free_poses is not None and purpose != "both":
        raise PlanningError("--positions is for --for both")
    if purpose == "geometry":
        if asked.pop("dry_run") or asked.pop("compare", None) or asked.pop("jobs", None):
            raise PlanningError("--dry-run, --compare and --jobs are for presses, not for geometry")
        asked.pop("page_language")
        chosen = {name: here[name] for name in ("search", "program") if here[name]}
        found = _worked(workflows.plan_positions, given, **chosen)
        _show(given, found, found.show(), _FILL_IN)
        return
    if here["search"] is not None:
        raise PlanningError("--search is for --for geometry: the cell file names its technique")
    settings = workflows.PlanSettings(
        **asked,
        program=here["program"] or "calib",
        free_poses=(free_poses or 60) if purpose == "both" else None,
    )
    with output.progress_bars() as progress:
        presses = workflows.plan(settings, progress)
    _show_plan(given, settings, presses)


def _show_plan(
    given: Given, settings: "workflows.PlanSettings", found: "workflows.PlanResult"
) -> None:
    from elastocal.geometry import PositionPlan
    from elastocal.planning.export import pose_lines
    from elastocal.records import read_json

    out, free = Path(settings.out), None
    if settings.free_poses is not None:
        free = read_json(out / workflows.POSITION_PLAN, PositionPlan)
    figures = workflows.plan_figures(found, out, settings.program, settings.language, free)
    if settings.dry_run:
        figures = replace(figures, files=())
        if not given.as_json:
            output.print_lines(pose_lines(found))

    program = getattr(figures.program, "values", {}).get("reason", figures.program)
    shown = (*found.show(), *(free.show() if free is not None else ()))
    files = f"files: {', '.join(figures.files)}" if figures.files else "Nothing was written."
    lines = (f"robot program: {program}", files)
    _show(given, figures, shown, *lines, *((_FILL_IN,) if free is not None else ()))


_FILL_IN = "fill the markers into the table of positions, then `elastocal geometry`"


@command("Prepare")
def _study(given: Given) -> None:
    result, out = _worked(workflows.study, given), given.settings["out"]
    data = {"folder": str(out), "files": result.files, **_as_file(result.summary)}
    _show(given, data, result.show(), f"files: {', '.join(result.files)}")


@dataclass(frozen=True)
class _Run:
    dry_run: bool = False
    """A line a pose on standard output: id, time, joints; nothing moves."""


@command("Measure", more=_Run)
def _run(given: Given) -> None:
    from elastocal.cli._operator import TerminalOperator
    from elastocal.procedure import RunEnd

    asks = not (given.settings["confirmed"] or given.as_json)
    operator = TerminalOperator(output.console(), asks=asks)
    settings = workflows.RunSettings(**given.settings, operator=operator)
    if given.here["dry_run"]:
        rehearsed = workflows.dry_run(settings)
        if not given.as_json:
            output.print_lines(rehearsed.pose_lines())
        _show(given, rehearsed.figures, rehearsed.show(), "Nothing was moved.")
        return
    finished = workflows.run(settings)
    # The reason why a run is not carried out is printed even with --json.
    if given.as_json and finished.end is RunEnd.DONE:
        output.print_json(finished.figures)
    else:
        output.print_blocks(output.console(), finished.show())
    if finished.problem is not None:
        raise finished.problem
    if finished.end is RunEnd.INTERRUPTED:
        raise typer.Exit(130)


@command("Measure")
def _touch(given: Given) -> None:
    from elastocal.cli._operator import TerminalOperator

    asks = not (given.settings["confirmed"] or given.as_json)
    operator = TerminalOperator(output.console(), asks=asks)
    result = workflows.touch(**given.settings, operator=operator)
    _show(given, result, result.show())


@command("Measure")
def _release(given: Given) -> None:
    from elastocal.cli._operator import TerminalOperator

    operator = TerminalOperator(output.console())
    result = workflows.release(**given.settings, operator=operator)
    _show(given, result.figures, result.show())


@command("Measure")
def _simulate(given: Given) -> None:
    from elastocal.cli._operator import stack_by_hand

    def show(found: workflows.SimulateResult) -> None:
        if given.as_json:
            output.print_json(found)
        else:
            output.print_lines(found.lines())
        _say("Ctrl-C ends it")
        if found.stack is not None:
            stack_by_hand(output.console(), found.stack)
        found.wait()

    workflows.simulate(**given.settings, meanwhile=show)


plain("Measure", "krc_config")


@command("Measure")
def _measure_delay(given: Given) -> None:
    from elastocal.cli._operator import TerminalOperator

    operator = TerminalOperator(output.console())
    result = _worked(workflows.measure_delay, given, operator=operator)
    _show(given, result.measured, result.show())


@command("Measure")
def _derive(given: Given) -> None:
    result = workflows.derive(**given.settings)
    written = f"written to {result.folder.dataset} and {result.folder.summary.name}"
    _show(given, result.summary, result.show(), written)


@dataclass(frozen=True)
class _Import:
    map: Annotated[Path, Option("--map")]
    """Map of the columns (.yaml); --guess writes one."""
    out: Path | None = None
    """Dataset (.nc or .csv), or table of positions (.csv), to write."""
    guess: bool = False
    """Write a first map to --map, and show it."""
    cell: Path | None = None
    """With --guess: cell file that says robot, tool, sensor."""
    purpose: Annotated[str, Option("--for", choices="import purpose")] = "elasticity"
    """What is written: a dataset of deflections, or positions of the unloaded arm (.csv), for which
    no log needs to hold a force."""


@command(
    "Measure",
    module="elastocal.workflows.import_logs",
    settings="ImportLogsSettings",
    function="import_logs",
    more=_Import,
    hidden=("map", "out"),
)
def _import(given: Given) -> None:
    asked, here = given.settings, given.here
    if here["guess"]:
        ask = _ask if sys.stdin.isatty() and not given.as_json else None
        settings = workflows.GuessMapSettings(
            asked["logs"], out=here["map"], cell=here["cell"], force=asked["force"], ask=ask
        )
        guessed = workflows.guess_map(settings)

        data = {"map": str(here["map"]), "logs": guessed.logs}
        _show(given, data, guessed.show(), f"wrote {here['map']}: look at every line")
        return
    if here["cell"] is not None:
        raise typer.BadParameter("is for --guess: the map names the cell", param_hint="--cell")
    if here["out"] is None:
        raise typer.BadParameter("is missing: the file to write", param_hint="--out")
    if _purpose(here, "import purpose") == "geometry":
        if asked.pop("picture", None) is not None:
            raise typer.BadParameter("is of a dataset", param_hint="--picture")
        table = _worked(workflows.import_positions, given, map=here["map"], out=here["out"])
        _show(given, table.figures, table.show(), f"wrote {table.figures.table}")
        return
    result = _worked(workflows.import_logs, given, map=here["map"], out=here["out"])
    wrote = f"wrote {result.figures.dataset}, look at {result.figures.picture}"
    _show(given, result.figures, result.show(), wrote)


def _ask(question: str) -> str:
    """Return the answer given on the terminal."""
    return output.asked(output.console(), question)


plain("Identify", "tool", _as_file)


@command("Identify")
def _geometry(given: Given) -> None:
    result = _worked(workflows.geometry, given)
    kept = ("held_out", "with_blunders", "ladder", "parameters", "fixed", "blunders")
    figures = {key: getattr(result.model, key) for key in kept}
    more = {"axes": result.accuracy.axes, "iso_9283": result.accuracy.poses}
    more["urdf"] = result.expressed
    if result.test is not None:
        more["test"] = result.test
    _show(given, figures | more, result.show())


plain("Identify", "calibrate", attrgetter("calibration"))


@command("Identify")
def _codec(given: Given) -> None:
    result, out = _worked(workflows.codec, given), given.settings["out"]
    data = {"folder": str(out), "files": result.files, **_figures(result.summary)}
    _show(given, data, result.show(), f"files: {', '.join(result.files)}")


@dataclass(frozen=True)
class _ToolOrFile:
    tool: tuple[str, ...] = ()
    """Tool file from `elastocal tool` (weight, bias, sensor); and, given again, another tool: its
    tcp in the calibrated tcp's frame, 'x, y, z, a, b, c' with units."""


_TOOL = ("tool", "tools", "tool_frame")
"""Fields that this single option replaces."""


def _tools(given: Given) -> tuple[tuple[Path, ...], str | None]:
    """Return the tool files, and the frame of another tool, among the values of ``--tool``."""
    from elastocal.errors import CompensationError

    texts = given.here["tool"] or ()
    frames = [text for text in texts if "," in text and not Path(text).exists()]
    if len(frames) > 1:
        raise CompensationError(f"--tool names {len(frames)} tcps: a model is for one tool")
    files = tuple(Path(text) for text in texts if text not in frames)
    return files, frames[0] if frames else None


def _only_tool(given: Given) -> dict[str, Any]:
    """Return the only tool file and the frame, as settings."""
    from elastocal.errors import CompensationError

    files, frame = _tools(given)
    if len(files) > 1:
        raise CompensationError(f"--tool names {len(files)} tool files: a compensator has one")
    return {"tool": files[0] if files else None, "tool_frame": frame}


plain("Use", "predict", attrgetter("summary"))


plain("Use", "compensate", slow=True)


@command("Use", more=_ToolOrFile, hidden=_TOOL)
def _live(given: Given) -> None:
    from elastocal.cli._operator import following_live, interruption
    from elastocal.errors import DeviceError

    screen = output.console()
    with interruption() as interrupted, following_live(screen) as tell:
        result = workflows.live(
            **given.settings,
            **_only_tool(given),
            report=tell,
            warn=lambda text: output.print_remarks(screen, "warning", [text]),
            interrupted=interrupted,
        )
    _show(given, result, result.show())
    if result.problem is not None:
        raise DeviceError(result.problem)


@command("Use")
def _stiffness(given: Given) -> None:
    result = _worked(workflows.stiffness, given)
    data = _figures(result.summary) | {"folder": str(given.settings["out"])}
    _show(given, data, result.show(), f"files: {', '.join(result.summary.files)}")


@command("Use", more=_ToolOrFile, hidden=_TOOL)
def _simulate_process(given: Given) -> None:
    files, frame = _tools(given)
    result = _worked(workflows.simulate_process, given, tools=files, tool_frame=frame)
    data = _figures(result) | {"folder": str(given.settings["out"])}
    _show(given, data, result.show())


@command("Use", more=_ToolOrFile, hidden=_TOOL)
def _export(given: Given) -> None:
    result = workflows.export(**given.settings, **_only_tool(given))
    _show(given, result, result.show())


_PAIR = f"{workflows.__name__}.two_robots"
"""Module of the commands for two robots."""


plain("Two robots", "plan_pair", _as_file, module=_PAIR)


plain("Two robots", "simulate_pair", module=_PAIR)


plain("Two robots", "calibrate_pair", _as_file, module=_PAIR)


plain("Two robots", "compensate_pair", _as_file, module=_PAIR)


@command("Judge and hand over")
def _report(given: Given) -> None:
    from elastocal.cli._operator import TerminalOperator

    operator = TerminalOperator(output.console(), asks=not given.as_json)
    result = workflows.report(**given.settings, identify=operator.identify)
    others = (path for path in (result.figures.pdf, result.figures.xlsx) if path)
    _show(given, result.figures, result.show(), *(f"written to {path}" for path in others))


@command("Judge and hand over")
def _compare(given: Given) -> None:
    asked, lines = given.settings, list[str]()
    result = workflows.compare(**asked)
    if "limit" in asked and "rows" not in asked:
        path = workflows.measured_rows(result.summary.new_provenance)
        known = path and f", e.g. {path}, which the new model states it was calibrated on"
        lines.append(f"give the rows that matter with --rows{known or ''}")
    _show(given, result.summary, result.show(), *lines)


@dataclass(frozen=True)
class _Verify:
    target: Annotated[Path | None, Option(argument=True, metavar="REPORT|RUN")] = None
    """A report (.html), or the folder of a run."""
    new_key: Annotated[Path | None, Option(metavar="KEY")] = None
    """Make a key pair instead: KEY and KEY.pub."""


@command("Judge and hand over", more=_Verify, hidden=("file",))
def _verify(given: Given) -> None:
    target, new_key = given.here["target"], given.here["new_key"]
    if (target is None) == (new_key is None):
        raise typer.BadParameter("name a report or a run, or a file for a new key", param_hint="")
    if new_key is not None:
        from elastocal.verdict import make_key

        public = make_key(new_key)
        wrote = f"wrote {new_key} (keep it secret) and {public} (give it away)"
        _show(given, {"private": str(new_key), "public": str(public)}, (), wrote)
        return
    found = workflows.verify(target, **given.settings)
    _show(given, {"whole": found.broken is None, "links": found.links}, found.show())
    found.require_whole()


@command("See all of it")
def _demo(given: Given) -> None:
    from elastocal.cli.story import shown

    result = shown(**given.settings)
    data = {"folder": str(given.settings["out"]), "process": result.process}
    if given.as_json:
        output.print_json(data)
    else:
        _say(*result.closing())
