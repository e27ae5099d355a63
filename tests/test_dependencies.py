"""Dependencies: bounds that are tested, versions that developers share, licences that are known."""

import re
import runpy
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
LOCK = (ROOT / "requirements" / "dev.lock").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
HOOK = runpy.run_path(str(ROOT / "docs" / "hooks" / "licences.py"))
LOCKED = [
    Requirement(re.sub(r"\s*\\\n.*", "", block, flags=re.DOTALL))
    for block in re.split(r"\n(?=[\w.-]+==)", LOCK)[1:]
]


def test_the_lock_holds_every_package_that_developers_need_within_its_bounds():
    extras = PROJECT["optional-dependencies"]
    for text in [*PROJECT["dependencies"], *extras["dev"], *extras["docs"]]:
        wanted = Requirement(text)
        found = [
            next(iter(each.specifier)).version
            for each in LOCKED
            if canonicalize_name(each.name) == canonicalize_name(wanted.name)
        ]
        assert found, f"{wanted.name} is not locked: make lock"
        assert all(wanted.specifier.contains(version) for version in found), wanted.name


def test_every_locked_package_has_its_hashes():
    for block in re.split(r"\n(?=[\w.-]+==)", LOCK)[1:]:
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
