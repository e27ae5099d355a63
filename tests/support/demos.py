"""A finished demo, made once however many processes run the tests."""

import fcntl
from pathlib import Path

from support.cli import Result, elastocal


def finished_demo(kind: str, base: Path) -> Path:
    """Return the folder of a demo; do not write into it.

    Parameters
    ----------
    kind : str
        ``afp`` or ``machining``.
    base : Path
        Base folder of pytest's temporary ones; with xdist each worker has its own below one.
    """
    root = base.parent if base.name.startswith("popen-gw") else base
    folder, told = root / f"demo-{kind}", root / f"demo-{kind}.told"
    with (root / f"demo-{kind}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not told.exists():
            result = elastocal("demo", kind, "--out", folder)
            told.write_text(f"{result.code}\n{result.err}", encoding="utf-8")
    code, _, err = told.read_text(encoding="utf-8").partition("\n")
    if code != "0":
        raise AssertionError(f"the demo ended with {code}: {err}")
    return folder


def demo_result(kind: str, base: Path) -> Result:
    """Return what the demo printed."""
    folder = finished_demo(kind, base)
    code, _, err = folder.with_suffix(".told").read_text(encoding="utf-8").partition("\n")
    return Result(int(code), "", err)
