"""List the licences of what elastocal brings along, as the installed packages state them.

The comment ``<!-- licences -->`` in a page is replaced by a table: every distribution that the
declared dependencies lead to on the machine where the pages are built, with version and licence.
"""

import re
import runpy
import tomllib
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MARK = "<!-- licences -->"
FREE = {
    "0BSD": "0BSD",
    "Apache": "Apache-2.0",
    "BSD": "BSD",
    "BSL-1.0": "BSL-1.0",
    "CC0": "CC0-1.0",
    "ISC": "ISC",
    "MIT": "MIT",
    "Modified BSD": "BSD",
    "PSF": "PSF-2.0",
    "Python Software Foundation": "PSF-2.0",
    "Zlib": "Zlib",
}
"""Licences that a user may ship with a product, by how metadata begin to name them."""
STATED = {"cmeel-qhull": "Qhull", "embreex": "BSD"}
"""Licences of distributions whose metadata name none: from their sources."""


def runtime() -> list[str]:
    """Return the distributions that the declared dependencies lead to, by name."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    # The one list of what belongs to a bare install is that of the tests.
    closure = runpy.run_path(str(ROOT / "tests" / "support" / "bare.py"))["closure"]
    return sorted(closure(declared))


def licence_of(name: str) -> str | None:
    """Return the licence of an installed distribution; None where it is not a known free one."""
    if name in STATED:
        return STATED[name]
    stated = metadata.metadata(name)
    if expression := stated.get("License-Expression"):
        parts = re.split(r"\s+(?:AND|OR)\s+|[()]", expression)
        known = all(_known(part) for part in parts if part)
        return expression if known else None
    kinds = [each for each in stated.get_all("Classifier") or [] if each.startswith("License ::")]
    texts = [each.rpartition(" :: ")[2] for each in kinds] or [stated.get("License") or ""]
    names = [_known(text.strip()) for text in texts]
    return " and ".join(filter(None, names)) if all(names) else None


def _known(text: str) -> str | None:
    return next((name for start, name in FREE.items() if text.startswith(start)), None)


def table() -> str:
    """Return the table of all licences, in Markdown."""
    rows = [
        f"| `{name}` | {metadata.version(name)} | {licence_of(name) or 'not known'} |"
        for name in runtime()
    ]
    return "\n".join(["| package | version | licence |", "|---|---|---|", *rows])


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return the page with the table in it."""
    return markdown.replace(MARK, table()) if MARK in markdown else markdown
