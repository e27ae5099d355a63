"""Dependencies: bounds that are tested, versions that developers share, licences that are known."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
LOCKS = {"dev": ("dev", "docs"), "user": ()}
"""Files of locked versions with the extras that each holds."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
HOOK = runpy.run_path(str(ROOT / "docs" / "hooks" / "licences.py"))


def blocks(lock: str) -> list[str]:
    """Return what a lock says of each package."""
    text = (ROOT / "requirements" / f"{lock}.lock").read_text(encoding="utf-8")
    return re.split(r"(?m)^(?=[\w.-]+==)", text)[1:]


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_holds_every_package_that_is_needed_within_its_bounds(lock):
    locked = [
        Requirement(re.sub(r"\s*\\\n.*", "", block, flags=re.DOTALL)) for block in blocks(lock)
    ]
    extras = [PROJECT["optional-dependencies"][name] for name in LOCKS[lock]]
    for text in [*PROJECT["dependencies"], *(each for extra in extras for each in extra)]:
        wanted = Requirement(text)
        found = [
            next(iter(each.specifier)).version
            for each in locked
            if canonicalize_name(each.name) == canonicalize_name(wanted.name)
        ]
        assert found, f"{wanted.name} is not locked: make lock"
        assert all(wanted.specifier.contains(version) for version in found), wanted.name


@pytest.mark.parametrize("lock", LOCKS)
def test_every_locked_package_has_its_hashes(lock):
    for block in blocks(lock):
        assert "--hash=sha256:" in block


@pytest.mark.parametrize("name", HOOK["runtime"]())
def test_the_licence_of_every_package_at_run_time_is_a_known_free_one(name):
    assert HOOK["licence_of"](name) is not None


def test_the_documentation_lists_the_licences():
    page = (ROOT / "docs" / "explanation" / "dependencies.md").read_text(encoding="utf-8")
    assert HOOK["MARK"] in page
    assert "| `numpy` |" in HOOK["on_page_markdown"](page)


def test_every_run_time_dependency_has_a_lowest_version_that_the_nightly_run_tries():
    for text in PROJECT["dependencies"]:
        operators = {each.operator for each in Requirement(text).specifier}
        assert operators == {">="}, text
    assert "--resolution lowest-direct" in (ROOT / "Makefile").read_text(encoding="utf-8")
