"""Examples in docstrings write files: each of them runs in an empty folder of its own."""

import pytest


@pytest.fixture(autouse=True)
def _in_an_empty_folder(request, monkeypatch, tmp_path_factory):
    if isinstance(request.node, pytest.DoctestItem):
        monkeypatch.chdir(tmp_path_factory.mktemp("example"))
