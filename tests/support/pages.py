"""Pages as tests ask them."""

import base64
import hashlib
import re
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


class _Texts(HTMLParser):
    """Collects what is read aloud: text nodes and labels, each with the language it is in."""

    silent = ("script", "style", "code", "pre")
    empty = ("meta", "img", "br", "input", "path", "rect", "circle", "stop", "line")

    def __init__(self):
        super().__init__()
        self.open, self.found = [], []

    def handle_starttag(self, tag, attrs):
        told = dict(attrs)
        if tag not in self.empty:
            self.open.append((tag, told.get("lang")))
        self.found += [(self.language, told[key]) for key in ("aria-label", "alt") if told.get(key)]

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass

    @property
    def language(self):
        return next((code for _, code in reversed(self.open) if code), "")

    def handle_data(self, data):
        text = " ".join(data.split())
        if text and not any(tag in self.silent for tag, _ in self.open):
            self.found.append((self.language, text))


def texts_of(page):
    """Return language and text of everything on a page that a person reads."""
    reader = _Texts()
    reader.feed(page)
    return reader.found


_ENGLISH = re.compile(r"\b(?:are|by|from|has|is|not|of|that|the|to|were|with)\b")
"""Small words that neither German nor a name has."""


def english_left(page):
    """Return the texts of a page in another language that are English and not marked so."""
    return [text for code, text in texts_of(page) if code != "en" and _ENGLISH.search(text)]
