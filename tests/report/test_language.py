"""One catalogue a language: every phrase of the program in it, and nothing else."""

import ast
import functools
import importlib
import json
import re
from pathlib import Path

import pytest

import elastocal
from elastocal.errors import ReportError
from elastocal.findings import KINDS, Finding, group_alike
from elastocal.identification.calibration import SAME_CONFIGURATION
from elastocal.identification.mistakes.plausibility import UNIT_OF_FORCE
from elastocal.identification.mistakes.search import IN_SPITE
from elastocal.planning import checks
from elastocal.planning.plan import ASSUMED
from elastocal.planning.pool import UNREACHABLE
from elastocal.planning.surface.findings import OPEN
from elastocal.procedure.record import ReadingStatus
from elastocal.report import language_of
from elastocal.report.language import LANGUAGES
from elastocal.robot import catalogue
from elastocal.wording import counted, in_words, mm, phrase, sentences

SOURCE = Path(elastocal.__file__).parent
CATALOGUES = {
    code: json.loads((SOURCE / "report" / "words" / f"{code}.json").read_text(encoding="utf-8"))
    for code in LANGUAGES
    if code != "en"
}
PLACE = re.compile(r"\{(\w+)\}")


@functools.cache
def trees():
    """Return what is parsed of every source that has a phrase."""
    texts = {path: path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}
    return {
        path: ast.parse(text)
        for path, text in texts.items()
        if "phrase" in text or "elastocal.findings" in text
    }


