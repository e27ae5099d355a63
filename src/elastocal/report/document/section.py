"""Sections: what the report shows of the evidence; ``blocks.html`` shows their blocks.

A section chooses what to show and never writes markup: texts are said in the language of the
report and escaped where they are shown, and figures drawn there.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from elastocal.blocks import Block
from elastocal.planning import PlanResult, PoolData
from elastocal.report.pages import render
from elastocal.report.plots import PlanView
from elastocal.results import brief_repr
from elastocal.verdict import Evidence
from elastocal.wording import Phrase, phrase


@brief_repr
@dataclass(frozen=True)
class PlanScene(Block):
    """The view of a plan in three dimensions."""

    view: PlanView
    plan: PlanResult
    pool: PoolData


@brief_repr
@dataclass(frozen=True)
class Content:
    """Everything that a section shows."""

    blocks: tuple[Block, ...]

    @property
    def scene(self) -> PlanScene | None:
        """Its view in three dimensions, if it has one."""
        return next((each for each in self.blocks if isinstance(each, PlanScene)), None)

    @cached_property
    def html(self) -> str:
        """The blocks as HTML."""
        return render("content.html", blocks=self.blocks)


@dataclass(frozen=True)
class Section:
    """One section: a title, the question that it answers, and how it is made from the evidence."""

    identifier: str
    """Identifier of the heading; also the key of its data."""
    title: Phrase
    question: Phrase
    place: int
    """Sections are in the order of these numbers."""
    blocks: Callable[[Evidence], Iterable[Block]]

    def body(self, evidence: Evidence) -> Content:
        """Return the blocks of the section."""
        return Content(tuple(self.blocks(evidence)))


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
        return ", ".join(map(_leaf, value)) or phrase("none")
    if isinstance(value, bool):
        return phrase("yes") if value else phrase("no")
    if isinstance(value, float):
        return f"{value:.10g}"
    return phrase("none") if value is None else str(value)
