"""What a section of the report is."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from elastocal.verdict.evidence import Evidence


@dataclass(frozen=True)
class Finding:
    """Something that a reader of the verdict has to know."""

    text: str
    holds_back: bool = True
    """Whether it keeps the light from being green."""
    advice: str = ""
    """What to do about it; empty where the text says it."""


@dataclass(frozen=True)
class Content:
    """What a section shows."""

    html: str
    data: dict[str, Any] = field(default_factory=dict)
    """For the script of the page."""
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class Section:
    """One section: a title, and how it is made from the evidence, whichever are there."""

    identifier: str
    """Of the heading; also the key of its data."""
    title: str
    body: Callable[[Evidence], Content]
