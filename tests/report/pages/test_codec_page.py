"""The interactive page of a codec, and all its files."""

import json
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest

from elastocal.errors import CodecError, FileAccessError
from elastocal.report import write_codec_figures
from elastocal.report.pages.codec_page import write_codec_page
from elastocal.report.plots import (
    write_figure,
)
from elastocal.units import with_fixed_units
from support.cli import PATIENCE
from support.codecs import judged, renamed, without_errors
from support.pages import Page, with_script


@pytest.fixture(scope="module")
def known():
    return judged()


@pytest.fixture(scope="module")
def written(tmp_path_factory, known):
    path = tmp_path_factory.mktemp("page") / "codec.html"
    return write_codec_page(
        path, known.data, known.verdicts, known.insight.seen, known.insight.correlations
    )


@pytest.fixture(scope="module")
def text(written):
    return written.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def shown(text):
    return json.loads(Page(text).data)


@pytest.mark.slow
def test_page_loads_nothing_and_forbids_itself_the_network(text):
    tags = Page(text).tags
    for tag, attributes in tags:
        assert tag not in {"link", "img", "iframe", "object", "embed", "base"}
        assert not {"src", "srcset", "background", "action"} & attributes.keys()
    (policy,) = [a["content"] for _, a in tags if "http-equiv" in a]
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy


def test_every_figure_is_one_that_plotly_knows(shown):
    views = [view for chart in shown["charts"].values() for view in chart]
    assert len(views) == 4 + 18
    for view in views:
        go.Figure(view["figure"])
        assert view["told"].startswith("Box plots of")


def test_boxes_on_screen_have_the_numbers_of_the_arrays(known, shown):
    (norm,) = [view for view in shown["charts"]["errors"] if view["name"] == "Norm"]
    boxes = [trace for trace in norm["figure"]["data"] if trace["type"] == "box"]
    assert [trace["meta"] for trace in boxes] == [0, 1, 0, 1]
    for trace, (name, which) in zip(
        boxes,
        [(name, which) for which in ("mean", "max") for name in ("actuated", "bearing")],
        strict=True,
    ):
        wanted = 1e3 * np.median(known.data.errors(name, which), axis=0)
        assert trace["median"] == pytest.approx(wanted, rel=1e-6)


def test_every_trace_belongs_to_a_variant(shown):
    assert [each["name"] for each in shown["variants"]] == ["actuated", "bearing"]
    for chart in shown["charts"].values():
        for view in chart:
            assert {trace["meta"] for trace in view["figure"]["data"]} <= {0, 1}


def test_numbers_are_told_with_unit_and_count(shown):
    told = [
        trace["text"] for trace in shown["charts"]["errors"][0]["figure"]["data"] if "text" in trace
    ]
    assert len(told) == 4
    assert re.match(r"mean error 0\.\d+ mm \(quartiles .* 10 sets", told[0][0])
    springs = {view["name"]: view for view in shown["charts"]["compliances"]}
    mixed = springs["joint_5.axial (not told apart (bearing))"]["figure"]["data"]
    (said,) = [trace["text"] for trace in mixed if "text" in trace and trace["meta"] == 1]
    assert all(each.endswith("not told apart") for each in said)
    # The page opens with a spring that some variant determines.
    unseen = [name for name, each in springs.items() if not each["determined"]]
    assert all(name.endswith("(not told apart)") for name in unseen)
    assert all(name in unseen for name in springs if name.endswith("(not told apart)"))


def test_verdicts_and_medians_stand_in_words(text, known):
    for sentence in known.verdicts.sentences:
        assert with_fixed_units(sentence) in text
    median = 1e6 * np.median(known.data.errors("bearing", "max"), axis=0)[-1]
    assert f" / {median:.1f}</td>" in text
    assert text.count('<tr><th scope="row">') == known.data.n_train[-1]


def test_indices_stand_in_a_table_with_intervals(text, known):
    (found,) = [
        each
        for each in known.insight.correlations
        if (each.variant, each.index, each.error, each.kind)
        == ("bearing", "covering_radius", "mean", "size")
    ]
    assert f"<td>{found.correlation:+.2f} ({found.low:+.2f} to {found.high:+.2f})</td>" in text


