"""``demo``: the whole story on a simulated cell, one public command after the other."""

import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Protocol, TextIO

from elastocal.cell import require_example
from elastocal.compensation.process import SimulateProcessResult
from elastocal.errors import FileAccessError
from elastocal.procedure import RunEnd
from elastocal.progress import Progress
from elastocal.results import Result, brief_repr
from elastocal.workflows._demo_folder import LOG, README, begin, finish
from elastocal.workflows._operator import Operator, Unattended
from elastocal.workflows._workflow import workflow
from elastocal.workflows.calibrate import calibrate
from elastocal.workflows.codec import codec
from elastocal.workflows.compensate import compensate
from elastocal.workflows.export import export
from elastocal.workflows.init import init
from elastocal.workflows.plan import plan
from elastocal.workflows.report import report
from elastocal.workflows.run import RunResult, run
from elastocal.workflows.simulate_process import simulate_process
from elastocal.workflows.tool import tool


@brief_repr
@dataclass(frozen=True)
class Chapter:
    """A command of the story."""

    title: str
    """What is done, for a person who watches."""
    words: tuple[str, ...]
    """The command's words, without the program's name."""
    work: Callable[[Progress, Operator], Result]
    """The same, as a workflow."""

    @property
    def line(self) -> str:
        """The command as one would type it."""
        return shlex.join(("elastocal", *self.words))


class DemoDisplay(Protocol):
    """What a person sees of a demo, and what its log takes."""

    operator: Operator
    """Watches the simulated arm."""

    def show(self, chapter: Chapter) -> AbstractContextManager[Progress]:
        """Show a chapter while it is at work."""

    def text(self, chapter: Chapter, result: Result) -> str:
        """Return what its command prints."""


class _Plain:
    """Hands progress on, and logs the facts of each result."""

    def __init__(self, progress: Progress) -> None:
        self.operator: Operator = Unattended()
        self._progress = progress

    @contextmanager
    def show(self, chapter: Chapter) -> Iterator[Progress]:
        """Tell the progress which chapter is at work."""
        yield lambda stage, done, total: self._progress(f"{chapter.title}: {stage}", done, total)

    def text(self, chapter: Chapter, result: Result) -> str:  # noqa: ARG002 - the protocol's form
        """Return the facts of a result."""
        return f"{result!r}\n"


MakeDisplay = Callable[[TextIO, Sequence[Chapter]], AbstractContextManager[DemoDisplay]]
"""From the open log and the story to a display."""


@brief_repr
@dataclass(frozen=True)
class DemoSettings:
    """Which story, and where its files go."""

    kind: str = "afp"
    """``afp``, fibre placement on a dome, or ``machining``, roughing of a block."""
    out: str | PathLike[str] = "demo"
    """Folder for the results."""
    seed: int = 0
    """Of the simulated cell."""
    force: bool = False
    """Remove an earlier demo from the folder first."""
    display: MakeDisplay | None = None
    """None: progress only."""


@dataclass(frozen=True, eq=False, repr=False)
class DemoResult(Result):
    """A finished demo."""

    folder: Path
    process: SimulateProcessResult
    """Deviations before and after correction: the paper's Table 1."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person who has watched the demo wants to know."""
        line = self.process.lines[-1]
        before, after, share = line.before, line.after, line.reduction
        return (
            (
                "mean deviation on the process path",
                f"{1e3 * before.mean:.3f} mm before, {1e3 * after.mean:.3f} mm after correction"
                f" (-{100 * share.mean:.1f} %)",
            ),
            ("largest", f"{1e3 * before.max:.3f} mm, then {1e3 * after.max:.3f} mm"),
            ("report", str(self.folder / "report.html")),
        )

    def pictured(self) -> object:
        """Return the simulated process."""
        return self.process

    def closing(self) -> tuple[str, ...]:
        """Return the facts in two sentences."""
        (_, mean), (_, largest), (_, page) = self.facts()
        return (
            f"mean deviation on the process path: {mean}; largest {largest}",
            f"open {page} in a browser; {self.folder / README} says what each file is",
        )


