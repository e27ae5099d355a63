"""Where the files of a report lie."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elastocal.errors import FileAccessError
from elastocal.procedure import JOURNAL, RunFolder

MODEL, TOOL, CODEC, PROCESS = "model.json", "tool.json", "codec", "process"
"""Default names of what is not part of the run's own folder."""
_RUN = "run"
"""Name of a run's folder in the folder that holds everything."""


@dataclass(frozen=True)
class Places:
    """Where to look."""

    run: RunFolder | None
    """None where there is only a model."""
    roots: tuple[Path, ...]
    """Folders in which default names are looked for, in order."""
    model: Path | None = None
    """A model that was named in place of a run."""

    def default(self, name: str) -> Path | None:
        """Return where a default name is, or None."""
        return next((root / name for root in self.roots if (root / name).exists()), None)

    def shown(self, path: Path) -> str:
        """Return a path as the report shows it: the same wherever the folder stands."""
        whole = path.resolve()
        for root in sorted({each.resolve() for each in self.roots}, key=lambda p: len(p.parts)):
            if whole.is_relative_to(root):
                return whole.relative_to(root).as_posix()
        return path.name


def find_places(run: Path) -> Places:
    """Return where the files of a run lie.

    Parameters
    ----------
    run : Path
        A run folder, a folder that holds one called ``run``, a folder with other parts but no run,
        or a model file.

    Raises
    ------
    FileAccessError
        If it is none of these.
    """
    if run.is_file():
        return Places(None, (run.parent,), run)
    if not run.is_dir():
        raise FileAccessError(f"cannot read {run}: there is no such file or folder")
    if (run / JOURNAL).exists():
        return Places(RunFolder(run), (run, _parent(run)))
    if (run / _RUN / JOURNAL).exists():
        return Places(RunFolder(run / _RUN), (run / _RUN, run))
    if any((run / name).exists() for name in (MODEL, CODEC, PROCESS)):
        return Places(None, (run,))
    raise FileAccessError(
        f"{run} is no folder of a run: it holds neither {JOURNAL}, {_RUN}/{JOURNAL} nor {MODEL}"
    )


def run_files(run: RunFolder) -> Iterator[Path]:
    """Yield the files of a run's own that a report is made from, if they are there."""
    cell = sorted(path for path in run.cell.rglob("*") if path.is_file())
    plan = sorted(path for path in run.plan.glob("*") if path.is_file())
    for path in (*cell, *plan, run.journal, run.dataset, run.summary):
        if path.is_file():
            yield path


def _parent(run: Path) -> Path:
    return run.resolve().parent
