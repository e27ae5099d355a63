"""Blocks: the elements in which a result is shown, on a terminal, page, workbook or notebook.

A feature describes its result once, as blocks, and every shell renders them. Texts are phrases, so
that they can be translated, and figures are drawn by the shell that shows them.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from elastocal.results import brief_repr

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Stamp:
    """A time of day; nothing else differs between reports of equal runs."""

    text: str


@dataclass(frozen=True)
class Code:
    """A text in a table that is read letter by letter, such as a hash."""

    text: str


@dataclass(frozen=True)
class PoseButton:
    """A pose in a table; where there is a scene, a button that shows it there."""

    pose: int


Grade = Literal["good", "fair", "poor"]


@dataclass(frozen=True)
class Graded:
    """A text in a table with how good that is, which a shell may show by a colour."""

    text: str
    grade: Grade


Cell = str | int | Stamp | Code | PoseButton | Graded
Row = tuple[Cell, ...]


def cell_text(cell: Cell) -> str:
    """Return the text of a cell as every shell shows it."""
    return str(getattr(cell, "text", getattr(cell, "pose", cell)))


class Block:
    """A piece of what is shown. A shell leaves out the kinds that it cannot show."""


@dataclass(frozen=True)
class Paragraph(Block):
    """A paragraph; its kind is its class in the style sheet."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Heading(Block):
    """A heading below that of the section."""

    text: str


@brief_repr
@dataclass(frozen=True)
class Bullets(Block):
    """A list; nothing without items."""

    items: tuple[str, ...]
    kind: str = ""
    code: bool = False
    """Whether parts in backticks are commands."""


@brief_repr
@dataclass(frozen=True)
class Facts(Block):
    """Key figures: name, and value with its unit."""

    pairs: tuple[tuple[str, str | int], ...]


@brief_repr
@dataclass(frozen=True)
class Table(Block):
    """A table that scrolls by itself where a page is narrow."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[Row, ...]
    """The first cell of each names the row."""
    texts: int = 1
    """Text columns, aligned to the left; the others hold numbers."""
    name: str = ""
    """Identifier, where a script looks for the table."""


@brief_repr
@dataclass(frozen=True)
class Picture(Block):
    """A printed figure."""

    draw: "Callable[[], Figure]"
    """Returns it; called with the settings of print."""
    alt: str
    """Words for readers that cannot see it."""
    caption: str


@dataclass(frozen=True)
class Verbatim(Block):
    """Text shown unchanged, in a fixed-width font."""

    text: str


@brief_repr
@dataclass(frozen=True)
class Details(Block):
    """Blocks that a reader may open; of the kind ``long``, they stay folded on paper."""

    summary: str
    blocks: tuple[Block, ...]
    kind: str = ""


def every_table(shown: Iterable[Block]) -> Iterator[Table]:
    """Yield the tables of blocks, those that a reader may open as well."""
    for block in shown:
        if isinstance(block, Table):
            yield block
        elif isinstance(block, Details):
            yield from every_table(block.blocks)
