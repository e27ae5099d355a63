"""Languages of the pages: one catalogue each, from English phrases to its own.

Only phrases (`elastocal.wording.phrase`), including findings, are translated; any other text is a
name or a figure and stays unchanged, except for the decimal sign. A sentence of a file that is no
finding stays English, and the page marks it as English.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

from elastocal import plugins
from elastocal.errors import ReportError
from elastocal.records import parse_json
from elastocal.units import with_fixed_units
from elastocal.wording import Phrase

if TYPE_CHECKING:
    from markupsafe import Markup

LANGUAGES = {"en": "English", "de": "Deutsch", "fr": "Français"}
"""Languages that a page can be written in, by their code."""
_BETWEEN_NUMBERS = re.compile(r"(?<=\d), (?=[-+−]?\d)")
_DECIMAL = re.compile(r"(?<![\w.])([-+−]?\d*)\.(\d+)(?![\w.])")
_BEFORE_SIGN = re.compile(" (?=[:;?!%»])")
_PLACE, _LETTER = re.compile(r"\{\w+\}"), re.compile("[A-Za-z]")
_SENTENCE = re.compile(
    r"\b(?:a|an|and|are|as|by|from|has|is|no|not|of|on|that|the|to|was|with)\b(?=.* .* )"
)
"""Mark of a sentence, as opposed to a name: a small word of English and two words after it."""


@dataclass(frozen=True)
class Language:
    """Words of one language."""

    code: str
    catalogue: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Its templates, by the English ones."""

    def say(self, text: object) -> str:
        """Return a text in this language, every number on one line with its unit."""
        return with_fixed_units(self._said(text)) if isinstance(text, str) else str(text)

    def _said(self, text: str) -> str:
        if not self.catalogue:
            return text
        known = self._template(text)
        if not known:
            return _with_decimal_comma(text)
        template = self.catalogue.get(known, known)
        values = {name: self.say(value) for name, value in _parts(text).items()}
        return template.format(**values) if values else template

    def markup(self, text: object) -> "Markup":
        """Return a text in this language as HTML, with what stayed English marked as English."""
        from markupsafe import Markup, escape

        if not self.catalogue or not isinstance(text, str):
            return escape(self.say(text))
        known = self._template(text)
        if not known:
            shown = escape(self.say(text))
            is_english = _SENTENCE.search(text)
            english = Markup('<span lang="en">{}</span>').format(with_fixed_units(text))
            return english if is_english else shown
        template = escape(self.catalogue.get(known, known))
        values = {name: self.markup(value) for name, value in _parts(text).items()}
        said = Markup(with_fixed_units(template.format(**values) if values else template))
        # A phrase of a plug-in that offers no words for it in this language.
        stays = known not in self.catalogue and _LETTER.search(_PLACE.sub("", known))
        return Markup('<span lang="en">{}</span>').format(said) if stays else said

    def _template(self, text: str) -> str:
        """Return the template of a text of elastocal; None for names, figures and foreign words."""
        return getattr(text, "template", "") or (text if text in self.catalogue else "")


def _parts(text: str) -> Mapping[str, object]:
    return text.parts if isinstance(text, Phrase) else {}


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
        Code of `LANGUAGES`.
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
    catalogue = parse_json(file.read_text(encoding="utf-8"), file.name)
    for words in plugins.load_all("words", code):
        catalogue = {**words, **catalogue}
    if code == "fr":
        catalogue = {each: _with_fixed_spaces(said) for each, said in catalogue.items()}
    return Language(code, catalogue)


def _with_fixed_spaces(text: str) -> str:
    """Return a French text whose signs stay on the line of the word before them.

    >>> _with_fixed_spaces("pose 14 : 95 % des erreurs").replace(chr(160), "_")
    'pose 14_: 95_% des erreurs'
    """
    return _BEFORE_SIGN.sub("\N{NO-BREAK SPACE}", text)


ENGLISH = language_of("en")
