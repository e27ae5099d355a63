"""What workflows return: short in a console, a table in a notebook, a picture when asked for."""

import dataclasses
import html
import importlib
from typing import Any

MOST_LINES = 20
"""Longest representation in a console."""
_LONGEST = 60


class Result:
    """Base of the records that workflows return.

    Sub-classes are frozen dataclasses; `facts` may be overridden where the fields alone do not
    say what a person wants to know first.
    """

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first: pairs of a label and its text."""
        return tuple(
            (each.name.replace("_", " "), brief(getattr(self, each.name)))
            for each in dataclasses.fields(self)  # type: ignore[arg-type]
        )

    def plot(self) -> Any:
        """Return a Matplotlib figure that shows the result.

        Raises
        ------
        ReportError
            If there is no picture of this kind of result.
        """
        # Pictures stand above results in the layers: they are looked up only when asked for.
        return importlib.import_module("elastocal.report").plot_result(self)

    def __repr__(self) -> str:
        """Return the facts, at most 20 lines of them."""
        facts = self.facts()
        lines = [f"  {label}: {text}" for label, text in facts]
        if len(lines) >= MOST_LINES:
            lines = [*lines[: MOST_LINES - 2], f"  … and {len(lines) - MOST_LINES + 2} more"]
        return "\n".join([type(self).__name__, *lines])

    def _repr_html_(self) -> str:
        """Return the facts as a table, for notebooks."""
        rows = "".join(
            f"<tr><th scope='row'>{html.escape(label)}</th><td>{html.escape(text)}</td></tr>"
            for label, text in self.facts()
        )
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


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
        return text if 0 < len(text) <= _LONGEST else f"{len(value)} entries"
    if isinstance(value, dict):
        return f"{len(value)} entries"
    text = " ".join(str(value).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