def test_what_is_not_known_has_no_section(tmp_path, known):
    path = write_codec_page(tmp_path / "p.html", known.data, known.verdicts)
    text = path.read_text(encoding="utf-8")
    assert "Identified compliances" not in text
    assert "Do indices foretell" not in text


def test_names_are_escaped(tmp_path, known):
    bad = "<b>x</b></script><script>alert(1)</script>"
    data = replace(renamed(known.data, bad, "b"), robot=bad, findings=(bad,), provenance=bad)
    text = write_codec_page(tmp_path / "p.html", data, known.verdicts).read_text("utf-8")
    assert "<b>x" not in text
    assert "alert(1)</script>" not in text
    assert Page(text).tags.count(("script", {})) == 2


def test_a_variant_without_errors_is_refused_by_name(tmp_path, known):
    empty = without_errors(known.data, "actuated")
    with pytest.raises(CodecError, match="'actuated' has no finite value"):
        write_codec_page(tmp_path / "p.html", empty, known.verdicts)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_all_files_are_written_and_the_same_codec_gives_the_same_bytes(tmp_path, known):
    whole, part = tmp_path / "a", tmp_path / "b"
    whole.mkdir()
    part.mkdir()
    paths = write_codec_figures(whole, known.data, known.verdicts, known.insight, "z")
    assert [path.name for path in paths] == [
        *("codec.svg", "codec-z.svg"),
        *("compliances.svg", "indices.svg", "codec.html"),
    ]
    assert all(path.stat().st_size > 5000 for path in paths)
    for path in write_codec_figures(part, known.data, known.verdicts, known.insight, "z", 2):
        assert path.read_bytes() == (whole / path.name).read_bytes(), path.name


def test_same_codec_gives_the_same_page(tmp_path, written, known):
    again = write_codec_page(
        tmp_path / "p.html",
        known.data,
        known.verdicts,
        known.insight.seen,
        known.insight.correlations,
    )
    assert again.read_bytes() == written.read_bytes()


def test_figures_say_in_words_what_they_show(tmp_path, known):
    write_codec_figures(tmp_path, known.data, known.verdicts)
    text = (tmp_path / "codec.svg").read_text(encoding="utf-8")
    assert "<title>" in text
    assert known.verdicts.sentences[0].split(":")[0] in text
    assert "<dc:date>" not in text
    assert {path.name for path in tmp_path.iterdir()} == {"codec.svg", "codec.html"}


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(FileAccessError, match=r"suffix '.gif' is not one of .pdf, .png, .svg"):
        write_figure(tmp_path / "f.gif", lambda: None, "", "")


@pytest.mark.slow
def test_page_draws_in_a_browser_and_tells_what_the_slider_asks(tmp_path, text):
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    if browser is None:
        pytest.skip("no chromium on the path to draw the page with")
    asked = """setTimeout(() => {
      const slider = document.getElementById("errors-size");
      slider.value = 3; slider.dispatchEvent(new Event("input"));
      document.querySelector("#variants input").click();
      document.getElementById("log").click();
    }, 2000);"""
    page = tmp_path / "p.html"
    page.write_text(with_script(text, asked), encoding="utf-8")
    run = subprocess.run(
        [browser, "--headless", "--no-sandbox", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--disable-background-networking", "--no-first-run",
         f"--user-data-dir={tmp_path}", "--virtual-time-budget=8000", "--window-size=600,600",
         "--enable-logging=stderr", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    said = [line for line in run.stderr.splitlines() if "CONSOLE" in line]
    assert not [line for line in said if re.search("Error|Refused|violates|Uncaught", line)]
    assert 'data-ready="yes"' in run.stdout
    assert "With 3 training poses, medians:" in run.stdout
    told = re.search(r'id="errors-told".*?</output>', run.stdout, re.S)[0]
    assert "bearing: mean error" in told
    assert "actuated" not in told
