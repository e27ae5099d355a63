"""The demo from its first command to its report, as ``make demo`` runs it, without installation."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from timing import figure

_IMPORTS = "import numpy, scipy.optimize, matplotlib.pyplot, xarray"


def whole(*words: str) -> float:
    """Return the time of a program in s."""
    start = time.perf_counter()
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        command = (sys.executable, "-m", "elastocal", "demo", "afp", "--out", f"{folder}/demo")
        bare = whole(sys.executable, "-c", _IMPORTS)
        figure("the demo, all its commands", whole(*command), ("importing its libraries", bare), 30)
        size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
        print(f"  it writes {size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
