"""Examples in docstrings write files: each of them runs in an empty folder of its own."""

import pytest


@pytest.fixture(autouse=True)
def _in_an_empty_folder(request, monkeypatch, tmp_path_factory):
    if isinstance(request.node, pytest.DoctestItem):
        monkeypatch.chdir(tmp_path_factory.mktemp("example"))
        # Simulated campaigns are made once for all examples, and not in the user's folder.
        cache = str(tmp_path_factory.getbasetemp() / "cache")
        for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
            monkeypatch.setenv(name, cache)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Leave to the night what plans or cross-validates first: seconds of processor each."""
    for item in items:
        if isinstance(item, pytest.DoctestItem) and any(
            name in example.source
            for example in item.dtest.examples
            for name in ("ec.plan(", "ec.plan_pair(", "ec.codec(", "ec.datasets.afp_run(")
        ):
            item.add_marker(pytest.mark.slow)
