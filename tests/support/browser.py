"""Look at a page in a real browser: what it says of itself, what it complains of, what it loads."""

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elastocal.report.document import open_tab
from elastocal.report.document.chromium import Message, Tab

PROBE = (Path(__file__).parent / "probe.js").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Look:
    """How a page is looked at."""

    width: int
    """In pixels."""
    scheme: str
    """``light`` or ``dark``."""


@dataclass(frozen=True)
class Seen:
    """What a browser saw."""

    frames: dict[Look, dict[str, Any]]
    """What the probe measured, look by look."""
    complaints: list[str]
    """Errors and warnings of the page, but for hints of the graphics driver."""
    requests: list[str]
    """Addresses that were asked of the network."""
    screenshots: dict[Look, bytes]
    """As PNG."""


def look(
    browser: str, page: Path, looks: Sequence[Look], height: int = 1400, before: str = "0"
) -> Seen:
    """Show a page and return what was seen; a change of width loads it anew.

    Parameters
    ----------
    browser : str
        Path of a Chromium.
    page : Path
        HTML file that says when it is ready.
    looks : sequence of Look
        In their order; where only the scheme changes, the page has to follow.
    height : int
        Of the window, in pixels.
    before : str
        Script that is run in the page when it has been loaded.
    """
    frames, screenshots = {}, {}
    with open_tab(browser) as tab:
        for domain in ("Runtime", "Log", "Network"):
            tab.call(f"{domain}.enable")
        width = None
        for each in looks:
            emulate(tab, each, height)
            if each.width != width:
                tab.open(page)
                tab.evaluate(before)
            width = each.width
            frames[each] = tab.evaluate(PROBE)
            shot = tab.call("Page.captureScreenshot", format="png")
            screenshots[each] = base64.b64decode(shot["data"])
        events = list(tab.events)
    return Seen(frames, complaints_of(events), requests_of(events), screenshots)


def emulate(tab: Tab, look: Look, height: int) -> None:
    """Show a tab as a screen of that width, in that colour scheme."""
    tab.call(
        "Emulation.setDeviceMetricsOverride",
        width=look.width,
        height=height,
        deviceScaleFactor=1,
        mobile=False,
    )
    scheme = {"name": "prefers-color-scheme", "value": look.scheme}
    tab.call("Emulation.setEmulatedMedia", features=[scheme])


def complaints_of(events: Sequence[Message]) -> list[str]:
    """Return errors and warnings among the events of a tab."""
    found = []
    for event in events:
        method, told = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            found.append(json.dumps(told["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning"):
            found.append(" ".join(str(each.get("value")) for each in told["args"]))
        elif method == "Log.entryAdded":
            entry = told["entry"]
            # The software renderer tells how it could be quicker.
            if entry["level"] in ("error", "warning") and entry["source"] != "rendering":
                found.append(entry["text"])
    return found


def requests_of(events: Sequence[Message]) -> list[str]:
    """Return the addresses that were asked of the network among the events of a tab."""
    asked = {}
    for event in events:
        told = event.get("params", {})
        if event.get("method") == "Network.requestWillBeSent":
            asked[told["requestId"]] = told["request"]["url"]
        if told.get("blockedReason") == "csp":
            asked.pop(told["requestId"], None)
    return [url for url in asked.values() if not url.startswith(("file:", "data:", "blob:"))]
