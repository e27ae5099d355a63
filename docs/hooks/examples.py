"""Fill the page of examples from the scripts themselves: what each teaches, and its text."""

import ast
from pathlib import Path

from mkdocs.structure.pages import Page

_FOLDER = Path(__file__).resolve().parents[2] / "examples"
_MARK = "<!-- examples -->"


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Return the page with a section for each script in place of the mark."""
    if page.file.src_uri != "examples.md":
        return markdown
    return markdown.replace(_MARK, "\n".join(map(_section, sorted(_FOLDER.glob("[0-9]*.py")))))


def _section(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    title, _, rest = (ast.get_docstring(ast.parse(text)) or "").partition("\n")
    code = text.split('"""', 2)[2].strip("\n")
    block = "\n".join(f"    {line}".rstrip() for line in ["```python", *code.splitlines(), "```"])
    return f'## {title.rstrip(".")}\n\n{rest.strip()}\n\n??? example "{path.name}"\n\n{block}\n'
