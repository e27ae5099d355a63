"""A page of blocks in sections: one HTML file that runs no script."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from elastocal import __version__
from elastocal.blocks import Block
from elastocal.files import write_text
from elastocal.report.language import ENGLISH, Language
from elastocal.report.pages import render


def write_page(
    path: Path,
    title: str,
    sections: Sequence[tuple[str, str, Iterable[Block]]],
    language: Language = ENGLISH,
    subtitle: str = "",
    maker: str = "elastocal",
) -> Path:
    """Write the page, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    title : str
        Title of the page.
    sections : sequence of (str, str, iterable of Block)
        Identifier, title and contents of each.
    language : Language, optional
        Language of its words.
    subtitle : str, optional
        A sentence below the title.
    maker : str, optional
        The command that makes such pages, as the page's source names it.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    page = render(
        "sections.html",
        language,
        title=title,
        subtitle=subtitle,
        styles=("page.css",),
        scripts=(),
        data={},
        sections=[(name, heading, tuple(shown)) for name, heading, shown in sections],
        maker=maker,
        version=__version__,
    )
    write_text(path, page)
    return Path(path)
