"""The page on performance has the newest of every benchmark, and nothing typed in."""

import csv
import importlib.util
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture
def hook(tmp_path, monkeypatch):
    path = REPOSITORY / "docs" / "hooks" / "performance.py"
    spec = importlib.util.spec_from_file_location("performance", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_has_the_newest_of_every_figure_beside_its_reference(hook, tmp_path, monkeypatch):
    head = "date,commit,figure,seconds,reference,reference_seconds,aim_seconds\n"
    rows = (
        "2026-01-01,aaa,one fit,0.002,SciPy,0.004,0.001\n"
        "2026-01-02,bbb,help,0.1,Python,0.01,\n"
        "2026-01-03,ccc+,one fit,0.0005,SciPy,0.004,0.001\n"
    )
    monkeypatch.setattr(hook, "HISTORY", tmp_path / "history.csv")
    hook.HISTORY.write_text(head + rows)
    _, _, first, second, _, said = hook.table().splitlines()
    assert first == "| one fit | 500 µs | SciPy, 4 ms | 8 | 1 ms |"
    assert second == "| help | 100 ms | Python, 10 ms | 1/10 |  |"
    assert said == "Measured 2026-01-02 to 2026-01-03."


def test_what_misses_its_aim_says_so(hook, tmp_path, monkeypatch):
    monkeypatch.setattr(hook, "HISTORY", tmp_path / "history.csv")
    hook.HISTORY.write_text(
        "date,commit,figure,seconds,reference,reference_seconds,aim_seconds\n"
        "2026-01-01,aaa,the demo,46.8,,,30\n"
    )
    assert "| 46.8 s |  |  | 30 s: **short** |" in hook.table()


def test_the_page_is_made_of_the_history_that_the_benchmarks_keep(hook):
    page = (REPOSITORY / "docs" / "explanation" / "performance.md").read_text(encoding="utf-8")
    filled = hook.on_page_markdown(page)
    assert filled != page
    with (REPOSITORY / "benchmarks" / "history.csv").open(encoding="utf-8", newline="") as file:
        figures = {row["figure"] for row in csv.DictReader(file)}
    assert len(figures) > 20
    assert all(f"| {name} |" in filled for name in figures)