def constants(node):
    """Return the texts that an argument may be."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.IfExp):
        return constants(node.body) + constants(node.orelse)
    return []


def kinds_of_findings():
    """Return the kinds of findings of all features."""
    for path in trees():
        parts = path.relative_to(SOURCE.parent).with_suffix("").parts
        if "Kind(" in path.read_text(encoding="utf-8") and parts[-1] != "findings":
            importlib.import_module(".".join(parts))
    importlib.import_module("elastocal.verdict.findings")
    own = [each for each in KINDS.values() if not each.name.startswith(("test.", "doc."))]
    assert len(own) > 60
    return own


def phrases_of_the_program():
    found = {each.template for each in kinds_of_findings()}
    found |= {each.advice for each in kinds_of_findings() if isinstance(each.advice, str)}
    for tree in trees().values():
        for node in ast.walk(tree):
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


def counts_of_the_pages():
    """Return the templates of numbers with a noun, where a phrase may hold them."""
    nouns = set()
    for path, tree in trees().items():
        calls = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        ]
        says = "phrase" in path.read_text(encoding="utf-8")
        shown = (says and path.is_relative_to(SOURCE / "verdict")) or any(
            node.func.id in ("phrase", "as_count") for node in calls
        )
        if shown and path.name != "wording.py":
            nouns |= {
                noun
                for node in calls
                if node.func.id in ("counted", "as_count")
                for noun in constants(node.args[-1])
            }
    return {f"{{number}} {noun}{end}" for noun in nouns for end in ("", "s")}


LIGHTS = {f"{colour} light" for colour in ("green", "yellow", "red")}
CHECKS = {UNREACHABLE} | {
    in_words(kind.name)
    for kind in (getattr(checks, name) for name in dir(checks) if name.endswith("Check"))
    if isinstance(getattr(kind, "name", None), str)
}
"""What may refuse a candidate: names in files, words on a page."""
STATUSES = {status.value for status in ReadingStatus}
ASSUMPTIONS = {
    text
    for name in catalogue.names()
    for each in catalogue.load(name).assumptions
    for text in (each.field, each.reason)
}
"""What the catalogue assumes of its robots: a URDF holds the sentences."""


@functools.cache
def all_phrases():
    return (
        phrases_of_the_program() | counts_of_the_pages() | LIGHTS | CHECKS | STATUSES | ASSUMPTIONS
    )


@pytest.mark.parametrize("code", CATALOGUES)
class TestEveryCatalogue:
    @pytest.mark.slow
    def test_it_has_every_phrase(self, code):
        missing = sorted(all_phrases() - CATALOGUES[code].keys())
        assert not missing, f"not in words/{code}.json:\n" + "\n".join(missing)

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


def test_french_has_one_apostrophe():
    assert not [text for text in CATALOGUES["fr"].values() if re.search(r"\w'[\w{«]", text)]


def test_there_are_hundreds_of_phrases():
    assert len(all_phrases()) > 300


def test_a_phrase_within_a_phrase_is_said_too():
    said = phrase("The tolerance is {tolerance} ({source}).", tolerance=mm(3e-4), source="x")
    assert language_of("de").say(said) == "Die Toleranz ist 0,300\N{NO-BREAK SPACE}mm (x)."
    both = sentences([said, counted(3, "pose")])
    assert language_of("fr").say(both).endswith(" 3 poses")
    assert str(both) == "The tolerance is 0.300 mm (x). 3 poses"


def test_what_is_no_phrase_stays_but_for_its_decimal_sign():
    german = language_of("de")
    assert german.say("joint_a1.axial") == "joint_a1.axial"
    assert german.say("1.5, -2.0, 3.0 mm") == "1,5; -2,0; 3,0\N{NO-BREAK SPACE}mm"
    assert german.say("1.2.3") == "1.2.3"
    assert language_of("en").say("1.5, 2.0") == "1.5, 2.0"


class TestTextsFromFiles:
    """A file holds a finding with its values, which any language can say."""

    german = language_of("de")

    def test_a_finding_is_said_in_german_with_its_values(self):
        read = Finding.read(json.loads(json.dumps(SAME_CONFIGURATION(poses=(3, 4)).stored())))
        assert self.german.say(read) == (
            "Posen 3, 4 sind eine Stellung: gemeinsam gezogen und ausgelassen"
        )

    def test_what_the_catalogue_assumes_is_said_too(self):
        assumed = {
            each.field: each.reason for each in catalogue.load("KR 210 R3100 ultra").assumptions
        }
        said = self.german.say(ASSUMED(field="shape", reason=assumed["shape"]))
        assert (
            said == "angenommen, Form: Quader und Zylinder nach den Maßen, nicht nach Zeichnungen"
        )

    def test_findings_within_it_are_said_too(self):
        many = group_alike([SAME_CONFIGURATION(poses=(3, 4))] * 5)
        (kept,) = [Finding.read(each.stored()) for each in many]
        assert self.german.say(kept) == (
            "Posen 3, 4 sind eine Stellung: gemeinsam gezogen und ausgelassen"
            " (und 4 weitere dieser Art)"
        )

    def test_a_finding_is_said_without_the_folder_that_it_names(self):
        found = OPEN(name="afp/dome.stl", count=128).without("afp/")
        assert found.startswith("dome.stl is an open mesh")
        assert self.german.say(found).startswith("dome.stl ist ein offenes Netz")
        assert (
            IN_SPITE(error=found).without("dome.").parts["error"].startswith("stl is an open mesh")
        )

    def test_units_of_which_one_holds_are_said_too(self):
        found = UNIT_OF_FORCE(unit=["kgf", "lbf"], share=0.2, times=9.8)
        assert "look like kgf or lbf in" in found
        assert "kgf oder lbf" in self.german.say(Finding.read(found.stored()))

    def test_a_sentence_of_an_older_file_stays_english(self):
        text = "poses 3, 4 are one configuration: resampled and left out together"
        assert self.german.say(Finding.read(text)) == text
        assert 'lang="en"' in self.german.markup(Finding.read(text))

    def test_what_is_none_of_ours_stays_and_is_marked_as_english(self):
        text = "the fixture of bay 7 was moved by hand & put back"
        assert self.german.say(text) == text
        assert str(self.german.markup(text)) == (
            '<span lang="en">the fixture of bay 7 was moved by hand &amp; put back</span>'
        )
        assert str(language_of("en").markup(text)).startswith("the fixture of bay 7")
        for name in ("KR 120 R2700 extra HA", "rail, joint_a1, joint_a2", "normal, north, south"):
            assert str(self.german.markup(name)) == name


def test_an_unknown_language_is_refused_with_those_that_there_are():
    with pytest.raises(ReportError, match="--language it: is not one of en, de, fr"):
        language_of("it")


if __name__ == "__main__":
    print("\n".join(sorted(all_phrases())))
