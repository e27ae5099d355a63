"""Display of results and data: short in a console, a table in a notebook, a figure."""

import dataclasses
import html
import importlib
from collections.abc import Collection, Iterable
from typing import Any, TypeVar

from elastocal.findings import group_alike

MOST_LINES = 20
"""Longest representation in a console."""
MOST_CHARACTERS = 1500
"""Longest representation in a console."""
REMARKS = ("warning", "finding", "note")
"""Labels of facts of which there may be hundreds of one kind, and which are to be noticed."""
_LONGEST = 60
_LONGEST_LINE = 200
_LEFT = "style='text-align:left'"
"""Jupyter would set them to the right."""

T = TypeVar("T")


class Result:
    """Base of the records that workflows return, and of data that a notebook shows.

    Sub-classes are frozen dataclasses; `facts` may be overridden where the fields alone do not give
    the main results. Every figure among them has its unit, its sample count and, for an error,
    whether it was held out.
    """

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts: pairs of a label and its text."""
        return tuple(
            (each.name.replace("_", " "), brief(getattr(self, each.name)))
            for each in dataclasses.fields(self)  # type: ignore[arg-type]
        )

    def show(self) -> Iterable[Any]:
        """Return the result for a reader, as `elastocal.blocks`: by default its facts."""
        # Blocks are above results in the layers.
        return (importlib.import_module("elastocal.blocks").Facts(tuple(self._shown())),)

    def pictured(self) -> object:
        """Return the subject of a picture: the result itself, or data that it holds."""
        return self

    def plot(self) -> Any:
        """Return a Matplotlib figure that shows the result.

        Raises
        ------
        ReportError
            If there is no picture of this kind of result.
        """
        # Figures are above results in the layers: they are imported only when needed.
        return importlib.import_module("elastocal.report").plot_result(self.pictured())

    def __repr__(self) -> str:
        """Return the facts, at most 20 lines of them."""
        lines = [_cut(f"  {label}: {text}", _LONGEST_LINE) for label, text in self._shown()]
        shown = len(lines) if len(lines) < MOST_LINES else MOST_LINES - 2
        while sum(map(len, lines[:shown])) > MOST_CHARACTERS - 100:
            shown -= 1
        rest = [f"  … and {len(lines) - shown} more"] if shown < len(lines) else []
        return "\n".join([type(self).__name__, *lines[:shown], *rest])

    def _shown(self) -> list[tuple[str, str]]:
        """Return the facts; warnings of one kind are merged at the position of the first."""
        facts, shown = self.facts(), list[tuple[str, str]]()
        for label, text in facts:
            if label not in REMARKS:
                shown.append((label, text))
            elif (label, text) == next(fact for fact in facts if fact[0] == label):
                alike = (each for name, each in facts if name == label)
                shown += [(label, each) for each in group_alike(alike)]
        return shown

    def _repr_html_(self) -> str:
        """Return the facts as a table, and the tables below it, for notebooks."""
        blocks = importlib.import_module("elastocal.blocks")
        shown = "".join(
            _html_table(
                each.caption,
                _html_row(each.heads, each.texts, "th"),
                (_html_row(map(blocks.cell_text, row), each.texts) for row in each.rows),
            )
            for each in blocks.every_table(self.show())
        )
        facts = (_html_row(pair, 2) for pair in self._shown())
        return _html_table(type(self).__name__, "", facts) + shown


def _html_table(caption: str, head: str, rows: Iterable[str]) -> str:
    return f"<table><caption>{html.escape(caption)}</caption>{head}{''.join(rows)}</table>"


def _html_row(cells: Iterable[str], texts: int, tag: str = "td") -> str:
    """Return a row whose first cell names it, with this number of cells aligned to the left."""
    made = []
    for number, cell in enumerate(cells):
        kind, scope = (tag, "") if number else ("th", " scope='row'" if tag == "td" else "")
        side = f" {_LEFT}" if number < texts else ""
        made.append(f"<{kind}{scope}{side}>{html.escape(cell)}</{kind}>")
    return f"<tr>{''.join(made)}</tr>"


def brief_repr(cls: type[T]) -> type[T]:
    """Give a dataclass with arrays, long texts or many items a repr of one line.

    >>> @brief_repr
    ... @dataclasses.dataclass
    ... class Way:
    ...     name: str
    ...     stops: tuple[int, ...]
    >>> Way("a", tuple(range(99)))
    Way(name='a', stops=99 entries)
    """
    if issubclass(cls, Result):
        raise TypeError(f"{cls.__name__} is a Result: it shows its facts, in a console as well")

    def show(self: Any) -> str:
        values = {
            each.name: getattr(self, each.name) for each in dataclasses.fields(self) if each.repr
        }
        texts = ", ".join(f"{name}={_literally(value)}" for name, value in values.items())
        return _cut(f"{type(self).__qualname__}({texts})", MOST_CHARACTERS)

    cls.__repr__ = show  # type: ignore[method-assign]
    return cls


def brief(value: Any) -> str:
    """Return a value in a few words: arrays by their shape, long lists by their length.

    >>> brief((1.0, 2.0))
    '1, 2'
    >>> brief(0.000123456)
    '0.000123456'
    """
    if isinstance(value, float):
        return f"{value:.6g}"
    if hasattr(value, "shape"):
        return f"array of shape {value.shape}"
    if isinstance(value, tuple | list):
        text = ", ".join(brief(each) for each in value) if len(value) <= 6 else ""
        return text if 0 < len(text) <= _LONGEST else _entries(value)
    if isinstance(value, Collection) and not isinstance(value, str | bytes):
        return _entries(value)
    return _cut(" ".join(str(value).split()), _LONGEST)


def _literally(value: Any) -> str:
    if not isinstance(value, str):
        return brief(value)
    lines = value.count("\n") + 1
    return repr(brief(value)) if lines == 1 else f"{lines} lines"


def _entries(value: Collection[Any]) -> str:
    return f"{len(value)} entries" if len(value) != 1 else "1 entry"


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[: longest - 1]}…"
