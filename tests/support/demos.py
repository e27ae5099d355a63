"""A finished demo, made once for as long as the code stays as it is."""

from functools import partial
from pathlib import Path

from support.cli import Result, elastocal
from support.kept import kept


def finished_demo(kind: str) -> Path:
    """Return the folder of the demo ``afp`` or ``machining``; do not write into it."""
    folder = kept(f"demo-{kind}", _MAKERS[kind])
    code, _, err = (folder / "told").read_text(encoding="utf-8").partition("\n")
    if code != "0":
        raise AssertionError(f"the demo ended with {code}: {err}")
    return folder / "demo"


def demo_result(kind: str) -> Result:
    """Return what the demo printed."""
    told = finished_demo(kind).with_name("told").read_text(encoding="utf-8")
    code, _, err = told.partition("\n")
    return Result(int(code), "", err)


def _make(kind: str, folder: Path) -> None:
    result = elastocal("demo", kind, "--out", folder / "demo")
    (folder / "told").write_text(f"{result.code}\n{result.err}", encoding="utf-8")


_MAKERS = {kind: partial(_make, kind) for kind in ("afp", "machining")}
