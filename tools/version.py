"""The version of a build: that of the tag, of the packed sources, or else the one written here.

Hatchling asks for it (``[tool.hatch.version]`` in pyproject.toml). A release is a tag ``v1.2.3``; a
build three commits later is 1.2.4.dev3 with the commit behind it.
"""

import re
import subprocess
from pathlib import Path

WITHOUT_TAGS = "0.1.0"
"""Of a checkout that has no tags, as CI and `git clone --depth 1` make them, and of a copy."""
_ROOT = Path(__file__).resolve().parents[1]
_DESCRIBED = re.compile(r"v(\d+(?:\.\d+)*)\.(\d+)-(\d+)-(g[0-9a-f]+)")


def version(root: Path = _ROOT) -> str:
    """Return the version of the sources in a folder."""
    packed = root / "PKG-INFO"
    if packed.is_file():
        stated = re.search(r"(?m)^Version: (\S+)", packed.read_text(encoding="utf-8"))
        if stated:
            return stated[1]
    found = _DESCRIBED.fullmatch(_described(root))
    if found is None:
        return WITHOUT_TAGS
    release, patch, commits, commit = found.groups()
    if commits == "0":
        return f"{release}.{patch}"
    return f"{release}.{int(patch) + 1}.dev{commits}+{commit}"


def _described(root: Path) -> str:
    """Return what git says of the last tag; nothing where there is none, or no git."""
    try:
        top, described = (
            subprocess.run(
                ["git", *words], cwd=root, capture_output=True, text=True, timeout=10, check=True
            ).stdout.strip()
            for words in (
                ("rev-parse", "--show-toplevel"),
                ("describe", "--tags", "--long", "--match", "v[0-9]*"),
            )
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    # Sources that were unpacked in the checkout of another project have not its version.
    return described if Path(top).resolve() == root.resolve() else ""
