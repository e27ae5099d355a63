"""Every script of examples/ runs as a user would run it, and says what it should.

Notebooks of the documentation, too, import only what the reference lists; what else is asked of
them stands in ``test_notebooks.py``.
"""

import ast
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("[!i]*.md"))
LONGEST = 100
"""Lines."""

TOLD = {
    "01_springs_and_deflection.py": (r"deflection \[\S+ \S+ (\S+)\] mm", 0.5, 3.0),
    "02_observability.py": (r"rank (\d+) of 14, every spring observable: True", 14, 14),
    "03_calibrate.py": (r"error at left-out poses: (\S+) mm", 0.04, 0.12),
    "04_predict.py": (r"interval of the measurement .* holds +(\d+) %", 95, 100),
    "05_choose_poses.py": (r"COVER needs (\d+) poses", 25, 36),
    "06_plan_a_cell.py": (r"covering radius (\d+) mm", 150, 400),
    "07_how_many_poses.py": (r"bearing +(?:\d+ +)*(\d+)\n", 40, 90),
    "08_tool_weight.py": (r"mass +(\S+) kg", 59.8, 60.2),
    "09_online_compensator.py": (r"0\.356 s +1100 N +-(\S+) mm +OK", 0.5, 3.0),
    "10_offline_correction.py": (r"corrected +(\S+) mm mean", 0.001, 0.1),
    "11_own_springs.py": (r"difference (\S+) µm", 1.0, 30.0),
    "12_own_search_technique.py": (r"median +(?:\d+ +)*(\d+)\n", 40, 90),
    "13_raw_streams.py": (r"normal +\d+ .* N +(\S+) mm", 2.5, 4.0),
    "14_sensor_logs.py": (r"error at left-out poses: (\S+) mm", 0.01, 0.1),
    "15_import_logs.py": (r"marker displacements differ by (\S+) µm", 0.1, 3.0),
}
"""Of each example: what is looked for in its output, and the range of the number found."""


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs_cleanly_and_prints_the_number_that_it_is_about(path, tmp_path):
    here, out, temporary = (tmp_path / name for name in ("here", "out", "temporary"))
    here.mkdir()
    temporary.mkdir()
    finished = subprocess.run(
        [sys.executable, "-W", "error", str(path), str(out)],
        cwd=here, env=os.environ | {"TMPDIR": str(temporary)},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert (finished.returncode, finished.stderr) == (0, "")
    pattern, low, high = TOLD[path.name]
    found = re.search(pattern, finished.stdout)
    assert found, finished.stdout
    assert low <= float(found[1]) <= high
    assert_finite(finished.stdout)
    # It writes nowhere but where it was told to.
    assert not [*here.iterdir(), *temporary.iterdir()]
    assert out.exists() == ("tempfile" in path.read_text(encoding="utf-8"))


def assert_finite(text):
    """Fail when a number is missing or none is told."""
    words = re.findall(r"[\w.+-]+", text)
    assert len([word for word in words if re.fullmatch(r"-?\d+(\.\d*)?(e-?\d+)?", word)]) >= 4
    assert not {"nan", "inf", "-inf"} & set(words)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_is_short_and_says_what_one_learns(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < LONGEST
    assert "You learn" in (ast.get_docstring(ast.parse(text)) or "")


def test_every_example_is_in_the_table_and_in_the_tests():
    names = {path.name for path in EXAMPLES}
    text = (ROOT / "examples/README.md").read_text(encoding="utf-8")
    assert len(names) >= 10
    assert set(re.findall(r"^\| \[(\S+\.py)\]\(\1\)", text, flags=re.MULTILINE)) == names
    assert set(TOLD) == names


def python_of(path):
    """Return the Python of a script, or of a page."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return text
    return "".join(re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL))


@pytest.mark.parametrize("path", EXAMPLES + NOTEBOOKS, ids=lambda path: path.name)
def test_an_example_imports_only_what_the_reference_lists(path, reference):
    missing = [
        f"{node.module}.{alias.name}"
        for node in ast.walk(ast.parse(python_of(path)))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("elastocal")
        for alias in node.names
        if not listed(f"{node.module}", alias.name, reference)
    ]
    assert not missing


@pytest.fixture(scope="module")
def reference():
    """Return the dotted names of everything that the API pages show."""
    shown: set[str] = set()
    for page in (ROOT / "docs/reference/api").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        for name, options in re.findall(r"^::: (\S+)\n((?:(?: .*)?\n)*)", text, flags=re.MULTILINE):
            shown.add(name)
            members = re.findall(r"^ +- (\w+)$", options, flags=re.MULTILINE)
            shown |= {f"{name}.{member}" for member in members or public_names(name)}
    assert len(shown) > 200
    return shown


def public_names(name: str) -> list[str]:
    """Return what a module defines for others; nothing for a class or a function."""
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError:
        return []
    own = (key for key, value in vars(module).items() if getattr(value, "__module__", "") == name)
    return list(getattr(module, "__all__", own))


def listed(module: str, name: str, reference: set[str]) -> bool:
    """Return whether a name of a module, or of one below it, is shown."""
    return any(each.startswith(f"{module}.") and each.endswith(f".{name}") for each in reference)
