"""The whole document: self-contained, in order, the same for equal runs."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import pytest

from elastocal import dataset
from elastocal.codec import read_codec, write_codec
from elastocal.errors import FileAccessError
from elastocal.procedure import file_sha256, read_journal
from elastocal.report import language_of, write_plan_page
from elastocal.report.document import write_report
from elastocal.report.document.page import ordered_sections
from elastocal.verdict import Evidence, EvidenceOptions, gather_evidence
from elastocal.verdict.evidence import MissingPart
from support.pages import english_left, texts_of
from support.reported import MADE
from support.sealed import edit, edit_journal

LATER = "2027-08-09T10:11:12+00:00"
MANIFEST = re.compile(r'id="manifest">.*?<')
STAMP = re.compile(r"\d{4}-\d\d-\d\d(T[\d:]+\+00:00| [\d:]+ UTC)")


class Page(HTMLParser):
    """Collects tags and the order of headings."""

    def __init__(self, text):
        super().__init__()
        self.tags = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def named(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]


@pytest.fixture(scope="module")
def text(parts, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    return write_report(path, parts).path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


def test_page_loads_nothing_and_forbids_itself_the_network(page):
    for tag, attributes in page.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base"}
        assert attributes.get("src", "data:").startswith("data:")
        assert not {"srcset", "background", "action"} & attributes.keys()
    assert all(each["href"].startswith("#") for each in page.named("a"))
    (policy,) = [each["content"] for each in page.named("meta") if "http-equiv" in each]
    assert policy.startswith("default-src 'none'")


def test_file_is_below_three_megabytes(text):
    assert len(text.encode()) < 3e6


def test_headings_follow_in_order_below_one_title(page):
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h\d", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))


def test_every_link_of_the_contents_leads_somewhere(page):
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(set(ids)) == len(ids)
    links = {each["href"][1:] for each in page.named("a")}
    assert links <= set(ids)
    assert links == {section.identifier for section in ordered_sections()} | {"verdict"}


def test_landmarks_and_pictures_have_names(page):
    assert len(page.named("main")) == len(page.named("header")) == len(page.named("footer")) == 1
    ids = {attributes.get("id") for _, attributes in page.tags}
    for tag in ("section", "nav"):
        for each in page.named(tag):
            assert each["aria-labelledby"] in ids
    for each in page.named("img"):
        assert len(each["alt"]) > 20
    assert page.named("html")[0]["lang"] == "en"


def test_certificate_verdict_and_signature_come_before_the_appendix(text):
    names = ("verdict", "signature", "findings", "cell", "provenance")
    places = [text.index(f'id="{name}"') for name in names]
    assert places == sorted(places)


def run_of(folder):
    """Return the hash that a run is known by; the time at which it began is in it."""
    return read_journal(folder / "run" / "journal.jsonl")[0].run.identity


@pytest.mark.slow
def test_equal_runs_give_equal_reports_but_for_times(text, finished, copied, tmp_path):
    folder = copied()
    journal, summary = (folder / "run" / name for name in ("journal.jsonl", "summary.json"))
    assert all(STAMP.search(path.read_text(encoding="utf-8")) for path in (journal, summary))
    edit_journal(journal, lambda found: STAMP.sub(LATER, found))
    history = STAMP.sub(LATER, (finished / "runs.jsonl").read_text(encoding="utf-8"))
    renamed = history.replace(run_of(finished), run_of(folder))
    (folder / "runs.jsonl").write_text(renamed, encoding="utf-8")
    data = dataset.read(folder / "run" / "dataset.nc").to_xarray().copy()
    data.attrs["provenance"] = STAMP.sub(LATER, data.attrs["provenance"])
    data.attrs["made_from"] = json.dumps({"journal.jsonl": file_sha256(journal)})
    dataset.write(dataset.Dataset.from_xarray(data), folder / "run" / "dataset.nc")
    summary.write_text(STAMP.sub(LATER, summary.read_text(encoding="utf-8")), encoding="utf-8")
    rewritten = file_sha256(folder / "run" / "dataset.nc")
    edit(summary, lambda told: told.update(dataset_sha256=rewritten))
    codec = read_codec(folder / "codec")
    write_codec(folder / "codec", replace(codec, provenance=STAMP.sub(LATER, codec.provenance)))
    again = write_report(tmp_path / "b.html", gather_evidence(EvidenceOptions(folder), LATER))
    other = again.path.read_text(encoding="utf-8")
    assert other != text
    shown = text.replace(run_of(finished)[:16], run_of(folder)[:16])
    # The manifest has the hashes of files as they are, times included.
    assert MANIFEST.sub("", STAMP.sub("T", other)) == MANIFEST.sub("", STAMP.sub("T", shown))


def test_times_are_marked_as_such(page):
    stamps = [each for each in page.named("time") if each.get("class") == "stamp"]
    assert len(stamps) == 5
    assert MADE in {each["datetime"] for each in stamps}


def test_names_are_escaped(parts, tmp_path):
    bad = '</script><script>alert(1)</script><img src="http://x">'
    spoilt = replace(
        parts, name=bad, cell=None, plan=None, cell_text=bad, missing=(MissingPart(bad, bad),)
    )
    text = write_report(tmp_path / "p.html", spoilt).path.read_text(encoding="utf-8")
    assert "alert(1)</script>" not in text
    assert "<img src=" not in text.replace('<img src="data:', "")
    assert len(Page(text).named("script")) == 3


def test_without_anything_it_is_small(tmp_path):
    path = write_report(tmp_path / "p.html", Evidence(made=MADE)).path
    assert path.stat().st_size < 60_000
    assert "What was not verified" in path.read_text(encoding="utf-8")


def test_a_report_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(FileAccessError, match="cannot write"):
        write_report(tmp_path / "no" / "p.html", Evidence(made=MADE))
    assert not list(tmp_path.iterdir())


class TestInGerman:
    """No English sentence is left on a page in German that is not marked as English."""

    german = language_of("de")

    @pytest.mark.slow
    def test_the_report(self, parts, tmp_path):
        page = write_report(tmp_path / "de.html", parts, language=self.german).path
        text = page.read_text("utf-8")
        assert english_left(text) == []
        assert len(texts_of(text)) > 1000
        # The data of the view are said too: hints, layers, cameras.
        assert "nearest to refusal" not in text

    def test_the_plan(self, parts, tmp_path):
        path = tmp_path / "plan.html"
        write_plan_page(path, parts.cell, parts.surface, parts.plan, parts.pool, self.german)
        text = path.read_text("utf-8")
        assert english_left(text) == []
        assert "<title>Kalibrierplan: " in text
        assert "liegen" in text or "Posen, gewählt mit" in text

    def test_what_the_test_looks_for_is_there_in_english(self, parts, tmp_path):
        page = write_report(tmp_path / "en.html", parts).path
        text = page.read_text("utf-8").replace('<html lang="en"', '<html lang="de"')
        assert len(english_left(text)) > 50
