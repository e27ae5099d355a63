"""Print the mutants that no test noticed after ``mutmut run``, as diffs, harmless kinds as counts.

The kinds and their reasons stand in CONTRIBUTING.md, "Mutation testing".
"""

import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

MUTMUT = Path(sys.executable).parent / "mutmut"
HARMLESS = {
    "strict= of a zip of equal lengths": re.compile(r",? ?strict=\w+|, ?(?=\))"),
    "dtype= that NumPy finds by itself": re.compile(r",? ?dtype=[\w.]+|, ?(?=\))"),
    "text of an error or a remark": re.compile(r"(Error|remark)\(.*\)$|^f?\".*\"$"),
}
"""What two lines may differ in, by kind."""


def mutmut(*arguments: str) -> str:
    """Return what a command of mutmut prints."""
    found = subprocess.run([MUTMUT, *arguments], capture_output=True, text=True, check=True)
    return found.stdout


def changed(diff: str) -> tuple[str, str]:
    """Return the lines that a diff takes away and those that it adds."""
    lines = [line for line in diff.splitlines() if not line.startswith(("---", "+++", "@@", "#"))]
    before, after = ([line[1:].strip() for line in lines if line[:1] == sign] for sign in "-+")
    return " ".join(filter(None, before)), " ".join(filter(None, after))


def harmless(before: str, after: str) -> str | None:
    """Return the kind of a mutant that changes nothing which matters."""
    for kind, part in HARMLESS.items():
        if part.sub("", before) == part.sub("", after):
            return kind
    return None


def main() -> None:
    """Print counts, survivors, and how many are harmless by kind."""
    tried = re.findall(r"^ +(\S+): (.+)$", mutmut("results", "--all", "true"), re.MULTILINE)
    states = Counter(state for _, state in tried if state != "not checked")
    print(", ".join(f"{count} {state}" for state, count in states.most_common()))
    kinds: Counter[str] = Counter()
    for name, state in tried:
        if state in ("killed", "not checked"):
            continue
        before, after = changed(mutmut("show", name))
        kind = harmless(before, after)
        if kind:
            kinds[kind] += 1
        else:
            print(f"\n{name}: {state}\n  - {before}\n  + {after}")
    print()
    for kind, count in kinds.most_common():
        print(f"{count:5d}  {kind}")


if __name__ == "__main__":
    main()
