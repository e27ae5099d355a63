"""Time what users wait for beside the commit before, command by command, in turns.

The earlier commit is checked out beside this one, and both run the same commands on the same files,
which the earlier one made. They take turns, and processor times are compared, so that what else the
machine does meets both. Run with ``python benchmarks/paired.py [COMMIT]``; the default is the last
commit of an earlier day. Exits with 1 where a command has become slower beyond doubt.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
ROUNDS = 5
SLOWER = 1.1
"""Ratio of processor times that is looked into; below it a commit may cost what it brings."""
MADE: tuple[tuple[str, ...], ...] = (
    ("init", "cell", "--like", "afp"),
    ("plan", "cell/cell.yaml", "--out", "plan"),
    ("run", "cell/cell.yaml", "--plan", "plan", "--out", "run", "--seed", "0"),
)
TIMED: tuple[tuple[str, ...], ...] = (
    ("--help",),
    ("plan", "cell/cell.yaml", "--out", "out/plan", "--force"),
    ("calibrate", "run/dataset.nc", "--out", "out/model.json", "--force"),
    ("codec", "run/dataset.nc", "--compare", "springs=bearing", "--out", "out/codec", "--force"),
    ("tool", "run", "--out", "out/tool.json", "--force"),
)


def git(*words: str) -> str:
    """Return what git says of this repository."""
    said = subprocess.run(
        ["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True
    )
    return said.stdout.strip()


def earlier() -> str:
    """Return the last commit of an earlier day."""
    found = git("rev-list", "-1", f"--before={datetime.now(tz=UTC).date()}T00:00Z", "HEAD")
    if not found:
        sys.exit("no commit of an earlier day: name one, paired.py COMMIT")
    return found


def seconds(source: Path, words: Sequence[str], folder: Path) -> float:
    """Return the processor time of a command by the package in a folder, in s."""
    before = os.times()
    done = subprocess.run(
        [sys.executable, "-m", "elastocal", *words], cwd=folder, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    if done.returncode:
        sys.exit(f"elastocal {' '.join(words)}, of {source}: {done.stderr.strip()}")
    after = os.times()
    return (after.children_user - before.children_user) + (
        after.children_system - before.children_system
    )


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> tuple[float, float, float]:
    """Return the median ratio of times taken in turns, and its 95 % interval by resampling."""
    each = np.array(ours) / np.array(theirs)
    drawn = np.random.default_rng(0).choice(each, (2000, len(each)))
    low, high = np.quantile(np.median(drawn, axis=1), [0.025, 0.975])
    return float(np.median(each)), float(low), float(high)


def main() -> None:
    """Measure and print."""
    commit = git("rev-parse", sys.argv[1]) if len(sys.argv) > 1 else earlier()
    print(f"processor time of {git('describe', '--always', '--dirty=+')} over that of {commit[:8]}")
    slower = []
    with tempfile.TemporaryDirectory() as name:
        folder, other = Path(name), Path(name) / "earlier"
        git("worktree", "add", "--quiet", "--detach", str(other), commit)
        try:
            for words in MADE:
                seconds(other / "src", words, folder)
            for words in TIMED:
                for source in (ROOT, other):
                    seconds(source / "src", words, folder)  # not counted: files are compiled
                turns = [
                    [seconds(source / "src", words, folder) for source in (ROOT, other)]
                    for _ in range(ROUNDS)
                ]
                ours, theirs = zip(*turns, strict=True)
                middle, low, high = ratio(ours, theirs)
                beyond = low > SLOWER
                slower += [words[0]] if beyond else []
                print(
                    f"  {words[0]:>10}: {np.median(ours):6.2f} s, ratio {middle:.2f}"
                    f" ({low:.2f} to {high:.2f}){': slower' if beyond else ''}",
                    flush=True,
                )
        finally:
            git("worktree", "remove", "--force", str(other))
    if slower:
        sys.exit(f"slower than {commit[:8]}: {', '.join(slower)}")


if __name__ == "__main__":
    main()
