"""What the demo does: public commands, in the order of the work."""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path

from elastocal.cell.examples import check_like
from elastocal.files import read_text


@dataclass(frozen=True)
class Chapter:
    """A command of the story."""

    title: str
    """What is done, for a person who watches."""
    words: tuple[str, ...]
    """The command's words, without the program's name."""

    @property
    def line(self) -> str:
        """The command as one would type it."""
        return shlex.join(("elastocal", *self.words))


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
    check_like(kind)
    cell, data, model, tool = (
        str(out / name) for name in ("cell.yaml", "run/dataset.nc", "model.json", "tool.json")
    )

    def codec(key: str, values: str) -> tuple[str, ...]:
        where = str(out / "codec" / key)
        return ("codec", data, "--compare", f"{key}={values}", "--out", where)

    def to(name: str) -> tuple[str, str]:
        return "--out", str(out / name)

    at, known = ("--seed", str(seed)), ("--model", model, "--tool", tool)
    return (
        Chapter("describe the cell", ("init", str(out), "--like", kind, "--force")),
        Chapter("plan the poses", ("plan", cell, *to("plan"))),
        Chapter("measure", ("run", cell, "--plan", str(out / "plan"), *to("run"), *at)),
        Chapter("identify the springs", ("calibrate", data, *to("model.json"))),
        Chapter("weigh the tool", ("tool", str(out / "run"), *to("tool.json"))),
        Chapter("were there enough poses", codec("springs", "actuated,bearing")),
        Chapter("did the load cases help", codec("load_cases", "normal,all")),
        Chapter("did the search help", codec("search", "cover,ioops")),
        Chapter(
            "correct in real time",
            ("simulate-process", cell, *known, "--process", kind, *at, *to("process")),
        ),
        Chapter(
            "correct offline",
            ("compensate", model, str(out / "process/path.csv"), *to("corrected.csv")),
        ),
        Chapter("write C for the robot", ("export", model, "--tool", tool, "--c", str(out / "c"))),
        Chapter("report", ("report", str(out), *to("report.html"))),
    )


def closing_lines(out: Path) -> tuple[str, ...]:
    """Return what a person who has watched the demo wants to know."""
    line = json.loads(read_text(out / "process/table.json"))["lines"][-1]
    before, after, share = line["before"], line["after"], line["reduction"]
    return (
        f"mean deviation on the process path: {1e3 * before['mean']:.3f} mm before,"
        f" {1e3 * after['mean']:.3f} mm after correction (-{100 * share['mean']:.1f} %);"
        f" largest {1e3 * before['max']:.3f} mm, then {1e3 * after['max']:.3f} mm",
        f"open {out / 'report.html'} in a browser; {out / 'README.md'} says what each file is",
    )
