"""Packages of others with entry points, as an installation leaves them."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples" / "plugins"
NAMES = sorted(each.name for each in EXAMPLES.iterdir() if (each / "pyproject.toml").exists())


def describe(folder: Path, name: str, entries: Mapping[str, Mapping[str, str]]) -> Path:
    """Write what an installation writes of a distribution, its entry points by their group."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [
        f"[{group}]\n" + "".join(f"{entry} = {place}\n" for entry, place in named.items())
        for group, named in entries.items()
    ]
    (info / "entry_points.txt").write_text("".join(lines))
    return folder


def example(folder: Path, name: str) -> list[str]:
    """Return the folders that belong on the path of Python where an example is installed."""
    project = tomllib.loads((EXAMPLES / name / "pyproject.toml").read_text("utf-8"))["project"]
    return [str(describe(folder, name, project["entry-points"])), str(EXAMPLES / name)]
