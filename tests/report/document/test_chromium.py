"""Browsers that do not behave; those that do are in `test_in_a_browser`."""

import pytest

from elastocal.errors import FileAccessError
from elastocal.report.document import chromium, write_pdf


@pytest.fixture
def browser(tmp_path):
    """Return a function that makes a program which passes for a browser."""

    def make(script):
        path = tmp_path / "chromium"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        return str(path)

    return make


def printed(tmp_path, browser):
    page = tmp_path / "page.html"
    page.write_text('<html data-ready="yes"></html>')
    return write_pdf(page, tmp_path / "page.pdf", browser)


def test_one_that_never_answers_is_given_up_and_ended(tmp_path, browser, monkeypatch):
    monkeypatch.setattr(chromium, "_SECONDS", 0.2)
    monkeypatch.setattr(chromium, "_GRACE", 0.1)
    with pytest.raises(FileAccessError, match="no answer within"):
        printed(tmp_path, browser("exec sleep 600"))
    assert not (tmp_path / "page.pdf").exists()


def test_one_that_refuses_is_quoted(tmp_path, browser):
    refusal = '{"id":1,"error":{"message":"out of paper"}}'
    script = f"printf '%s\\0' '{refusal}' >&4; exec cat <&3 >/dev/null"
    with pytest.raises(FileAccessError, match="out of paper"):
        printed(tmp_path, browser(script))
    assert {path.name for path in tmp_path.iterdir()} == {"page.html", "chromium"}


def test_one_that_is_not_there_is_told(tmp_path):
    with pytest.raises(FileAccessError, match="cannot start"):
        printed(tmp_path, str(tmp_path / "none"))


def test_the_first_on_the_path_is_taken(monkeypatch):
    monkeypatch.setattr(chromium.shutil, "which", {"chrome": "/c", "google-chrome": "/g"}.get)
    assert chromium.find_browser() == "/g"
