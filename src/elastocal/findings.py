"""Findings: judgements, warnings and refusals as data, from which sentences are formed.

A feature declares each kind of finding once, near the code that judges: its name, the English
sentence, its grade, and the advice. A file holds the kind and its values, with the sentence for
people who read the file. No decision depends on the words.

>>> MOVED = Kind("doc.moved", "pose {pose} moved by {by} mm", advice="Fix pose {pose}.",
...              shown={"by": as_number(".2f", 1e3)})
>>> found = MOVED(pose=3, by=0.00125)
>>> found, found.advice, found.values
('pose 3 moved by 1.25 mm', 'Fix pose 3.', {'pose': 3, 'by': 0.00125})
>>> Finding.read(found.stored()).kind
'doc.moved'
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from elastocal.wording import Phrase, counted, phrase


class Grade(Enum):
    """Severity of a finding."""

    NOTE = "note"
    """Information; it does not affect the light."""
    WARNING = "warning"
    """The light of the report is not green."""
    REFUSAL = "refusal"
    """The work cannot go on, or nothing that rests on it can be relied on."""


@dataclass(frozen=True)
class Kind:
    """A kind of finding; calling it with values makes a finding."""

    name: str
    """Stable identifier ``feature.what``; files hold it."""
    template: str
    """English sentence, with names of values in braces."""
    advice: str | Callable[[Mapping[str, Any]], str] = ""
    """Remedy, with the same values; empty where the sentence states it. A function forms it from
    the values where one sentence is not enough."""
    grade: Grade | None = Grade.WARNING
    """Severity; None: that of the finding among its values."""
    shown: Mapping[str, Callable[[Any], object]] = field(default_factory=dict)
    """Formats of values that are neither texts, whole numbers nor lists of them."""

    def __post_init__(self) -> None:
        """Register the kind."""
        if KINDS.setdefault(self.name, self) is not self:
            raise ValueError(f"two kinds of finding are named {self.name!r}")

    def __call__(self, **values: object) -> "Finding":
        """Return a finding of this kind; numbers in SI units."""
        return Finding(self.name, values)

    def parts(self, values: Mapping[str, Any]) -> dict[str, object]:
        """Return the values as the sentence shows them."""
        return {name: self.shown.get(name, _plain)(each) for name, each in values.items()}


KINDS: dict[str, Kind] = {}
"""All kinds whose feature was imported, by their names."""


class Finding(Phrase):
    """Something that was judged: its kind and its values. It is its English sentence."""

    kind: str
    """Name of its kind; empty for a sentence from a file older than kinds."""
    values: Mapping[str, Any]
    """JSON-ready data, numbers in SI units; findings may be among them."""
    advice: str
    """Remedy: its own advice, or that of a finding among its values."""

    def __new__(cls, kind: str, values: Mapping[str, Any], text: str | None = None) -> "Finding":
        """Return a finding.

        Parameters
        ----------
        kind : str
            Name of its kind.
        values : mapping
            Its values.
        text : str, optional
            The sentence where a file states it; by default it is made of the values.

        Raises
        ------
        LookupError
            If there is no such kind, or a value is missing, and no text is given.
        """
        known = KINDS[kind] if text is None else KINDS.get(kind)
        template, parts = ("", {}) if known is None else (known.template, known.parts(values))
        made = template.format(**parts)
        self = super().__new__(cls, made if text is None else text)
        self.template, self.parts = template, parts
        self.kind, self.values = kind, dict(values)
        self.advice = self._advised(known.advice if known else "")
        return self

    def _advised(self, own: str | Callable[[Mapping[str, Any]], str]) -> str:
        if callable(own):
            return own(self.values)
        if own:
            return phrase(own, **self.parts)
        return next((each.advice for each in self._inner() if each.advice), "")

    def __getnewargs__(self) -> Any:
        """Return the arguments that a copy is made of."""
        return self.kind, self.values, str.__str__(self)

    @property
    def grade(self) -> Grade:
        """Severity of the finding."""
        known = KINDS.get(self.kind)
        if known is not None and known.grade is not None:
            return known.grade
        return next((each.grade for each in self._inner()), Grade.WARNING)

    @property
    def holds_back(self) -> bool:
        """Whether it keeps the light of the report from being green."""
        return self.grade is not Grade.NOTE

    def _inner(self) -> list["Finding"]:
        return [each for each in self.values.values() if isinstance(each, Finding)]

    def without(self, text: str) -> "Finding":
        """Return the finding with a text left out of its values, such as the name of a folder."""
        values = {name: _without(text, value) for name, value in self.values.items()}
        return Finding(self.kind, values, str.__str__(self).replace(text, ""))

    def stored(self) -> Any:
        """Return the data in a file: kind, values, text; the text alone where there is no kind."""
        text = str.__str__(self)
        if not self.kind:
            return text
        return {"kind": self.kind, "values": _data(self.values), "text": text}

    @classmethod
    def read(cls, stored: object) -> "Finding":
        """Return the finding of a file; one whose kind is unknown here is its text.

        Raises
        ------
        ValueError
            If it is neither a text nor a finding.
        """
        match stored:
            case str(text):
                return cls("", {}, text)
            case {"kind": str(kind), "values": dict(values), "text": str(text), **more} if not more:
                inner = {
                    name: cls.read(value) if isinstance(value, dict) else value
                    for name, value in values.items()
                }
                try:
                    return cls(kind, inner, text)
                except (LookupError, TypeError, ValueError):
                    # A later version may give the kind other values.
                    return cls("", {}, text)
        raise ValueError("must be a text, or a finding with the keys kind, values and text")

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: object) -> Any:
        """Return the schema by which records read it."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(cls.read)


