"""``demo``: the whole story on a simulated cell, one public command after the other."""

import shlex
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Protocol, TextIO

from elastocal import __version__
from elastocal.cell import PROCESS_FILE, require_example
from elastocal.compensation.process import SimulateProcessResult
from elastocal.errors import FileAccessError, of_kind
from elastocal.files import write_text
from elastocal.options import Option, settings_class, settings_fields
from elastocal.parallel import process_count, process_pool
from elastocal.procedure import RunEnd
from elastocal.progress import Progress
from elastocal.results import Result, brief_repr
from elastocal.verdict import Verdict
from elastocal.workflows._operator_and_devices import Operator, Unattended
from elastocal.workflows._workflow import Workflow, workflow
from elastocal.workflows.calibrate import calibrate
from elastocal.workflows.codec import codec
from elastocal.workflows.compensate import compensate
from elastocal.workflows.export import export
from elastocal.workflows.init import init
from elastocal.workflows.plan import plan
from elastocal.workflows.report import ReportResult, report
from elastocal.workflows.run import RunResult, run
from elastocal.workflows.simulate_process import STIFFEST, simulate_process
from elastocal.workflows.tool import tool

LOG = "log.txt"
README = "README.md"
_FIRST = "# A demo of elastocal:"
"""First line of a README that identifies an earlier demo."""

_FILES = (
    ("report.html", "the report: open it in a browser; it needs no network"),
    ("cell.yaml", "the cell: robot, tool, sensor, trackers, tooling, load cases, limits"),
    ("process.csv", "where production runs: joints and forces of its courses"),
    ("plan/plan.html", "the chosen poses in three dimensions; plan.json holds them for programs"),
    ("run/", "cell and plan as used, journal, raw streams (.mcap), dataset.nc, summary.json"),
    ("runs.jsonl", "the runs of this cell, in the order in which they began"),
    ("model.json", "the calibrated model: compliances, their bootstrap draws, what is observable"),
    ("tool.json", "mass, centre of mass, sensor bias and rotation, from the unloaded poses"),
    ("codec/", "were there enough poses: one folder a comparison, with codec.html"),
    ("process/", "the process without and with correction in real time: the paper's Table 1"),
    ("process/path.csv", "the programmed path with the forces that are expected"),
    ("corrected.csv", "the same path, corrected offline"),
    ("c/", "C99 of the model and its compensator, for the real-time target"),
    (LOG, "every command as it was given, and what it printed"),
)
_POSTURES: dict[str, dict[str, str]] = {"machining": {"posture": STIFFEST}}
"""A spindle may be turned about its axis: there the posture is chosen (paper 4.3.1)."""


@brief_repr
@dataclass(frozen=True)
class Chapter:
    """A command of the story."""

    title: str
    """Description for a person who watches."""
    words: tuple[str, ...]
    """The command's words, without the program's name."""
    work: Callable[[Progress, Operator], Result]
    """The same, as a workflow."""

    @property
    def line(self) -> str:
        """The command as one would type it."""
        return shlex.join(("elastocal", *self.words))


class DemoDisplay(Protocol):
    """Display of a demo for a person and for its log."""

    operator: Operator
    """Watches the simulated arm."""

    def show(self, chapter: Chapter) -> AbstractContextManager[Progress]:
        """Show a chapter while it is at work."""

    def text(self, chapter: Chapter, result: Result) -> str:
        """Return the printed output of its command."""


class _Plain:
    """Hands progress on, and logs the facts of each result."""

    def __init__(self, progress: Progress) -> None:
        self.operator: Operator = Unattended()
        self._progress = progress

    @contextmanager
    def show(self, chapter: Chapter) -> Iterator[Progress]:
        """Report the current chapter to the progress."""
        yield lambda stage, done, total: self._progress(f"{chapter.title}: {stage}", done, total)

    def text(self, chapter: Chapter, result: Result) -> str:  # noqa: ARG002 - the protocol's form
        """Return the facts of a result."""
        return f"{result!r}\n"


MakeDisplay = Callable[[TextIO, Sequence[Chapter]], AbstractContextManager[DemoDisplay]]
"""Function from the open log and the story to a display."""


