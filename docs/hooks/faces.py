"""List in the reference what the face of a package exports, so that neither can get ahead.

A comment ``<!-- face: elastocal.codec -->`` in a page of the reference is replaced by an entry for
each name that the package exports from its own modules and no page shows yet. A package whose face
would be a very long page is shown in parts: ``<!-- face: elastocal.workflows of plan -->`` has
the names of these modules, and the comment without modules the rest.
"""

import ast
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

SOURCE = Path(__file__).resolve().parents[2] / "src"
MARK = re.compile(r"<!-- face: (elastocal[\w.]*) -->")
PART = re.compile(r"<!-- face: (elastocal[\w.]*) of ([\w ]+) -->")
PAGES = Path(__file__).resolve().parents[1] / "reference" / "api"
_BLOCK = re.compile(r"^::: (elastocal[\w.]*)\n((?:[ ].*\n|\n)*)", flags=re.MULTILINE)
_ENTRY = re.compile(r"^::: elastocal[\w.]*\.(\w+)$", flags=re.MULTILINE)
_MEMBER = re.compile(r"^\s+- (\w+)$", flags=re.MULTILINE)


def exported(package: str) -> dict[str, str]:
    """Return the names that a package exports, each with the module below it that has it."""
    stub = SOURCE.joinpath(*package.split("."), "__init__.pyi")
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    return {
        alias.name: node.module or ""
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


@cache
def defined(package: str, home: str) -> set[str]:
    """Return the names that a module of a package defines; none of a package's own face."""
    path = SOURCE.joinpath(*package.split("."), *home.split(".")).with_suffix(".py")
    if not path.is_file():
        return set()
    names: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names.update(each.id for each in targets if isinstance(each, ast.Name))
    return names


def shown(markdown: str) -> set[str]:
    """Return the names that a page shows."""
    return {*_ENTRY.findall(markdown), *_MEMBER.findall(markdown)}


def shown_elsewhere(page: str) -> set[str]:
    """Return what other pages of the reference show: entries, and members of modules."""
    return {
        f"{entry}.{member}" if member else entry
        for path in PAGES.glob("*.md")
        if path.name != page
        for entry, options in _BLOCK.findall(path.read_text(encoding="utf-8"))
        for member in ("", *_MEMBER.findall(options))
    }


def shown_whole() -> set[str]:
    """Return the modules that pages of the reference show with all their names."""
    return {
        path
        for page in PAGES.glob("*.md")
        for path, options in _BLOCK.findall(page.read_text(encoding="utf-8"))
        if not _MEMBER.search(options)
    }


def parted(package: str) -> set[str]:
    """Return the modules of a package that pages of their own show."""
    return {
        module
        for path in PAGES.glob("*.md")
        for whole, modules in PART.findall(path.read_text(encoding="utf-8"))
        if whole == package
        for module in modules.split()
    }


def functions_first(entry: tuple[str, str]) -> tuple[bool, str]:
    """Return where a name stands: functions before the records that they take and return."""
    return entry[0][0].isupper(), entry[0]


def absent(markdown: str) -> list[str]:
    """Return the names that a page lists of modules that do not have them: nothing shows those."""
    found = []
    for path, options in _BLOCK.findall(markdown):
        package, _, module = path.rpartition(".")
        is_package = SOURCE.joinpath(*path.split("."), "__init__.pyi").is_file()
        names = exported(path) if is_package else defined(package, module)
        listed = _MEMBER.findall(options) if names else ()
        found += [f"{path}.{name}" for name in listed if name not in names]
    return found


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Return the page with an entry for every exported name.

    Raises
    ------
    PluginError
        If the page lists a name that its module does not have.
    """
    if not page.file.src_uri.startswith("reference/api/"):
        return markdown
    if names := absent(markdown):
        raise PluginError(f"{page.file.src_uri} lists what is not there: {', '.join(names)}")
    known, elsewhere = shown(markdown), shown_elsewhere(Path(page.file.src_uri).name)
    whole = shown_whole()

    def entries(package: str, wanted: Callable[[str], bool]) -> str:
        # What comes from another package's face has its entry there.
        rest = {
            name: home
            for name, home in exported(package).items()
            if wanted(home)
            and name not in known
            and elsewhere.isdisjoint((f"{package}.{name}", f"{package}.{home}.{name}"))
            and f"{package}.{home}" not in whole
            and name in defined(package, home)
        }
        # A function called like its module would show the module.
        paths = (
            f"{package}.{home}.{name}" if name == home else f"{package}.{name}"
            for name, home in sorted(rest.items(), key=functions_first)
        )
        return "\n\n".join(f"::: {path}\n    options:\n      heading_level: 3" for path in paths)

    def others(package: str) -> str:
        in_parts = parted(package)
        return entries(package, lambda home: home not in in_parts)

    markdown = PART.sub(lambda part: entries(part[1], part[2].split().__contains__), markdown)
    return MARK.sub(lambda mark: others(mark[1]), markdown)
