"""Notebooks of the documentation: how their cells are run and shown, and what they may hold.

That each of them runs is seen by every build of the site, and by ``make notebooks`` in Jupyter.
"""

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parents[1]
HOOKS = ROOT / "docs" / "hooks"
PAGES = sorted((ROOT / "docs" / "notebooks").glob("[!i]*.md"))
PAGE = """# Title

Why, see [another page](../how-to/install.md) or [a paper](https://doi.org/1).

```python
from pathlib import Path

Path("kept.txt").write_text("x", encoding="utf-8")
seen = sorted(each.name for each in Path().iterdir())
print("in", seen)
seen
```

Between.

```python
from elastocal.results import Result


class Way(Result):
    def facts(self):
        return (("length", f"{len(seen)} m < 2 m"),)


Way()
```

```python
from elastocal.report.plots import new_figure

figure = new_figure(2.0, 1.0)
figure.add_title("Error [mm]", 0.1, about="3 poses, held out")
figure
```
"""


@pytest.fixture
def hooks(monkeypatch) -> Iterator[SimpleNamespace]:
    """Return what runs the notebooks, and what shows them."""
    monkeypatch.syspath_prepend(str(HOOKS))
    import notebooks as shown
    from gallery import notebooks as run

    yield SimpleNamespace(run=run, shown=shown)
    for name in [each for each in sys.modules if each.startswith(("notebooks", "gallery"))]:
        del sys.modules[name]


@pytest.fixture
def done(hooks, tmp_path):
    """Return a notebook that was run, as its file."""
    page = tmp_path / "way.md"
    page.write_text(PAGE, encoding="utf-8")
    return json.loads(hooks.run.ipynb(hooks.run.run(page, tmp_path)))


def test_five_notebooks_are_in_the_navigation_and_in_the_table():
    names = {page.stem for page in PAGES}
    assert names == {"calibrate", "codec", "plan", "compensate", "geometry"}
    index = (ROOT / "docs/notebooks/index.md").read_text(encoding="utf-8")
    site = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for name in names:
        assert f"]({name}.md) |" in index
        assert f": notebooks/{name}.md\n" in site


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_figure_is_typed_into_the_text_of_a_notebook(hooks, page):
    text = "".join(cell.source for cell in hooks.run.cells_of(page) if not cell.code)
    assert not re.findall(r"\d[.,]\d", text)
    assert "## What this does not cover" in text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_notebook_needs_no_magic_and_no_other_file_of_the_repository(hooks, page):
    for cell in hooks.run.cells_of(page):
        if cell.code:
            compile(cell.source, page.name, "exec")
            assert not re.search(r"\.\./|__file__|get_ipython|display\(", cell.source)


def test_a_cell_is_run_in_an_empty_folder_and_shows_what_jupyter_would(done):
    code = [cell for cell in done["cells"] if cell["cell_type"] == "code"]
    printed, value = code[0]["outputs"]
    assert printed["text"] == "in ['kept.txt']\n"
    assert value["data"] == {"text/plain": "['kept.txt']"}
    assert "1 m &lt; 2 m" in code[1]["outputs"][0]["data"]["text/html"]
    assert [cell["execution_count"] for cell in code] == [1, 2, 3]


def test_a_figure_is_a_png_for_readers_and_follows_the_scheme_on_the_page(done, tmp_path):
    (output,) = done["cells"][-1]["outputs"]
    assert output["data"]["image/png"].startswith("iVBOR")
    assert output["metadata"]["alt"] == "Error [mm]. 3 poses, held out"
    svg = (tmp_path / output["metadata"]["elastocal_svg"]).read_text(encoding="utf-8")
    assert "prefers-color-scheme:dark" in svg


def test_a_downloaded_notebook_says_what_it_needs_and_has_no_link_that_leads_nowhere(done):
    title, needs = ("".join(cell["source"]) for cell in done["cells"][:2])
    assert 'pip install "elastocal[notebook]"' in needs
    assert "see another page or [a paper](https://doi.org/1)" in title
    assert (done["nbformat"], done["nbformat_minor"]) == (4, 5)
    assert len({cell["id"] for cell in done["cells"]}) == len(done["cells"])


@pytest.mark.parametrize(
    ("line", "why"),
    [("1 / 0", "ZeroDivisionError"), ("import warnings; warnings.warn('so')", "UserWarning: so")],
)
def test_a_cell_that_fails_or_warns_is_named(hooks, tmp_path, line, why):
    page = tmp_path / "way.md"
    page.write_text(f"# Title\n\n```python\nok = 1\n```\n\n```python\n{line}\n```\n")
    with pytest.raises(hooks.run.NotebookError, match=f"way.md, cell 2: {why}"):
        hooks.run.run(page, tmp_path)


def test_a_page_has_the_outputs_below_their_cells_and_the_file_for_download(hooks, done):
    page = SimpleNamespace(file=SimpleNamespace(src_uri="notebooks/way.md"))
    file = SimpleNamespace(content_string=json.dumps(done))
    files = SimpleNamespace(get_file_from_path={"figures/way.ipynb": file}.get)
    shown = hooks.shown.on_page_markdown(PAGE, page, None, files)
    assert shown.startswith("# Title\n\n[Download this notebook](../figures/way.ipynb)")
    order = ["print(", "in ['kept.txt']", "Between.", "Way()", "<caption>Way</caption>", ".svg)"]
    assert [shown.index(each) for each in order] == sorted(shown.index(each) for each in order)
    assert "![Error (mm). 3 poses, held out](../figures/notebook-way-3.svg)" in shown
