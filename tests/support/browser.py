"""Look at a page in a real browser: what it says of itself, what it complains of, what it loads.

The page is shown in frames of the widths that matter, since a browser's window has a smallest
width. A script in each frame measures and reports to the console, which is read back. Requests
are taken from the browser's own log of its network; only those that a page began count.
"""

import json
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elastocal.report.document.pdf import flags

_HERE = Path(__file__).parent
_FIRST, _LAST = ((_HERE / f"{name}.js").read_text("utf-8") for name in ("failures", "probe"))
"""Scripts in front of everything in the page, and behind."""
SCHEMES = {"dark": 0, "light": 1}
"""Values of Chromium's setting of the preferred colours."""
_SAID = "PROBE:"
_CONSOLE = re.compile(r'CONSOLE[^\]]*\] "(.*?)", source: ', re.DOTALL)
_HINT = re.compile(r"GL Driver Message|Canvas2D: Multiple readback")
"""Advice on speed from a software renderer; no fault of the page."""
_SECONDS = 240


@dataclass(frozen=True)
class Seen:
    """What a browser saw."""

    frames: dict[int, dict[str, Any]]
    """What the probe in the frame of each width measured."""
    console: list[str]
    """Every other line on the console but hints of the graphics driver."""
    requests: list[str]
    """Addresses that a page asked the network for."""
    screenshot: Path


def look(
    browser: str, page: Path, folder: Path, scheme: str, widths: tuple[int, ...], height: int = 1000
) -> Seen:
    """Show a page and return what was seen.

    Parameters
    ----------
    browser : str
        Path of a Chromium.
    page : Path
        HTML file; a copy of it gets the probe.
    folder : Path
        For the copy, the browser's profile and the screenshot.
    scheme : str
        ``light`` or ``dark``.
    widths : tuple of int
        Of the frames, in pixels.
    height : int
        Of the frames, in pixels.
    """
    text = page.read_text(encoding="utf-8")
    probed = folder / f"probed-{scheme}.html"
    for place, script in (("<head>", f"<head><script>{_FIRST}</script>"),
                          ("</body>", f"<script>{_LAST}</script></body>")):  # fmt: skip
        assert place in text
        text = text.replace(place, script)
    probed.write_text(text, encoding="utf-8")
    frames = "".join(
        f'<iframe src="{probed.as_uri()}" style="border:0;width:{width}px;height:{height}px">'
        "</iframe>"
        for width in widths
    )
    outer = folder / f"frames-{scheme}.html"
    outer.write_text(f'<!DOCTYPE html><body style="margin:0;white-space:nowrap">{frames}', "utf-8")
    screenshot, log = folder / f"report-{scheme}.png", folder / f"net-{scheme}.json"
    done = subprocess.run(
        [
            *(browser, *flags(folder / scheme), "--hide-scrollbars", "--enable-logging=stderr"),
            *(f"--blink-settings=preferredColorScheme={SCHEMES[scheme]}",),
            *(f"--window-size={sum(widths)},{height}", f"--screenshot={screenshot}"),
            *(f"--log-net-log={log}", outer.as_uri()),
        ],
        capture_output=True,
        text=True,
        timeout=_SECONDS,
        check=False,
    )
    said = [line.replace('\\"', '"') for line in _CONSOLE.findall(done.stderr)]
    found = [json.loads(line.removeprefix(_SAID)) for line in said if line.startswith(_SAID)]
    return Seen(
        {frame["innerWidth"]: frame for frame in found},
        [line for line in said if not line.startswith(_SAID) and not _HINT.search(line)],
        _requests(log),
        screenshot,
    )


def _requests(log: Path) -> list[str]:
    """Return the addresses that pages asked the network for."""
    events = json.loads(log.read_text(encoding="utf-8"))["events"]
    began = [event.get("params") or {} for event in events]
    # What the browser asks for by itself has "not an origin"; a page has its own, or "null".
    return sorted(
        {
            each["url"]
            for each in began
            if each.get("initiator", "not an origin") != "not an origin"
            and not each.get("url", "file:").startswith(("file:", "data:", "blob:"))
        }
    )
