"""Palette, typeface and file output of all figures.

Colours are those of M. Okabe and K. Ito, "Color Universal Design", 2008: distinguishable for
colour-blind readers, and on paper. Shapes or words repeat the information, so that no figure needs
colour to be read. The same figure has the same bytes, and a description in words.
"""

import io
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter

from elastocal.arrays import FloatArray, IndexArray
from elastocal.errors import FileAccessError
from elastocal.files import write_bytes

INK = "#1b1b1b"
MUTED = "#595959"
FAINT = "#b5b5b5"
PAPER = "#ffffff"
GRID = "#dcdcd8"
BAND = "#f4f4f1"
"""Behind every second group of a panel: shows what belongs together."""
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
VERMILLION = "#d55e00"
ORANGE = "#e69f00"
PURPLE = "#cc79a7"
YELLOW = "#f0e442"
CHOSEN = (BLUE, VERMILLION)
"""Chosen poses of the plan's technique, and of the one that it is compared with."""
ARM = ORANGE
TOOL = "#4d4d4d"
TOOLING = "#c3ccd6"
TOUR = PURPLE
REFUSED = "#8c8c8c"
SEQUENTIAL = "cividis"
"""Colour map of quantities; its order survives colour blindness and grey printing."""
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
SUFFIXES = (".pdf", ".png", ".svg")
_MARKERS = "os^Dv"
"""Markers of medians in print; one less than colours, so that both together repeat late."""
_SCREEN = {"o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down"}
_FILL = 0.35
"""Part of the colour in a box; the rest is paper."""
_DPI = 200
_SCREEN_DPI = 100
_IMAGE_DPI = 100
_MOST_PARTS = 400
"""Parts of one artist beyond which SVG would be larger than an image."""
_SHADE = 0.7
"""Grey of faces that let the ground of a page through."""
ON_BRIGHT, ON_DARK = "#1b1b1a", "#fffffe"
"""Ink on the colours of a map, which are the same in every scheme."""
_THEMED = {
    INK: "ink", MUTED: "muted", PAPER: "ground", GRID: "grid", "#e6e6e2": "grid", FAINT: "faint",
    BAND: "band", BLUE: "after", VERMILLION: "before", REFUSED: "refused",
}  # fmt: skip
_DARK = {
    "ink": "#e8e8e4", "muted": "#b4b4ae", "ground": "#14171a", "grid": "#363b40",
    "faint": "#5c6268", "band": "#1d2125", "after": "#56b4e9", "before": "#ff9a5c",
    "refused": "#a5a59f",
}  # fmt: skip
"""Colours of the style sheet of pages."""
_UNDATED: dict[str, dict[str, str | None]] = {
    ".svg": {"Date": None, "Creator": "elastocal"},
    ".pdf": {"CreationDate": None, "Creator": "elastocal"},
    ".png": {"Software": "elastocal"},
}
"""No date, or the bytes of a figure would change."""


@dataclass(frozen=True)
class VariantStyle:
    """Drawing style of one variant of several."""

    name: str
    colour: str
    fill: str
    """Colour inside its boxes; the second time that a colour is used, paper."""
    marker: str
    place: float
    """Middle of its boxes from the middle of their group, in numbers of training poses."""
    width: float
    """Width of its boxes."""

    @property
    def symbol(self) -> str:
        """Return the marker's name on screen."""
        return _SCREEN[self.marker]

    def at(self, n: IndexArray) -> FloatArray:
        """Return the positions of its boxes, shape (box,)."""
        return np.asarray(n + self.place, dtype=float)


def variant_styles(names: Sequence[str]) -> tuple[VariantStyle, ...]:
    """Return the styles of variants, in their order from left to right."""
    step = 0.82 / len(names)
    return tuple(
        VariantStyle(
            name=name,
            colour=COLOURS[k % len(COLOURS)],
            fill=tint(COLOURS[k % len(COLOURS)]) if k < len(COLOURS) else PAPER,
            marker=_MARKERS[k % len(_MARKERS)],
            place=(k + 0.5) * step - 0.41,
            width=0.8 * step,
        )
        for k, name in enumerate(names)
    )


def tint(colour: str, part: float = _FILL, ground: int = 255) -> str:
    """Return a colour on paper, or on another grey.

    >>> tint("#0072b2", 0.5), tint("#0072b2", 0.5, ground=0)
    ('#80b8d8', '#003959')

    Parameters
    ----------
    colour : str
        ``#rrggbb``.
    part : float
        Remaining share of it, from 0 to 1.
    ground : int
        Background of each channel: 255 for paper, 0 for black.
    """
    channels = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(ground + part * (each - ground)):02x}" for each in channels)


