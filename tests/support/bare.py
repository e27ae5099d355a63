"""Tests run as in a bare install: what the core does not declare, the core does not find.

A package that some tool of ours has brought along (``charset_normalizer`` by the documentation)
must not be what makes a file readable. Whoever belongs to the declared dependencies, or to what
they need themselves, finds only these; tests and their tools find everything.
"""

import sys
import tomllib
from collections.abc import Iterable
from importlib import metadata
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PYPROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
OPTIONAL = frozenset({"cryptography", "dask", "distributed", "openpyxl", "rosbags"})
"""Modules of an extra that elastocal itself looks for, and joblib for it."""


def closure(requirements: Iterable[str]) -> frozenset[str]:
    """Return the distributions that requirements lead to on this machine, by canonical name."""
    found: set[str] = set()
    waiting = [(Requirement(text), "") for text in requirements]
    while waiting:
        requirement, extra = waiting.pop()
        name = canonicalize_name(requirement.name)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": extra}):
            continue
        try:
            needed = metadata.requires(name) or []
        except metadata.PackageNotFoundError:
            continue
        if name in found and not requirement.extras:
            continue
        found.add(name)
        for each in ("", *requirement.extras):
            waiting += [(Requirement(text), each) for text in needed]
    return frozenset(found)


def _modules() -> tuple[frozenset[str], frozenset[str]]:
    """Return the modules of the core's closure, and those of all other distributions."""
    declared = tomllib.loads(PYPROJECT.read_text())["project"]["dependencies"]
    core = closure(declared)
    inside, outside = {"elastocal"}, set()
    for module, owners in metadata.packages_distributions().items():
        owned = {canonicalize_name(owner) for owner in owners} <= core | {"elastocal"}
        # Several may share a name: one of the core's is enough.
        shared = any(canonicalize_name(owner) in core for owner in owners)
        (inside if owned or shared else outside).add(module)
    return frozenset(inside), frozenset(outside - inside - OPTIONAL)


class BareFinder(MetaPathFinder):
    """Finds nothing, but refuses what the core's packages import beyond the core."""

    def __init__(self) -> None:
        # Before it stands in the path: to look for them imports modules.
        self.inside, self.outside = _modules()

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        beyond = name.partition(".")[0] in self.outside
        if beyond and _importer().partition(".")[0] in self.inside:
            raise ModuleNotFoundError(f"No module named {name!r} (bare install)", name=name)
        return None


def _importer() -> str:
    """Return the module whose code imports: the first above the machinery of imports."""
    frame = sys._getframe(2)
    while frame is not None:
        name = frame.f_globals.get("__name__", "")
        if not name.startswith(("importlib", "_frozen_importlib", "lazy_loader")):
            return str(name)
        frame = frame.f_back
    return ""


def forbid() -> None:
    """Let the core's packages find nothing beyond it from now on."""
    if not any(isinstance(finder, BareFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, BareFinder())