MORE_ALIKE = Kind("findings.more-alike", "{first} (and {more} more of this kind)", grade=None)


def group_alike(found: Iterable[str], most: int = 3) -> list[str]:
    """Return findings without repetition: several of one kind become one, with their number.

    Findings are shown to people in this form; files and ``--json`` hold all of them. A text that is
    no finding equals only itself.

    >>> ODD = Kind("doc.odd", "pose {pose} is odd")
    >>> group_alike([ODD(pose=n) for n in range(9)])
    ['pose 0 is odd (and 8 more of this kind)']
    >>> group_alike([ODD(pose=0), ODD(pose=1)])
    ['pose 0 is odd', 'pose 1 is odd']
    """
    kinds: dict[tuple[str, ...], list[str]] = {}
    for each in found:
        kinds.setdefault(_alike(each), []).append(each)
    shown: list[str] = []
    for alike in kinds.values():
        many = len(alike) > most
        shown += [MORE_ALIKE(first=alike[0], more=len(alike) - 1)] if many else alike
    return shown


def _alike(found: str) -> tuple[str, ...]:
    """Return the key that findings of one kind have in common."""
    if not isinstance(found, Finding) or not found.kind:
        return "", str(found)
    return found.kind, *(name for each in found._inner() for name in _alike(each))


def as_number(spec: str, scale: float = 1.0) -> Callable[[float], str]:
    """Return the formatter of a number: multiplied by a scale, in a format.

    >>> as_number("+.1f", 1e3)(0.0025)
    '+2.5'
    """
    return lambda value: format(scale * value, spec)


def as_count(noun: str) -> Callable[[int], str]:
    """Return the formatter of a whole number with its noun.

    >>> as_count("pose")(3)
    '3 poses'
    """
    return lambda number: counted(number, noun)


def _plain(value: object) -> object:
    """Return a value as a sentence shows it where its kind does not say otherwise."""
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else value


def _without(text: str, value: Any) -> Any:
    if isinstance(value, Finding):
        return value.without(text)
    return value.replace(text, "") if isinstance(value, str) else value


def _data(value: Any) -> Any:
    """Return a value as JSON-ready data; a number that is not finite is None."""
    if isinstance(value, Finding):
        return value.stored()
    if isinstance(value, Mapping):
        return {name: _data(each) for name, each in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_data(each) for each in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return str(value) if isinstance(value, str) else value