class Page(Figure):
    """A figure whose parts are placed in inches, from its left and lower edge."""

    def _repr_png_(self) -> bytes:
        """Return the picture that a notebook shows."""
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=_SCREEN_DPI, metadata=_metadata(".png"))
        return buffer.getvalue()

    def add_panel(self, left: float, bottom: float, width: float, height: float) -> Axes:
        """Return new axes."""
        across, tall = self.get_size_inches()
        return self.add_axes((left / across, bottom / tall, width / across, height / tall))

    def add_title(
        self, text: str, left: float, size: float = 11.5, top: float = 0.1, about: str = ""
    ) -> None:
        """Write the title, ``top`` below the upper edge; below it the description of the figure."""
        across, tall = self.get_size_inches()
        self.text(
            left / across, 1.0 - top / tall, literal(text), va="top", fontsize=size, weight="bold"
        )
        if about:
            self.text(
                left / across, 1.0 - (top + 0.022 * size) / tall, literal(about), va="top",
                fontsize=0.85 * size, color=MUTED, linespacing=1.35,
            )  # fmt: skip

    def add_caption(self, text: str, left: float, size: float = 7.8, spacing: float = 1.35) -> None:
        """Write how to read the figure at its foot."""
        across, tall = self.get_size_inches()
        self.text(
            left / across, 0.1 / tall, literal(text), va="bottom", fontsize=size, color=MUTED,
            linespacing=spacing,
        )  # fmt: skip


def new_figure(width: float, height: float) -> Page:
    """Return an empty figure of a size in inches, without a window."""
    figure = Page((width, height))
    FigureCanvasAgg(figure)
    return figure


def open_frame(
    axes: Axes, grid: Literal["", "x", "y", "both"] = "", colour: str = GRID, also: str = ""
) -> None:
    """Take the upper and right edge off axes, and lay a faint grid under what they show.

    Parameters
    ----------
    axes : Axes
        To change.
    grid : str
        Axis that has a grid; empty: none.
    colour : str
        Colour of the grid.
    also : str
        A further edge to take off, for example ``left``.
    """
    axes.spines[["top", "right", *filter(None, [also])]].set_visible(False)
    if grid:
        axes.grid(axis=grid, color=colour, lw=0.5)
        axes.set_axisbelow(True)


def literal(text: str) -> str:
    r"""Return a text whose dollar signs begin no formula.

    >>> literal("a$b")
    'a\\$b'
    """
    return text.replace("$", r"\$") if "$" in text else text


def wrapped(text: str, width: int) -> list[str]:
    """Return a text in lines of at most ``width`` characters.

    >>> wrapped("one two three", 8)
    ['one two', 'three']
    """
    return textwrap.wrap(text, width, break_long_words=True, break_on_hyphens=False)


def print_settings() -> dict[Any, Any]:
    """Return matplotlib's settings of a printed figure; the same figure has the same bytes."""
    return {
        # Comes with matplotlib.
        "font.family": ["DejaVu Sans"],
        "font.size": 9.0,
        "text.color": INK,
        "axes.edgecolor": MUTED,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "figure.facecolor": PAPER,
        "savefig.facecolor": PAPER,
        "svg.hashsalt": "elastocal",
        "pdf.fonttype": 42,
    }


def require_kind(path: Path) -> None:
    """Refuse a figure of another kind than can be written, before the work for it is done.

    Raises
    ------
    FileAccessError
        By its suffix.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise FileAccessError(
            f"figure {path}: suffix {path.suffix!r} is not one of {', '.join(SUFFIXES)}"
        )


def write_figure(
    path: Path, draw: Callable[[], Figure], title: str = "", description: str = ""
) -> Path:
    """Write a figure, atomically; return its path.

    Parameters
    ----------
    path : Path
        The suffix decides the kind: SVG, PNG or PDF.
    draw : callable
        Returns the figure; called once, with the settings of print.
    title, description : str, optional
        What it is and shows, for readers that cannot see it; kept in the file.

    Raises
    ------
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    path = Path(path)
    require_kind(path)
    # In memory: what a library leaves of a file on a full disk is its own affair.
    write_bytes(path, figure_bytes(draw, path.suffix.lower(), _DPI, title, description))
    return path


def figure_bytes(
    draw: Callable[[], Figure], suffix: str, dpi: int, title: str = "", description: str = ""
) -> bytes:
    """Return a figure as the bytes of a file; the same figure has the same bytes.

    Parameters
    ----------
    draw : callable
        Returns the figure; called with the settings of print.
    suffix : str
        ``.svg``, ``.png`` or ``.pdf``.
    dpi : int
        Resolution of what is stored as an image.
    title, description : str, optional
        See `write_figure`.
    """
    buffer, notes = io.BytesIO(), _metadata(suffix, title, description)
    with matplotlib.rc_context(print_settings()):
        draw().savefig(buffer, format=suffix[1:], dpi=dpi, metadata=notes)
    return buffer.getvalue()


