"""Show each notebook with what its cells put out, and its file for download.

The pages of ``docs/notebooks`` hold text and Python alone. They are run with the figures of the
site (`gallery.notebooks`), and kept with them; here the outputs come below their cells.
"""

import html
import json
import re
from collections.abc import Iterator
from typing import Any

from figures import DRAWN
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

_FOLDER = "notebooks/"
_FENCE = re.compile(r"^```python\n.*?^```$", flags=re.MULTILINE | re.DOTALL)
_DOWNLOAD = (
    "[Download this notebook](../figures/{name}.ipynb)"
    "{{ .md-button .md-button--primary download={name}.ipynb }}\n\n"
    "*It runs as it is, in an empty folder: [how](index.md#run-them). What stands at a line below a"
    " cell is what the cell put out when this page was made.*"
)


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Return the page of a notebook with its outputs."""
    del config
    source = page.file.src_uri
    if not DRAWN or not source.startswith(_FOLDER) or source.endswith("index.md"):
        return markdown
    name = source.removeprefix(_FOLDER).removesuffix(".md")
    file = files.get_file_from_path(f"figures/{name}.ipynb")
    if file is None:
        raise PluginError(f"notebook {name} was not run")
    cells = json.loads(file.content_string)["cells"]
    outputs = iter([cell["outputs"] for cell in cells if cell["cell_type"] == "code"])
    shown = _FENCE.sub(lambda fence: "\n\n".join([fence[0], *_shown(next(outputs))]), markdown)
    title, _, rest = shown.partition("\n")
    return f"{title}\n\n{_DOWNLOAD.format(name=name)}\n{rest}"


def _shown(outputs: list[dict[str, Any]]) -> Iterator[str]:
    for output in outputs:
        data, metadata = output.get("data", {}), output.get("metadata", {})
        if "elastocal_svg" in metadata:
            alt = html.escape(metadata["alt"]).replace("[", "(").replace("]", ")")
            text = f"![{alt}](../figures/{metadata['elastocal_svg']})"
        elif "text/html" in data:
            yield f'<div class="output">{data["text/html"]}</div>'
            continue
        else:
            text = f"```text\n{(output.get('text') or data['text/plain']).rstrip()}\n```"
        yield f'<div class="output" markdown="1">\n\n{text}\n\n</div>'
