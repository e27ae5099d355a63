"""Fill the page on the simulated cell with the table of its presets, from the code's own table."""

from mkdocs.structure.pages import Page

from elastocal.sim import PRESET_FIGURES, PRESETS

_MARK = "<!-- presets -->"
_PAGE = "explanation/simulated-cell.md"


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Return the page with the table in place of the mark."""
    return markdown.replace(_MARK, _table()) if page.file.src_uri == _PAGE else markdown


def _table() -> str:
    head = ("effect", "key", *PRESETS, "source")
    rows = [
        (f.effect, f"`{f.key}`", *(_shown(f.of(preset)) for preset in PRESETS), f.source)
        for f in PRESET_FIGURES
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows))


def _shown(value: object) -> str:
    """Return a figure as a cell file has it; of six joints the least and the most."""
    if value is None:
        return "by `hysteresis`"
    if isinstance(value, tuple):
        return f"{value[0]} … {value[-1]}" if len(value) > 2 else ", ".join(map(str, value))
    return str(value)
