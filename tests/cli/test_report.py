"""``elastocal report`` as a user meets it."""

import json
import shutil

import pytest

from elastocal.report.document import chromium
from support import reported
from support.by_day import some_by_day
from support.cli import elastocal


@pytest.fixture(scope="module")
def finished():
    return reported.finished()


@pytest.fixture
def copied(finished, tmp_path):
    def copy(*names):
        return reported.copied(finished, tmp_path / "all", *names)

    return copy


@pytest.mark.slow
def test_a_report_is_written_and_its_verdict_is_told(finished, tmp_path):
    out = tmp_path / "report.html"
    result = elastocal("report", finished, "--out", out)
    assert result.code == 0, result.err
    assert result.out == ""
    told = " ".join(result.err.split())
    assert f"made from the other {reported.POSES - 1}" in told
    assert "The tolerance is 0.300 mm (set in the cell file)" in told
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.slow
def test_json_has_the_verdict_and_nothing_else_stands_on_standard_output(finished, tmp_path):
    result = elastocal("report", finished, "--out", tmp_path / "r.html", "--json")
    figures = json.loads(result.out)
    assert result.err == ""
    assert figures["light"] in ("green", "yellow", "red")
    assert figures["tolerance"] == pytest.approx(0.3e-3)
    assert figures["unseen"]["poses"] == reported.POSES
    mean = figures["unseen"]["mean"]
    assert mean["low"] < mean["value"] < mean["high"]
    assert figures["missing"] == ["earlier calibration"]


def test_without_a_tolerance_there_is_no_light(copied, tmp_path):
    folder = copied("run", "model.json")
    cell = folder / "run" / "cell" / "cell.yaml"
    text = cell.read_text()
    assert "  tolerance:" in text
    lines = [line for line in text.splitlines() if not line.startswith("  tolerance:")]
    cell.write_text("\n".join(lines) + "\n")
    result = elastocal("report", folder, "--out", tmp_path / "r.html", "--json")
    figures = json.loads(result.out)
    assert figures["light"] is None
    assert figures["tolerance"] is None
    assert "No tolerance was given" in figures["verdict"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tolerance", "light"), some_by_day([("1 um", "red"), ("10 mm", "yellow")])
)
def test_the_tolerance_on_the_command_line_is_the_one_that_counts(
    finished, tmp_path, tolerance, light
):
    """The codec of so few poses has not saturated, so that none of them is green."""
    out = tmp_path / "r.html"
    result = elastocal("report", finished, "--out", out, "--tolerance", tolerance, "--json")
    assert json.loads(result.out)["light"] == light


@pytest.mark.parametrize(
    ("option", "value", "told"),
    [
        ("--tolerance", "0.3", "--tolerance: '0.3' is not a length with its unit"),
        ("--tolerance", "0.3 N", "--tolerance: unit 'N' is not a length"),
        ("--tolerance", "-1 mm", "--tolerance '-1 mm' must be above 0"),
        ("--tolerance", "0 mm", "--tolerance '0 mm' must be above 0"),
        ("--limit", "3", "--limit: '3' is not a length with its unit"),
        ("--model", "no.json", "no.json"),
        ("--old", "no.json", "no.json"),
    ],
)
def test_options_that_make_no_sense_are_refused_in_a_line(finished, tmp_path, option, value, told):
    out = tmp_path / "r.html"
    assert told in elastocal("report", finished, "--out", out, option, value).reason
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("missing", ["codec", "model.json", "run"])
def test_the_report_comes_and_says_what_is_missing(copied, tmp_path, missing):
    folder = copied()
    path = folder / missing
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    out = tmp_path / "r.html"
    result = elastocal("report", folder, "--out", out, "--json")
    assert result.code == 0, result.err
    figures = json.loads(result.out)
    names = {"model.json": "calibrated model"}
    assert names.get(missing, missing) in figures["missing"]
    assert figures["light"] != "green"
    assert "Missing in this report" in out.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_partial_run_is_reported_as_such(finished, copied, tmp_path):
    """A run of which three poses were committed before it was killed, derived as it stands."""
    folder = copied("run")
    journal = folder / "run" / "journal.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    commits = [number for number, line in enumerate(lines) if '"event":"commit"' in line]
    journal.write_text("".join(lines[: commits[4] + 1]))
    assert elastocal("derive", folder / "run").code == 0
    data = folder / "run" / "dataset.nc"
    made = elastocal("calibrate", data, "--out", folder / "model.json", "--springs", "actuated")
    assert made.code == 0, made.err
    result = elastocal("report", folder, "--out", tmp_path / "r.html", "--json")
    figures = json.loads(result.out)
    planned = reported.POSES
    assert any(
        f"the run is partial: {planned - 5} of {planned} planned poses" in reason
        for reason in figures["reasons"]
    )
    assert any("elastocal run --resume" in each for each in figures["advice"])
    assert any("--springs bearing" in each for each in figures["advice"])


