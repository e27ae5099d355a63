"""One catalogue a language: every phrase of the program in it, and nothing else."""

import ast
import functools
import json
import re
from pathlib import Path

import pytest

import elastocal
from elastocal.errors import ReportError
from elastocal.report import LANGUAGES, language_of
from elastocal.wording import counted, mm, phrase, sentences

SOURCE = Path(elastocal.__file__).parent
CATALOGUES = {
    code: json.loads((SOURCE / "report" / "words" / f"{code}.json").read_text(encoding="utf-8"))
    for code in LANGUAGES
    if code != "en"
}
PLACE = re.compile(r"\{(\w+)\}")


def constants(node):
    """Return the texts that an argument may be."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.IfExp):
        return constants(node.body) + constants(node.orelse)
    return []


def phrases_of_the_program():
    found = set()
    for path in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args):
                continue
            if node.func.id == "phrase":
                found |= set(constants(node.args[0]))
            elif node.func.id == "phrases":
                found |= {text for each in node.args for text in constants(each)}
    for path in (SOURCE / "report" / "pages" / "templates").iterdir():
        text = path.read_text(encoding="utf-8")
        found |= {
            first or second
            for first, second in re.findall(
                r'"([^"]+)" \| words|"([^"]+)" (?:if [^|]+ else "[^"]+")?\) \| words', text
            )
        }
        found |= set(re.findall(r'else "([^"]+)"\) \| words', text))
    return {each for each in found if re.search("[A-Za-z]", PLACE.sub("", each))}


def counts_of_the_report():
    """Return the templates of numbers with a noun, of which the report counts some."""
    nouns = set()
    for package in ("report/document", "verdict"):
        for path in (SOURCE / package).rglob("*.py"):
            if path.name == "geometry_page.py":
                # The page of another command, which speaks English alone.
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if (
                    isinstance(node, ast.Call)
                    and isinstance(node.func, ast.Name)
                    and node.func.id == "counted"
                ):
                    nouns |= set(constants(node.args[1]))
    return {f"{{number}} {noun}{end}" for noun in nouns for end in ("", "s")}


LIGHTS = {f"{colour} light" for colour in ("green", "yellow", "red")}


@functools.cache
def all_phrases():
    return phrases_of_the_program() | counts_of_the_report() | LIGHTS


@pytest.mark.parametrize("code", CATALOGUES)
class TestEveryCatalogue:
    def test_it_has_every_phrase(self, code):
        assert sorted(all_phrases() - CATALOGUES[code].keys()) == []

    def test_it_has_no_phrase_that_nobody_says(self, code):
        assert sorted(CATALOGUES[code].keys() - all_phrases()) == []

    def test_every_value_has_its_place(self, code):
        for english, other in CATALOGUES[code].items():
            assert sorted(PLACE.findall(english)) == sorted(PLACE.findall(other)), english
            assert other.strip() == other != "", english

    def test_sentences_end_as_sentences(self, code):
        for english, other in CATALOGUES[code].items():
            assert english.endswith(".") is other.endswith("."), english

    def test_commands_stay_commands(self, code):
        for english, other in CATALOGUES[code].items():
            assert re.findall("`[^`]+`", english) == re.findall("`[^`]+`", other), english


def test_there_are_hundreds_of_phrases():
    assert len(all_phrases()) > 300


def test_a_phrase_within_a_phrase_is_said_too():
    said = phrase("The tolerance is {tolerance} ({source}).", tolerance=mm(3e-4), source="x")
    assert language_of("de").say(said) == "Die Toleranz ist 0,300 mm (x)."
    both = sentences([said, counted(3, "pose")])
    assert language_of("fr").say(both).endswith(" 3 poses")
    assert str(both) == "The tolerance is 0.300 mm (x). 3 poses"


def test_what_is_no_phrase_stays_but_for_its_decimal_sign():
    german = language_of("de")
    assert german.say("joint_a1.axial") == "joint_a1.axial"
    assert german.say("1.5, -2.0, 3.0 mm") == "1,5; -2,0; 3,0 mm"
    assert german.say("1.2.3") == "1.2.3"
    assert language_of("en").say("1.5, 2.0") == "1.5, 2.0"


def test_an_unknown_language_is_refused_with_those_that_there_are():
    with pytest.raises(ReportError, match="--language it: is not one of en, de, fr"):
        language_of("it")


if __name__ == "__main__":
    print("\n".join(sorted(all_phrases())))
