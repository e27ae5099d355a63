"""Parts of the suite that can be run alone: units, whole commands and pages, the browser."""

from pathlib import Path

import pytest

from support import bare

bare.forbid()

TESTS = Path(__file__).parent
# A program of its own, which ends where Atheris is not installed.
collect_ignore = ["fuzz/lines.py"]
END_TO_END = (
    "cli",
    "fuzz",
    "end_to_end",
    "report/document",
    "verdict",
    "contracts/test_report_sections.py",
    "contracts/test_workflow_results.py",
    "test_examples.py",
    "test_readme.py",
)
"""Where tests run whole commands or build whole documents."""
BROWSER = ("test_in_a_browser.py",)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if not item.path.is_relative_to(TESTS):
            continue
        place = item.path.relative_to(TESTS)
        if place.name in BROWSER or "browser" in item.fixturenames or "in_a_browser" in item.name:
            item.add_marker("browser")
        elif any(place.is_relative_to(part) for part in END_TO_END):
            item.add_marker("end_to_end")