def test_a_model_alone_is_reported(finished, tmp_path):
    shutil.copy(finished / "model.json", tmp_path / "m.json")
    result = elastocal("report", tmp_path / "m.json", "--out", tmp_path / "r.html", "--json")
    figures = json.loads(result.out)
    assert "run" in figures["missing"]
    assert figures["unseen"] is None
    assert "could not be reproduced" in figures["verdict"]


@pytest.mark.slow
def test_a_damaged_part_is_told_and_one_that_is_named_is_refused(copied, tmp_path):
    folder = copied()
    codec = folder / "codec" / "codec.nc"
    codec.write_bytes(codec.read_bytes()[:4000])
    out = tmp_path / "r.html"
    result = elastocal("report", folder, "--out", out, "--json")
    assert "codec" in json.loads(result.out)["missing"]
    assert "Codec (cannot be used): codec/codec.nc" in out.read_text(encoding="utf-8")
    named = elastocal("report", folder, "--codec", codec, "--out", tmp_path / "b.html")
    assert "codec.nc" in named.reason


@pytest.mark.parametrize("kind", ["empty", "foreign", "nowhere"])
def test_what_is_no_run_is_refused(tmp_path, kind):
    folder = tmp_path / kind
    if kind != "nowhere":
        folder.mkdir()
    if kind == "foreign":
        (folder / "holiday.txt").write_text("x")
    reason = elastocal("report", folder, "--out", tmp_path / "r.html").reason
    assert str(folder) in reason
    assert not (tmp_path / "r.html").exists()


def test_a_file_that_is_no_model_is_refused(tmp_path):
    path = tmp_path / "m.json"
    path.write_text("{")
    assert "m.json" in elastocal("report", path, "--out", tmp_path / "r.html").reason


def test_a_report_that_is_there_is_not_replaced_without_force(finished, tmp_path):
    out = tmp_path / "r.html"
    out.write_text("mine")
    assert "give --force" in elastocal("report", finished / "model.json", "--out", out).reason
    assert out.read_text() == "mine"
    assert elastocal("report", finished / "model.json", "--out", out, "--force").code == 0
    assert out.stat().st_size > 1e4


def test_a_report_never_takes_the_place_of_a_file_of_another_kind(finished, copied):
    folder = copied("run", "model.json")
    model = folder / "model.json"
    before = model.read_bytes()
    assert "must end in .html" in elastocal("report", folder, "--out", model, "--force").reason
    assert model.read_bytes() == before


def test_a_folder_that_cannot_be_is_refused_before_the_work(tmp_path):
    (tmp_path / "no").write_text("a file")
    out = tmp_path / "no" / "r.html"
    assert "is a file, not a folder" in elastocal("report", tmp_path / "x", "--out", out).reason


def test_a_pdf_that_is_there_is_not_replaced_without_force(finished, tmp_path, monkeypatch):
    (tmp_path / "r.pdf").write_text("mine")
    reason = elastocal(
        "report", finished / "model.json", "--out", tmp_path / "r.html", "--pdf"
    ).reason
    assert "r.pdf" in reason
    assert not (tmp_path / "r.html").exists()


def test_a_pdf_without_a_browser_is_refused_with_what_was_looked_for(
    finished, tmp_path, monkeypatch
):
    monkeypatch.setattr(chromium.shutil, "which", lambda _: None)
    reason = elastocal(
        "report", finished / "model.json", "--out", tmp_path / "r.html", "--pdf"
    ).reason
    for name in chromium.BROWSERS:
        assert name in reason
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("script", ["exit 3", "exit 0", "echo broken >&2; exit 1"])
def test_a_browser_that_fails_is_told_in_a_line(finished, tmp_path, monkeypatch, script):
    fake = tmp_path / "chromium"
    fake.write_text(f"#!/bin/sh\n{script}\n")
    fake.chmod(0o755)
    monkeypatch.setattr(chromium.shutil, "which", lambda _: str(fake))
    folder = tmp_path / "out"
    folder.mkdir()
    reason = elastocal(
        "report", finished / "model.json", "--out", folder / "r.html", "--pdf"
    ).reason
    assert "did not show the page: it ended" in reason
    assert not list(folder.iterdir())
