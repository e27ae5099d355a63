"""Parts of the suite that can be run alone: units, whole commands and pages, the browser."""

import gc
import os
from functools import cache
from pathlib import Path

import pytest

from support import bare
from support.processors import imitate_one

# Collecting ten thousand tests makes no garbage and is a third quicker when none is looked for.
gc.disable()
bare.forbid()
CORE_TYPE = imitate_one()

# NumPy comes with these.
from elastocal import locks  # noqa: E402
from support import remembered  # noqa: E402

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
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")


@pytest.fixture(autouse=True, scope="session")
def _locks_of_this_process(tmp_path_factory):
    """Keep the locks of devices apart from those of other suites on this machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(locks, "SHARED", tmp_path_factory.mktemp("locks") / "shared")
        yield


@pytest.fixture(autouse=True, scope="session")
def _what_verdicts_make_again():
    with pytest.MonkeyPatch.context() as patch:
        remembered.remember(patch)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector):
    """Let each worker collect a part of its own first: what one rewrites, the others read."""
    report = yield
    if WORKER and collector.path == TESTS:
        found, workers = report.result, int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
        number = int(WORKER.removeprefix("gw"))
        first, end = (len(found) * part // workers for part in (number, number + 1))
        # The others' parts from their ends, or two would go on side by side.
        report.result = [*found[first:end], *reversed([*found[end:], *found[:first]])]
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if WORKER:  # all of them in one order again
        items.sort(key=lambda item: (not item.path.is_relative_to(TESTS), item.path.parts))
    for item in items:
        if not item.path.is_relative_to(TESTS):
            continue
        named = item.path.name in BROWSER or "in_a_browser" in item.name
        if named or "browser" in item.fixturenames:
            item.add_marker("browser")
        elif _is_end_to_end(item.path):
            item.add_marker("end_to_end")


def pytest_collection_finish():
    """Look for garbage again, and never among what was collected: it stays to the end.

    By default it is looked for after 700 new objects, which took up to a sixth of some files.
    """
    gc.freeze()
    gc.set_threshold(100_000, 20, 50)
    gc.enable()


@cache
def _is_end_to_end(path: Path) -> bool:
    place = path.relative_to(TESTS)
    return any(place.is_relative_to(part) for part in END_TO_END)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item):
    """Say with a failure whose rounding it met."""
    report = yield
    if report.failed and CORE_TYPE:
        report.sections.append(("processor", f"{item.nodeid}: OPENBLAS_CORETYPE={CORE_TYPE}"))
    return report
