"""Languages of the report: one catalogue each, from English phrases to its own.

Only phrases (`elastocal.wording.phrase`) are words of ours; any other text is a name or a figure
and stays as it is, but for the decimal sign. What other parts of the program say, such as the
warnings of a run, stays English, and the page says so.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

from elastocal.errors import ReportError
from elastocal.wording import Phrase

LANGUAGES = {"en": "English", "de": "Deutsch", "fr": "Français"}
"""Languages that a report can be written in, by their code."""
_BETWEEN_NUMBERS = re.compile(r"(?<=\d), (?=[-+−]?\d)")
_DECIMAL = re.compile(r"(?<![\w.])([-+−]?\d*)\.(\d+)(?![\w.])")


@dataclass(frozen=True)
class Language:
    """Words of one language."""

    code: str
    catalogue: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Its templates, by the English ones."""

    def say(self, text: object) -> str:
        """Return a text in this language."""
        if not self.catalogue:
            return str(text)
        if not isinstance(text, Phrase):
            return _with_decimal_comma(text) if isinstance(text, str) else str(text)
        template = self.catalogue.get(text.template, text.template)
        values = {name: self.say(value) for name, value in text.values.items()}
        return template.format(**values) if values else template


def _with_decimal_comma(text: str) -> str:
    """Return figures as they are written where a comma begins the decimals.

    >>> _with_decimal_comma("0.069 mm"), _with_decimal_comma("1.5, -2.0, 3.0 mm")
    ('0,069 mm', '1,5; -2,0; 3,0 mm')
    """
    if not _DECIMAL.search(text):
        return text
    return _DECIMAL.sub(r"\1,\2", _BETWEEN_NUMBERS.sub("; ", text))


@cache
def language_of(code: str) -> Language:
    """Return a language.

    Raises
    ------
    ReportError
        If the report knows no such language, with those that it knows.
    """
    if code not in LANGUAGES:
        raise ReportError(f"--language {code}: is not one of {', '.join(LANGUAGES)}")
    if code == "en":
        return Language(code)
    file = resources.files("elastocal.report").joinpath("words", f"{code}.json")
    return Language(code, json.loads(file.read_text(encoding="utf-8")))


ENGLISH = language_of("en")
