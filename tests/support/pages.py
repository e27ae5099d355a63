"""Pages as tests ask them."""

import base64
import hashlib
from html.parser import HTMLParser


def with_script(text: str, script: str) -> str:
    """Return a page with a script more at its end, which its policy allows by name."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = text.replace("script-src ", f"script-src 'sha256-{digest}' ", 1)
    return allowed.replace("</body>", f"<script>{script}</script></body>")


class Page(HTMLParser):
    """Collects what the tests ask of the page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.data, self._into = [], "", None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.tags.append((tag, found))
        self._into = found.get("id")

    def handle_data(self, data):
        if self._into == "data":
            self.data += data
            self._into = None

    def one(self, **wanted):
        (found,) = [a for _, a in self.tags if wanted.items() <= a.items()]
        return found

    def count(self, tag):
        return sum(name == tag for name, _ in self.tags)