@brief_repr
@dataclass(frozen=True)
class DemoSettings:
    """Settings of a demo: the story and its folder."""

    kind: Annotated[str, Option(argument=True, metavar="[afp|machining]")] = "afp"
    """``afp``, fibre placement on a dome, or ``machining``, roughing of a block."""
    out: Annotated[str | PathLike[str], Option(metavar="DIR")] = "demo"
    """Folder for the results."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of the simulated cell."""
    force: bool = False
    """Remove an earlier demo from the folder first."""
    display: MakeDisplay | None = None
    """Display of the demo; by default only progress is shown."""


@dataclass(frozen=True, eq=False, repr=False)
class DemoResult(Result):
    """A finished demo."""

    folder: Path
    process: SimulateProcessResult
    """Deviations before and after correction: the paper's Table 1."""
    verdict: Verdict
    """Verdict of the report."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the summary after the demo: before and after, the verdict, what to do next."""
        verdict = self.verdict
        effects = () if verdict.effect is None else (verdict.effect,)
        return (
            *((each.where, f"{each.figures}, {each.rest}") for each in effects),
            (verdict.word, verdict.meaning),
            *(("because", reason) for reason in verdict.reasons[:1]),
            ("next", verdict.next_step),
            ("report", str(self.folder / "report.html")),
        )

    def pictured(self) -> object:
        """Return the simulated process."""
        return self.process

    def closing(self) -> tuple[str, ...]:
        """Return the facts in some sentences."""
        *facts, (_, page) = self.facts()
        return (
            *(f"{name}: {text}" for name, text in facts),
            f"open {page} in a browser; {self.folder / README} says what each file is",
        )


@workflow(DemoSettings)
def demo(settings: DemoSettings, progress: Progress) -> DemoResult:
    """Show the whole story on a simulated cell: from an empty folder to a signed-off report.

    Raises
    ------
    SchemaError
        If there is no such example cell.
    FileAccessError
        If the folder holds files that are no demo's, or cannot be written.
    KeyboardInterrupt
        If the run was interrupted.
    """
    out = Path(settings.out)
    story = chapters(settings.kind, out, settings.seed)
    begin(out, settings.kind, settings.force)
    make = settings.display or (lambda _log, _story: nullcontext(_Plain(progress)))
    results: dict[str, Result] = {}
    with _opened(out / LOG) as log, make(log, story) as display:
        for chapter in story:
            log.write(f"$ {chapter.line}\n")
            with display.show(chapter) as show:
                result = chapter.work(show, display.operator)
            log.write(f"{display.text(chapter, result)}\n")
            log.flush()
            _require_finished(result)
            results[chapter.words[0]] = result
    finish(out, settings.kind, settings.seed, [chapter.line for chapter in story])
    process = of_kind(results.get("simulate-process"), SimulateProcessResult, "last result")
    made = of_kind(results.get("report"), ReportResult, "report")
    return DemoResult(out, process, made.verdict)


def chapters(kind: str, out: Path, seed: int) -> tuple[Chapter, ...]:
    """Return the story of a demo.

    Parameters
    ----------
    kind : str
        ``afp`` or ``machining``.
    out : Path
        Folder of the demo.
    seed : int
        Seed of the simulated cell.

    Raises
    ------
    SchemaError
        If there is no such example cell.
    """
    require_example(kind)
    cell, run_folder, planned, process = (
        out / name for name in ("cell.yaml", "run", "plan", "process")
    )
    data, model, weights = run_folder / "dataset.nc", out / "model.json", out / "tool.json"
    comparisons = (
        ("were there enough poses", "springs", "actuated,bearing"),
        ("did the load cases help", "load_cases", "normal,all"),
        ("did the search help", "search", "cover,ioops"),
    )
    return (
        _chapter("describe the cell", init, out, kind=kind, force=True),
        _chapter("plan the poses", plan, cell, out=planned),
        _chapter("measure", run, cell, plan=planned, out=run_folder, seed=seed),
        _chapter("identify the springs", calibrate, data, out=model, process=out / PROCESS_FILE),
        _chapter("weigh the tool", tool, run_folder, out=weights),
        *(
            _chapter(title, codec, data, compare=(f"{key}={values}",), out=out / "codec" / key)
            for title, key, values in comparisons
        ),
        _chapter(
            "correct in real time",
            simulate_process,
            cell,
            models=(model,),
            tools=(weights,),
            kind=kind,
            seeds=(seed,),
            out=process,
            **_POSTURES.get(kind, {}),
        ),
        _chapter(
            "correct offline",
            compensate,
            model,
            path=process / "path.csv",
            out=out / "corrected.csv",
        ),
        _chapter("write C for the robot", export, model, tool=weights, out=out / "c"),
        _chapter("report", report, out, out=out / "report.html"),
    )


