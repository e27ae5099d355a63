"""The studio as a picture: taken of its own page, in a browser that nobody sees."""

import base64
import tempfile
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from elastocal.cell import write_example
from elastocal.errors import FileAccessError
from elastocal.report.document import find_browser, open_tab
from elastocal.report.plots import new_figure, write_figure
from elastocal.workflows import StudioResult, studio

WIDTH, HEIGHT = 1440, 860
WAIT = """new Promise((done) => {
  const shown = () => document.documentElement?.dataset.%s;
  const look = () => shown() ? setTimeout(done, 1500) : setTimeout(look, 30);
  look();
})"""
PRESS = """document.getElementById("view").shown.onPress({
  origin: [1.75, -0.15, 3.0], direction: [0, 0, -1],
})"""


def make(folder: Path) -> dict[str, str]:
    """Make the picture; return what is told of it: nothing, it shows what the page says."""
    path = folder / "studio.png"
    try:
        browser = find_browser()
    except FileAccessError:
        write_figure(path, partial(_say_why))
        return {}
    with tempfile.TemporaryDirectory() as made:
        cell = write_example(Path(made) / "afp", "afp")[0]
        studio(cell, while_open=partial(_take, path, browser))
    return {}


def _take(path: Path, browser: str, found: StudioResult) -> None:
    with open_tab(browser) as tab:
        screen = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        tab.call("Emulation.setDeviceMetricsOverride", **screen)
        tab.call("Page.navigate", url=found.figures.address)
        tab.evaluate(WAIT % "ready")
        tab.evaluate(PRESS)
        tab.evaluate(WAIT % "moved")
        # The path of a temporary folder is nobody's business.
        tab.evaluate('document.getElementById("file").textContent = "afp/cell.yaml"')
        shot = tab.call("Page.captureScreenshot", format="png")
    path.write_bytes(base64.b64decode(shot["data"]))


def _say_why() -> Figure:
    figure = new_figure(6.0, 1.0)
    figure.text(0.5, 0.5, "Taken where the site is built with a Chromium.", ha="center")
    return figure
