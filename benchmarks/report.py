"""How large a report is, and how soon its first picture is there.

    python benchmarks/report.py REPORT.html [PLAN.html ...]

Prints for each page its size, the time to its first contentful paint and until it is ready, the
median of several loads in a browser that nobody sees.
"""

import statistics
import sys
from pathlib import Path

from elastocal.report.document import find_browser, open_tab

_LOADS = 5
_PAINTED = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN"
_READY = "performance.timing.domComplete - performance.timing.navigationStart"


def main() -> None:
    """Measure the pages that the command line names."""
    for name in sys.argv[1:]:
        page = Path(name)
        painted, ready = [], []
        with open_tab(find_browser()) as tab:
            for _ in range(_LOADS):
                tab.open(page)
                tab.call("Page.captureScreenshot", format="jpeg")
                painted.append(tab.evaluate(_PAINTED))
                ready.append(tab.evaluate(_READY))
        print(
            f"{page}: {page.stat().st_size / 1e6:.2f} MB, first picture after"
            f" {statistics.median(painted):.0f} ms, ready after {statistics.median(ready):.0f} ms"
        )


if __name__ == "__main__":
    main()