def _chapter(
    title: str, workflow: Workflow[Any, Result], source: Path, **options: object
) -> Chapter:
    """Return a workflow with its options, and the command that does the same."""
    name = workflow.__name__
    settings = settings_fields(workflow.__module__, settings_class(name))
    fields = {each.name: each for each in settings}
    words = [name.replace("_", "-"), str(source)]
    for key, value in options.items():
        flag = "" if fields[key].option.argument else fields[key].flag
        for each in value if isinstance(value, tuple) else (value,):
            words += [word for word in (flag, "" if each is True else str(each)) if word]

    def work(progress: Progress, operator: Operator) -> Result:
        if workflow is not run:
            return workflow(source, progress, **options)
        with _processes_get_ready():
            return workflow(source, progress, operator=operator, **options)

    return Chapter(title, tuple(words), work)


def _processes_get_ready() -> AbstractContextManager[object]:
    """Start the processes of later chapters while the simulated run uses one core."""
    cores = process_count()
    return process_pool(cores, _find_workflows) if cores > 1 else nullcontext()


def _find_workflows() -> None:
    """Do nothing: a process that loads this function has imported all workflows."""


def begin(out: Path, kind: str, force: bool) -> None:
    """Make the folder, without an earlier demo.

    Raises
    ------
    FileAccessError
        If it holds files, unless all are those of a demo and ``force`` is given.
    """
    try:
        holds = sorted(entry.name for entry in out.iterdir()) if out.exists() else []
        if holds:
            _refuse_foreign(out, holds, force)
            _empty(out)
        out.mkdir(parents=True, exist_ok=True)
        # Written first: a demo that is interrupted can be removed like a finished one.
        write_text(out / README, f"{_FIRST} {kind}\n\nNot finished.\n")
    except OSError as error:
        if isinstance(error, FileAccessError):
            raise
        raise FileAccessError(f"cannot use folder {out}: {error.strerror or error}") from error


def finish(out: Path, kind: str, seed: int, commands: Sequence[str]) -> None:
    """Write what each file is, and how to make all of them again.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    rows = "".join(f"| [{name}]({name}) | {text} |\n" for name, text in _FILES)
    lines = "".join(f"{command}\n" for command in commands)
    write_text(
        out / README,
        f"{_FIRST} {kind}\n\n"
        f"Made by elastocal {__version__} on a simulated cell, seed {seed}. Every measurement in"
        " it was simulated, with a truth that the model cannot express; nothing was measured on a"
        " robot.\n\n"
        f"| file | what it is |\n|---|---|\n{rows}\n"
        f"## How it was made\n\n```sh\n{lines}```\n",
    )


def _refuse_foreign(out: Path, holds: list[str], force: bool) -> None:
    readme = out / README
    ours = readme.is_file() and readme.read_text("utf-8", "replace").startswith(_FIRST)
    known = {name.partition("/")[0] for name, _ in _FILES} | {README}
    foreign = [name for name in holds if name not in known and not name.endswith(".stl")]
    if foreign or not ours:
        first = (foreign or holds)[0]
        raise FileAccessError(f"{out} holds files that are no demo's ({first}): name another")
    if not force:
        raise FileAccessError(f"{out} holds a demo already: name another, or give --force")


def _empty(out: Path) -> None:
    """Remove the contents of a folder, the README last, so that the rest is known as a demo's.

    The folder itself stays: it may be a link, or the current folder of a shell.
    """
    for entry in sorted(out.iterdir(), key=lambda each: each.name == README):
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    try:
        file = path.open("w", encoding="utf-8")
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error
    with file:
        yield file


def _require_finished(result: Result) -> None:
    """Require that the run is finished."""
    if isinstance(result, RunResult):
        if result.problem is not None:
            raise result.problem
        if result.end is RunEnd.INTERRUPTED:
            raise KeyboardInterrupt
