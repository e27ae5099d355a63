"""Blocks: the pieces that every section of the report is made of; ``blocks.html`` shows them.

A section chooses what to show and never writes markup: texts are escaped where they are shown.
"""

import base64
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from matplotlib.figure import Figure

from elastocal.report.pages import render
from elastocal.report.plots import figure_bytes
from elastocal.results import brief_repr
from elastocal.verdict import Evidence

_DPI = 130
"""Resolution of figures with thousands of points, which would be large as SVG."""
_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


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
    """A button in a table that shows a pose in the scene."""

    pose: int


Cell = str | int | Stamp | Code | PoseButton
Row = tuple[Cell, ...]


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; its kind is its class in the style sheet."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Heading:
    """A heading below that of the section."""

    text: str


@brief_repr
@dataclass(frozen=True)
class Bullets:
    """A list; nothing without items."""

    items: tuple[str, ...]
    kind: str = ""
    code: bool = False
    """Whether parts in backticks are commands."""


@brief_repr
@dataclass(frozen=True)
class Facts:
    """Key figures: name, and value with its unit."""

    pairs: tuple[tuple[str, str | int], ...]


@brief_repr
@dataclass(frozen=True)
class Table:
    """A table that scrolls by itself where the page is narrow."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[Row, ...]
    """The first cell of each names the row."""
    texts: int = 1
    """Columns that hold text and stand to the left; the others hold numbers."""
    name: str = ""
    """Identifier, where a script looks for the table."""


@dataclass(frozen=True)
class Picture:
    """A printed figure."""

    source: str
    """The figure itself, as a data URL."""
    alt: str
    """Words for readers that cannot see it."""
    caption: str


@dataclass(frozen=True)
class Verbatim:
    """A text as it stands."""

    text: str


@brief_repr
@dataclass(frozen=True)
class PlanScene:
    """The view of a plan in three dimensions."""

    poses: int
    data: Mapping[str, object]
    """For the script of the page."""


@brief_repr
@dataclass(frozen=True)
class Details:
    """Blocks that a reader may open; of the kind ``long``, they stay folded on paper."""

    summary: str
    blocks: tuple["Block", ...]
    kind: str = ""


Block = Paragraph | Heading | Bullets | Facts | Table | Picture | Verbatim | PlanScene | Details


@brief_repr
@dataclass(frozen=True)
class Content:
    """Everything that a section shows."""

    blocks: tuple[Block, ...]

    @property
    def data(self) -> Mapping[str, object]:
        """The data of its scene, for the script of the page; empty without a scene."""
        return next((each.data for each in self.blocks if isinstance(each, PlanScene)), {})

    @cached_property
    def html(self) -> str:
        """The blocks as HTML."""
        return render("content.html", blocks=self.blocks)


@dataclass(frozen=True)
class Section:
    """One section: a title, and how it is made from the evidence, whatever is there."""

    identifier: str
    """Identifier of the heading; also the key of its data."""
    title: str
    place: int
    """Sections stand in the order of these numbers."""
    blocks: Callable[[Evidence], Iterable[Block]]

    def body(self, evidence: Evidence) -> Content:
        """Return what the section shows."""
        return Content(tuple(self.blocks(evidence)))


def picture(draw: Callable[[], Figure], alt: str, caption: str, kind: str = ".svg") -> Picture:
    """Return a figure with its caption.

    Parameters
    ----------
    draw : callable
        Returns the figure; called with the settings of print.
    alt : str
        Words for readers that cannot see it.
    caption : str
        For all readers.
    kind : str
        ``.svg``, or ``.png`` for figures with many points.
    """
    data = base64.b64encode(figure_bytes(draw, kind, _DPI)).decode("ascii")
    return Picture(f"data:{_TYPES[kind]};base64,{data}", alt, caption)


def flattened(value: object, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield every leaf of nested settings with its path.

    >>> list(flattened({"a": {"b": 0.5, "c": [1, 2]}, "d": None}))
    [('a.b', '0.5'), ('a.c', '1, 2'), ('d', 'none')]
    """
    if isinstance(value, dict):
        for key, each in value.items():
            yield from flattened(each, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(value, list) and any(isinstance(each, dict) for each in value):
        for number, each in enumerate(value):
            yield from flattened(each, f"{prefix}.{number}")
    else:
        yield prefix, _leaf(value)


def _leaf(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_leaf, value)) or "none"
    if isinstance(value, float):
        return f"{value:.10g}"
    return "none" if value is None else str(value)
