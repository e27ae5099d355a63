"""What shells show of blocks, cell by cell."""

import io
from html.parser import HTMLParser

from elastocal.cli.output import console, print_blocks


class Cells(HTMLParser):
    """The rows of cells of a page."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.inside = [], False
        self.feed(text)

    def handle_starttag(self, tag, _):
        if tag == "tr":
            self.rows.append([])
        if tag in ("th", "td"):
            self.rows[-1].append("")
            self.inside = True

    def handle_endtag(self, tag):
        if tag in ("th", "td"):
            self.inside = False

    def handle_data(self, data):
        if self.inside:
            self.rows[-1][-1] += data


def printed(blocks):
    """Return the words of every line on a wide terminal."""
    screen = console(stderr=False, file=io.StringIO(), width=400)
    print_blocks(screen, blocks)
    return [line.split() for line in screen.file.getvalue().splitlines()]
