"""The demo from its first command to its report, as ``make demo`` runs it, without installation."""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from timing import figure

_IMPORTS = "import numpy, scipy.optimize, matplotlib.pyplot, xarray"


_CHAPTER = re.compile(r"(?m)^\d+ of \d+  .*: elastocal (\S+) .*\n +([\d.]+) s$")
_LARGE = 0.05
"""Part of the whole from which a command has a figure of its own."""


def whole(*words: str) -> tuple[float, str]:
    """Return the time of a program in s, and what it says of its progress."""
    start = time.perf_counter()
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    return time.perf_counter() - start, done.stderr


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        command = (sys.executable, "-m", "elastocal", "demo", "afp", "--out", f"{folder}/demo")
        bare, _ = whole(sys.executable, "-c", _IMPORTS)
        taken, said = whole(*command)
        figure("the demo, all its commands", taken, ("importing its libraries", bare), 30)
        chapters: dict[str, float] = {}
        for name, seconds in _CHAPTER.findall(said):
            chapters[name] = chapters.get(name, 0.0) + float(seconds)
        for name, spent in chapters.items():
            if spent > _LARGE * taken:
                figure(f"the demo: all of `elastocal {name}`", spent, ("the demo", taken))
        size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
        print(f"  it writes {size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
