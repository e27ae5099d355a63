"""The map of CONTRIBUTING.md is true: its layers, and where it says that a new variant goes."""

import re
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "elastocal"
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
HEADS = ("kind", "new file", "registered in", "contract test")
QUOTED = re.compile(r"`([^`]+)`")
SUFFIXES = (".py", ".pyi", ".yaml", ".toml", "/")
NOTHING = "–"
EXPORT = re.compile(r"^from \.(\w+) import", flags=re.MULTILINE)


class Registration(NamedTuple):
    """A file that a variant is entered in."""

    path: str
    symbol: str | None
    """The registry in it; None for a face, which exports."""


class Row(NamedTuple):
    """A kind of variant."""

    kind: str
    new: str
    registered: str
    test: str

    @property
    def paths(self) -> list[str]:
        """The files that are new or get the new function."""
        return [quoted for quoted in QUOTED.findall(self.new) if is_path(quoted)]

    @property
    def registrations(self) -> list[Registration]:
        """The files that name it, with their registries."""
        found, symbol = [], None
        for quoted in QUOTED.findall(self.registered):
            if is_path(quoted):
                found.append(Registration(quoted, symbol))
                symbol = None
            else:
                symbol = quoted
        assert symbol is None, f"{self.kind}: {symbol} is in no file"
        return found

    @property
    def touched(self) -> set[str]:
        """Every file that one touches, beside tests and docs."""
        return {*self.paths, *(each.path for each in self.registrations)}


def is_path(quoted: str) -> bool:
    return "/" in quoted or quoted.endswith(SUFFIXES)


def rows() -> list[Row]:
    _, _, after = PAGE.partition(f"| {' | '.join(HEADS)} |\n")
    lines = after.partition("\n\n")[0].splitlines()[1:]
    return [Row(*(cell.strip() for cell in line.strip("|").split(" | "))) for line in lines]


ROWS = rows()


def resolve(path: str) -> Path:
    return ROOT / path if path == "pyproject.toml" else SOURCE / path


def layers() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted, *_ = project["tool"]["importlinter"]["contracts"]
    return [layer.replace("elastocal.", "") for layer in wanted["layers"]]


def test_the_layers_are_those_that_are_enforced():
    block = PAGE.partition("```text\n")[2].partition("```")[0]
    packages = r"\w+(?: \| \w+)*"
    assert [re.match(packages, line)[0] for line in block.splitlines()] == layers()


def test_the_table_has_the_kinds_that_a_contributor_may_want():
    kinds = " ".join(row.kind for row in ROWS)
    for wanted in ("spring", "layout", "search technique", "criterion", "check", "filter",
                   "devices", "controller program", "process", "report section", "command",
                   "kind of file", "loss", "mistake", "inverse", "catalogue"):  # fmt: skip
        assert wanted in kinds


def test_every_contract_suite_has_a_row():
    named = {path for row in ROWS for path in QUOTED.findall(row.test)}
    suites = {f"tests/contracts/{path.name}" for path in ROOT.glob("tests/contracts/test_*.py")}
    # What every public object, every call and every result keeps is no matter of a kind.
    general = {"test_names.py", "test_outputs.py", "test_public_objects.py"}
    general |= {"test_commands.py", "test_workflow_calls.py", "test_workflow_results.py"}
    assert suites - {f"tests/contracts/{name}" for name in general} <= named


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.kind)
class TestEveryRow:
    def test_there_is_a_place_for_the_new_file(self, row):
        assert row.paths
        # A package of a new layer is announced among the layers.
        announced = any(each.path == "pyproject.toml" for each in row.registrations)
        for path in row.paths:
            place = resolve(path)
            if "NAME" not in path:
                assert place.is_file(), path
            else:
                assert not place.exists(), path
                assert place.parent.is_dir() or announced, path

    def test_what_it_is_registered_in_names_the_registry(self, row):
        assert row.registrations or row.registered == NOTHING
        for path, symbol in row.registrations:
            text = resolve(path).read_text(encoding="utf-8")
            if symbol is None:
                assert path.endswith("__init__.pyi"), f"{path}: which registry?"
                assert EXPORT.search(text), path
            else:
                defined = rf"^(def |class )?{symbol}\b(?=\(|:| =)"
                assert re.search(defined, text, flags=re.MULTILINE), f"{symbol} in {path}"

    def test_its_face_is_that_of_the_new_file(self, row):
        folders = {resolve(path).parent for path in row.paths}
        for path, symbol in row.registrations:
            if symbol is None:
                face = resolve(path).parent
                assert any(folder.is_relative_to(face) for folder in folders), path

    def test_its_contract_test_is_collected(self, row):
        (path,) = QUOTED.findall(row.test)
        test = ROOT / path
        assert test.is_relative_to(ROOT / "tests")
        assert test.name.startswith("test_")
        assert re.search(r"^\s*def test_\w+\(", test.read_text(encoding="utf-8"), re.MULTILINE)

    def test_few_files_are_touched(self, row):
        assert len(row.touched) <= (4 if "input file" in row.kind else 3)
