"""The version of a build: from the tag, from packed sources, or the one that stands in the tool."""

import importlib.util
import os
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SPEC = importlib.util.spec_from_file_location("version_of_builds", ROOT / "tools/version.py")
assert SPEC is not None
assert SPEC.loader is not None
tool = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(tool)


@pytest.fixture
def checkout(tmp_path):
    """A repository with one commit, and what runs git in it."""
    told = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
    for who in ("AUTHOR", "COMMITTER"):
        told |= {f"GIT_{who}_NAME": "a", f"GIT_{who}_EMAIL": "a@b"}

    def git(*words: str) -> str:
        done = subprocess.run(
            ["git", *words], cwd=tmp_path, env=told, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    git("init", "-q")
    git("commit", "-q", "--allow-empty", "-m", "one")
    return tmp_path, git


def test_a_checkout_without_tags_has_the_version_of_the_tool(checkout, tmp_path_factory):
    assert tool.version(checkout[0]) == tool.WITHOUT_TAGS
    assert tool.version(tmp_path_factory.mktemp("copy")) == tool.WITHOUT_TAGS


def test_a_tag_is_the_version_and_later_commits_come_before_the_next(checkout):
    folder, git = checkout
    git("tag", "-a", "v1.2.3", "-m", "a release")
    assert tool.version(folder) == "1.2.3"
    git("commit", "-q", "--allow-empty", "-m", "two")
    commit = git("rev-parse", "--short", "HEAD")
    assert tool.version(folder) == f"1.2.4.dev1+g{commit}"


def test_packed_sources_keep_their_version_wherever_they_lie(checkout):
    folder, git = checkout
    git("tag", "v9.9.9")
    inside = folder / "elastocal-0.3.0"
    inside.mkdir()
    assert tool.version(inside) == tool.WITHOUT_TAGS, "the tag is of another project"
    (inside / "PKG-INFO").write_text("Metadata-Version: 2.4\nName: elastocal\nVersion: 0.3.0\n")
    assert tool.version(inside) == "0.3.0"


def test_the_build_asks_the_tool():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    asked = project["tool"]["hatch"]["version"]
    assert asked == {"source": "code", "path": "tools/version.py", "expression": "version()"}