@workflow(DemoSettings)
def demo(settings: DemoSettings, progress: Progress) -> DemoResult:
    """Show the whole story on a simulated cell: from an empty folder to a signed-off report.

    Parameters
    ----------
    settings : DemoSettings
        Or its ``kind``, and the other fields by name.
    progress : Progress, optional
        Hears how far the work is.

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
    make = settings.display or (lambda _log, _story: _plain(progress))
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
    process = results.get("simulate-process")
    assert isinstance(process, SimulateProcessResult)
    return DemoResult(out, process)


def chapters(kind: str, out: Path, seed: int) -> tuple[Chapter, ...]:
    """Return the story of a demo.

    Parameters
    ----------
    kind : str
        ``afp`` or ``machining``.
    out : Path
        Folder of the demo.
    seed : int
        Of the simulated cell.

    Raises
    ------
    SchemaError
        If there is no such example cell.
    """
    require_example(kind)
    return (
        *_measuring(kind, out, str(seed)),
        _compared(out, "were there enough poses", "springs", "actuated,bearing"),
        _compared(out, "did the load cases help", "load_cases", "normal,all"),
        _compared(out, "did the search help", "search", "cover,ioops"),
        *_using(kind, out, str(seed)),
    )


def _measuring(kind: str, out: Path, seed: str) -> tuple[Chapter, ...]:
    """Return the story from the cell to model and tool."""
    cell, data, planned = out / "cell.yaml", out / "run/dataset.nc", out / "plan"
    model, weights, done = out / "model.json", out / "tool.json", out / "run"
    return (
        Chapter(
            "describe the cell",
            ("init", str(out), "--like", kind, "--force"),
            lambda show, _: init(out, show, like=kind, force=True),
        ),
        Chapter(
            "plan the poses",
            ("plan", str(cell), "--out", str(planned)),
            lambda show, _: plan(cell, show, out=planned),
        ),
        Chapter(
            "measure",
            ("run", str(cell), "--plan", str(planned), "--out", str(done), "--seed", seed),
            lambda show, operator: run(
                cell, show, plan=planned, out=done, seed=int(seed), operator=operator
            ),
        ),
        Chapter(
            "identify the springs",
            ("calibrate", str(data), "--out", str(model)),
            lambda show, _: calibrate(data, show, out=model),
        ),
        Chapter(
            "weigh the tool",
            ("tool", str(done), "--out", str(weights)),
            lambda show, _: tool(done, show, out=weights),
        ),
    )


def _compared(out: Path, title: str, key: str, values: str) -> Chapter:
    data, choice, folder = out / "run/dataset.nc", f"{key}={values}", out / "codec" / key
    return Chapter(
        title,
        ("codec", str(data), "--compare", choice, "--out", str(folder)),
        lambda show, _: codec(data, show, compare=(choice,), out=folder),
    )


def _using(kind: str, out: Path, seed: str) -> tuple[Chapter, ...]:
    """Return the story from the model to the report."""
    cell, model, weights = out / "cell.yaml", out / "model.json", out / "tool.json"
    process, corrected, page = out / "process", out / "corrected.csv", out / "report.html"
    path, known = process / "path.csv", ("--model", str(model), "--tool", str(weights))
    rest = ("--process", kind, "--seed", seed, "--out", str(process))
    return (
        Chapter(
            "correct in real time",
            ("simulate-process", str(cell), *known, *rest),
            lambda show, _: simulate_process(
                cell,
                show,
                models=(model,),
                tools=(weights,),
                process=kind,
                seeds=(int(seed),),
                out=process,
            ),
        ),
        Chapter(
            "correct offline",
            ("compensate", str(model), str(path), "--out", str(corrected)),
            lambda show, _: compensate(model, show, path=path, out=corrected),
        ),
        Chapter(
            "write C for the robot",
            ("export", str(model), "--tool", str(weights), "--c", str(out / "c")),
            lambda show, _: export(model, show, tool=weights, c=out / "c"),
        ),
        Chapter(
            "report",
            ("report", str(out), "--out", str(page)),
            lambda show, _: report(out, show, out=page),
        ),
    )


@contextmanager
def _plain(progress: Progress) -> Iterator[DemoDisplay]:
    yield _Plain(progress)


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    try:
        file = path.open("w", encoding="utf-8")
    except OSError as error:
        raise FileAccessError(f"cannot write {path}: {error.strerror or error}") from error
    with file:
        yield file


def _require_finished(result: Result) -> None:
    """Go no further than a run did."""
    if isinstance(result, RunResult):
        if result.problem is not None:
            raise result.problem
        if result.end is RunEnd.INTERRUPTED:
            raise KeyboardInterrupt
