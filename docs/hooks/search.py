"""Let the search find what to do before what was decided, and pages before the reference.

A word counts a thousand times as much in a title as in a text, and a million times in the ``tags``
at the head of a page: words that people look for, of how-to pages whose titles do not say them.
"""

from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

BOOSTS = {
    "how-to/": 4.0,
    "tutorial": 3.0,
    "notebooks/": 2.0,
    "explanation/": 1.5,
    "reference/api/": 0.0003,
    "decisions/": 0.0002,
}
"""How much more than others a page counts, by the beginning of its path.

A title of a decision, or of a package, counts less than the text of any other page.
"""


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Weigh a page for the search, unless it says itself how much it counts."""
    del config, files
    meta: dict[str, Any] = page.meta
    for beginning, boost in BOOSTS.items():
        if page.file.src_uri.startswith(beginning):
            meta.setdefault("search", {}).setdefault("boost", boost)
    return markdown
