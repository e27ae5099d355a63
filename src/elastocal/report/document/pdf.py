"""The report on paper: printed by a Chromium, where one is present."""

import base64
from pathlib import Path

from elastocal.files import replacing
from elastocal.report.document.chromium import open_tab


def write_pdf(page: Path, path: Path, browser: str) -> Path:
    """Print a page to a PDF file, atomically; return its path.

    Parameters
    ----------
    page : Path
        HTML file that sets ``data-ready`` of its root to ``yes`` when it is drawn.
    path : Path
        PDF file.
    browser : str
        From `find_browser`.

    Raises
    ------
    FileAccessError
        If the browser fails or the file cannot be written.
    """
    with replacing(path) as temporary, open_tab(browser) as tab:
        tab.open(page)
        printed = tab.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        temporary.write_bytes(base64.b64decode(printed["data"]))
    return path
