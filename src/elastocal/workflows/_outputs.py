"""Where a workflow may write."""

from pathlib import Path

from elastocal.errors import FileAccessError


def refuse_overwriting(out: Path | None, *inputs: Path) -> None:
    """Refuse an output path that is also an input: measurements are not to be replaced.

    Raises
    ------
    FileAccessError
        If the paths are the same file.
    """
    for path in inputs:
        if out is not None and out.resolve() == path.resolve():
            raise FileAccessError(f"--out {out} is an input of this command: name another file")
