"""The report on paper: printed by a Chromium, where one is present."""

import shutil
import subprocess
import tempfile
from pathlib import Path

from elastocal.errors import FileAccessError
from elastocal.files import replacing

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
"""Names that are looked for on the search path, in order."""
_SECONDS = 120.0
_BUDGET = 20_000
"""Milliseconds of the page's own clock before it is printed; the 3-D view must be drawn."""


def find_browser() -> str:
    """Return the path of a Chromium.

    Raises
    ------
    FileAccessError
        If there is none.
    """
    for name in BROWSERS:
        found = shutil.which(name)
        if found is not None:
            return found
    raise FileAccessError(f"--pdf needs a Chromium: none of {', '.join(BROWSERS)} is on the path")


def write_pdf(page: Path, path: Path, browser: str) -> Path:
    """Print a page to a PDF file, atomically; return its path.

    Parameters
    ----------
    page : Path
        HTML file.
    path : Path
        PDF file.
    browser : str
        From `find_browser`.

    Raises
    ------
    FileAccessError
        If the browser fails or the file cannot be written.
    """
    with (
        tempfile.TemporaryDirectory(prefix="elastocal-") as profile,
        replacing(path) as temporary,
    ):
        target = Path(profile) / "report.pdf"
        _run([browser, *flags(Path(profile)), "--no-pdf-header-footer",
              f"--print-to-pdf={target}", page.resolve().as_uri()])  # fmt: skip
        if not target.is_file() or not target.stat().st_size:
            raise FileAccessError(f"cannot write {path}: {browser} printed nothing")
        shutil.copyfile(target, temporary)
    return path


def flags(profile: Path) -> list[str]:
    """Return the options of a browser that nobody sees and that asks the network for nothing."""
    return [
        "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle",
        "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-extensions",
        "--disable-background-networking", "--disable-component-update", "--disable-sync",
        "--no-first-run", "--no-default-browser-check", "--force-prefers-reduced-motion",
        f"--user-data-dir={profile / 'profile'}", f"--virtual-time-budget={_BUDGET}",
    ]  # fmt: skip


def _run(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, timeout=_SECONDS, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise FileAccessError(f"{command[0]} did not print the report: {error}") from error
    if done.returncode != 0:
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or ["no reason"]
        raise FileAccessError(f"{command[0]} did not print the report: {last[0]}")
