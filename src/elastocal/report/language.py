"""Languages of the pages: one catalogue each, from English phrases to its own.

Only phrases (`elastocal.wording.phrase`) are words of ours; any other text is a name or a figure
and stays as it is, but for the decimal sign. A file holds the English text of a phrase alone: where
a page shows what a file says, such as the warnings of a run, the phrase is found again by its
template. What no template gave stays English, and the page marks it as English.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib import resources
from typing import TYPE_CHECKING

from elastocal.errors import ReportError
from elastocal.records import parse_json
from elastocal.wording import Phrase, phrase, sentences

if TYPE_CHECKING:
    from markupsafe import Markup

LANGUAGES = {"en": "English", "de": "Deutsch", "fr": "Français"}
"""Languages that a page can be written in, by their code."""
_BETWEEN_NUMBERS = re.compile(r"(?<=\d), (?=[-+−]?\d)")
_DECIMAL = re.compile(r"(?<![\w.])([-+−]?\d*)\.(\d+)(?![\w.])")
_PLACE = re.compile(r"\{(\w+)\}")
_LETTER = re.compile("[A-Za-z]")
_WORDS = re.compile(r"[A-Za-z]{2,}[,:;]? [A-Za-z(]{2,}|^\d+ [a-z]{3,}")
"""What a text has that may be a phrase: two words, or a count with its noun."""
_SENTENCE = re.compile(
    r"\b(?:a|an|and|are|as|by|from|has|is|no|not|of|on|that|the|to|was|with)\b(?=.* .* )"
)
"""What is no name: a small word of English, and two words after it."""
_LEAST_LETTERS = 10
"""Letters that a template must have, or too much would look like it."""


@dataclass(frozen=True)
class Language:
    """Words of one language."""

    code: str
    catalogue: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Its templates, by the English ones."""

    def say(self, text: object) -> str:
        """Return a text in this language."""
        if not self.catalogue or not isinstance(text, str):
            return str(text)
        known = text if isinstance(text, Phrase) else self.recall(text)
        if known is None:
            return _with_decimal_comma(text)
        template = self.catalogue.get(known.template, known.template)
        values = {name: self.say(value) for name, value in known.values.items()}
        return template.format(**values) if values else template

    def markup(self, text: object) -> "Markup":
        """Return a text in this language as HTML, with what stayed English marked as English."""
        from markupsafe import Markup, escape

        if not self.catalogue or not isinstance(text, str):
            return escape(str(text))
        known = text if isinstance(text, Phrase) else self.recall(text)
        if known is None:
            shown = escape(_with_decimal_comma(text))
            is_english = _SENTENCE.search(text)
            return Markup('<span lang="en">{}</span>').format(text) if is_english else shown
        template = escape(self.catalogue.get(known.template, known.template))
        values = {name: self.markup(value) for name, value in known.values.items()}
        return template.format(**values) if values else template

    def recall(self, text: str) -> Phrase | None:
        """Return the phrase that a text from a file was, or None where it was none of ours."""
        return _recalled(self.code, text) if _WORDS.search(text) else None


@lru_cache(maxsize=4096)
def _recalled(code: str, text: str) -> Phrase | None:
    if text in language_of(code).catalogue:
        return phrase(text)
    for begin, end, pattern, template in _patterns(code):
        if text.startswith(begin) and text.endswith(end) and (found := pattern(text)):
            return phrase(template, **found.groupdict())
    for between in ("; ", ": "):
        if between not in text:
            continue
        parts = [_recalled(code, part) or part for part in text.split(between)]
        ours = [isinstance(part, Phrase) for part in parts]
        # A single word among them is a name.
        if any(ours) and all(" " not in part or our for part, our in zip(parts, ours, strict=True)):
            return sentences(parts, between)
    return None


@cache
def _patterns(
    code: str,
) -> list[tuple[str, str, Callable[[str], re.Match[str] | None], str]]:
    """Return how each template with values begins and ends, and what matches it, longest first."""
    found = []
    for template in language_of(code).catalogue:
        literals, names = _PLACE.split(template)[::2], _PLACE.findall(template)
        letters = len(_LETTER.findall("".join(literals)))
        if not names or (letters < _LEAST_LETTERS and names != ["number"]):
            continue
        text, seen = re.escape(literals[0]), set[str]()
        for name, literal in zip(names, literals[1:], strict=True):
            value = r"\d+" if name == "number" else ".+?"
            text += (f"(?P={name})" if name in seen else f"(?P<{name}>{value})") + re.escape(
                literal
            )
            seen.add(name)
        matched = re.compile(text, re.DOTALL).fullmatch
        found.append((letters, (literals[0], literals[-1], matched, template)))
    return [entry for _, entry in sorted(found, key=lambda each: -each[0])]


def _with_decimal_comma(text: str) -> str:
    """Return figures as they are written where a comma begins the decimals.

    >>> _with_decimal_comma("0.069 mm"), _with_decimal_comma("1.5, -2.0, 3.0 mm")
    ('0,069 mm', '1,5; -2,0; 3,0 mm')
    """
    if not _DECIMAL.search(text):
        return text
    return _DECIMAL.sub(r"\1,\2", _BETWEEN_NUMBERS.sub("; ", text))


@cache
def language_of(code: str, option: str = "--language") -> Language:
    """Return a language.

    Parameters
    ----------
    code : str
        Of `LANGUAGES`.
    option : str
        Where it was given.

    Raises
    ------
    ReportError
        If the pages know no such language, with those that they know.
    """
    if code not in LANGUAGES:
        raise ReportError(f"{option} {code}: is not one of {', '.join(LANGUAGES)}")
    if code == "en":
        return Language(code)
    file = resources.files("elastocal.report").joinpath("words", f"{code}.json")
    return Language(code, parse_json(file.read_text(encoding="utf-8"), file.name))


ENGLISH = language_of("en")