def _schemes() -> dict[str, tuple[str, str]]:
    """Return the colours that follow the scheme of a page, each with its names and dark value."""
    ground = int(_DARK["ground"][1:3], 16)
    fills = {
        tint(colour): (f"fill{k}", tint(colour, ground=ground)) for k, colour in enumerate(COLOURS)
    }
    return {colour: (name, _DARK[name]) for colour, name in _THEMED.items()} | fills


def themed_svg(draw: Callable[[], Figure], say: Callable[[object], str] | None = None) -> bytes:
    """Return a figure as SVG whose greys follow the colour scheme of the page that shows it.

    Artists with very many parts are embedded as an image with a transparent background; where all
    their faces are grey, these are as translucent as makes them look the same on white paper.

    Parameters
    ----------
    draw : callable
        Returns the figure; called with the settings of print.
    say : callable, optional
        Returns a text in the language of the page; by default it is English.
    """
    buffer = io.BytesIO()
    with matplotlib.rc_context(print_settings() | {"savefig.transparent": True}):
        figure = draw()
        if say is not None:
            _translate(figure, say)
        for many in figure.findobj(_has_many_parts):
            many.set_rasterized(True)
            if isinstance(many, Collection):
                _let_ground_through(many)
        figure.savefig(buffer, format="svg", dpi=_IMAGE_DPI, metadata=_metadata(".svg"))
    svg = buffer.getvalue().decode("utf-8")
    light, dark = {}, {}
    for colour, (name, at_night) in _schemes().items():
        svg = svg.replace(colour, f"var(--{name})")
        light[name], dark[name] = colour, at_night
    opened = svg.index(">", svg.index("<svg")) + 1
    sheet = f"{_rule(light)}@media screen and (prefers-color-scheme:dark){{{_rule(dark)}}}"
    return f"{svg[:opened]}<style>{sheet}</style>{svg[opened:]}".encode()


def _rule(colours: dict[str, str]) -> str:
    """Return the rule of a style sheet that gives names to colours."""
    return f":root{{{';'.join(f'--{name}:{colour}' for name, colour in colours.items())}}}"


class _Said(Formatter):
    """Writes the numbers of an axis as another formatter does, in the language of the page."""

    def __init__(self, inner: Formatter, say: Callable[[object], str]) -> None:
        self._inner, self._say = inner, say

    def set_locs(self, locs: Any) -> None:
        self._inner.set_locs(locs)

    def get_offset(self) -> str:
        return self._say(self._inner.get_offset())

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self._say(self._inner(x, pos))


def _translate(figure: Figure, say: Callable[[object], str]) -> None:
    for text in figure.findobj(Text):
        text.set_text(say(text.get_text()))
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for ticker in (axis.major, axis.minor):
                # Of a fixed text `findobj` has changed what is drawn.
                if ticker.formatter is not None:
                    ticker.formatter = _Said(ticker.formatter, say)


def sequential_stops(count: int = 9) -> list[tuple[float, str]]:
    """Return colours of `SEQUENTIAL` from 0 to 1, as part and ``#rrggbb``."""
    parts = np.linspace(0.0, 1.0, count)
    return [(float(part), to_hex(matplotlib.colormaps[SEQUENTIAL](part))) for part in parts]


def _has_many_parts(artist: Artist) -> bool:
    if isinstance(artist, PathCollection):
        return len(np.asarray(artist.get_offsets())) > _MOST_PARTS
    return isinstance(artist, Collection) and len(artist.get_paths()) > _MOST_PARTS


def _let_ground_through(faces: Collection) -> None:
    """Replace opaque greys by one grey whose opacity gives the same colours on white."""
    colours = np.array(faces.get_facecolor(), dtype=float)
    grey = colours[:, :1]
    if not len(colours) or np.any(colours[:, :3] != grey) or np.any(colours[:, 3] != 1.0):
        return
    opacity = ((1.0 - grey) / (1.0 - _SHADE)).clip(0.0, 1.0)
    shades = np.minimum(grey, _SHADE).repeat(3, axis=1)
    faces.set_facecolor(list(map(tuple, np.hstack([shades, opacity]))))
    # Edges and smoothed borders would be seen twice through one another.
    faces.set_edgecolor("none")
    faces.set_antialiased(False)


def _metadata(suffix: str, title: str = "", description: str = "") -> dict[str, str | None]:
    """Return the metadata of the file; empty entries are left out."""
    found = {"Title": title, "Subject" if suffix == ".pdf" else "Description": description}
    return _UNDATED[suffix] | {key: text for key, text in found.items() if text}
