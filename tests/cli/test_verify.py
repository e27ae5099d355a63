"""``elastocal verify``: keys, signed runs and reports, and whatever is no longer what it was."""

import io
import json
import re
import stat
from dataclasses import replace

import pytest

from elastocal.procedure import Event, Journal, RunFolder, read_journal
from elastocal.verdict import file_links, make_key, read_manifest, write_signature
from elastocal.verdict.signing import read_signature
from support import forged, reported
from support.cli import elastocal
from support.run_cells import planned_cell


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Two private keys."""
    folder = tmp_path_factory.mktemp("keys")
    for name in ("mine", "other"):
        make_key(folder / name)
    return folder


@pytest.fixture(scope="module")
def signed(keys, tmp_path_factory):
    """A run with its report beside it, both signed; do not write into it."""
    folder = tmp_path_factory.mktemp("signed")
    planned = planned_cell(folder / "planned")
    out = folder / "all" / "run"
    out.parent.mkdir()
    sign = ("--sign", keys / "mine")
    done = elastocal("run", planned.cell, "--plan", planned.plan, "--out", out, *sign)
    assert done.code == 0, done.err
    made = elastocal("report", out, "--out", out.parent / "report.html", *sign)
    assert made.code == 0, made.err
    return out.parent


@pytest.mark.slow
def test_a_signed_report_asks_for_entries_that_nobody_stated(signed, keys, tmp_path, monkeypatch):
    """Number, operator and place; the place once more after ``back``."""
    keyboard = io.StringIO("C-7\nM. Tanaka\nHall 2\nback\nHall 3\nskip\n")
    keyboard.isatty = lambda: True
    monkeypatch.setattr("sys.stdin", keyboard)
    page = tmp_path / "report.html"
    made = elastocal("report", signed / "run", "--out", page, "--sign", keys / "mine")
    assert made.code == 0, made.err
    text = page.read_text(encoding="utf-8")
    assert all(each in text for each in ("C-7", "M. Tanaka", "Hall 3"))
    assert "Hall 2" not in text


def public(keys, name="mine"):
    return keys / f"{name}.pub"


def test_a_key_is_for_its_owner_alone_and_never_overwritten(tmp_path):
    made = elastocal("verify", "--new-key", tmp_path / "key")
    assert made.code == 0, made.err
    assert stat.S_IMODE((tmp_path / "key").stat().st_mode) == 0o600
    before = (tmp_path / "key").read_bytes()
    for gone in ("key.pub", None):
        refused = elastocal("verify", "--new-key", tmp_path / "key")
        assert "is there already: a key is never overwritten" in refused.reason
        assert (tmp_path / "key").read_bytes() == before
        if gone is not None:
            (tmp_path / gone).unlink()
    assert not (tmp_path / "key.pub").exists()


def test_a_signed_run_is_whole_and_its_journal_names_who_signs(signed, keys):
    found = elastocal("verify", signed / "run", "--key", public(keys))
    assert found.code == 0, found.err
    lines = found.err.splitlines()
    assert lines[0].startswith("whole          signature: the journal is signed by key ")
    assert all(line.startswith("whole ") for line in lines)
    record = read_journal(RunFolder(signed / "run").journal)[0].run
    assert record.signer[:16] in lines[0]
    assert elastocal("check", signed / "run" / "signature.json").code == 0


def test_a_signed_report_is_whole_alone_and_beside_its_run(signed, keys, tmp_path):
    beside = elastocal("verify", signed / "report.html", "--key", public(keys), "--json")
    assert beside.code == 0, beside.err
    found = json.loads(beside.out)
    assert found["whole"]
    assert {"page", "signature", "files", "streams", "dataset"} <= {
        each["name"] for each in found["links"]
    }
    alone = tmp_path / "alone.html"
    alone.write_bytes((signed / "report.html").read_bytes())
    told = elastocal("verify", alone)
    assert told.code == 0
    assert "give --key to hold it against one that you trust" in told.err
    assert "lies beside it: name their folder with --run" in told.err
    named = elastocal("verify", alone, "--run", signed)
    assert re.search(r"whole +files: \d+ files: those that the report shows", named.err)


@pytest.mark.parametrize("what", ["run", "report.html"])
def test_a_signature_by_another_key_is_refused(signed, keys, what):
    found = elastocal("verify", signed / what, "--key", public(keys, "other"))
    assert found.code == 1
    assert "is signed by another key" in found.err.splitlines()[-1]


def test_an_edited_verdict_is_named(signed, keys, tmp_path):
    text = (signed / "report.html").read_text(encoding="utf-8")
    edited = tmp_path / "edited.html"
    edited.write_text(text.replace("No calibrated model was found", "All is well"), "utf-8")
    found = elastocal("verify", edited)
    assert found.code == 1
    assert "the page was edited after it was written" in found.err.splitlines()[-1]
    # Who renews the hash of the page as well has no key to sign it with.
    page = read_manifest(edited).page_sha256
    forged.renew(edited, page_sha256=page)
    found = elastocal("verify", edited)
    assert found.err.splitlines()[-1].endswith("the report was changed after it was signed")


def test_a_forged_verdict_makes_no_line_of_its_own(signed, tmp_path):
    manifest = read_manifest(signed / "report.html").manifest
    line = manifest.verdict + "\nwhole          signature: the report is signed by key 00"
    path = tmp_path / "forged.html"
    path.write_bytes((signed / "report.html").read_bytes())
    forged.renew(path, verdict=line)
    said = elastocal("verify", path)
    assert "by key 00" in said.err
    assert not re.search(r"^whole +signature", said.err, re.MULTILINE)


def copied_run(signed, tmp_path):
    return reported.copied(signed, tmp_path / "all", "run", "report.html")


def add_a_line(folder):
    with Journal(folder / "run" / "journal.jsonl") as journal:
        journal.write(1e6, Event.RESUME)


def forge(folder):
    path = folder / "run" / "signature.json"
    write_signature(path, replace(read_signature(path), made="2020-01-01T00:00:00+00:00"))


def unlink(folder):
    (folder / "run" / "signature.json").unlink()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        pytest.param(add_a_line, "the run was changed after it was signed", marks=pytest.mark.slow),
        (forge, "the signature of the run is not valid"),
        (unlink, "the run should be signed, and there is no signature.json"),
    ],
)
def test_a_signature_of_another_journal_is_named_also_by_the_report(signed, tmp_path, change, told):
    folder = copied_run(signed, tmp_path)
    change(folder)
    found = elastocal("verify", folder / "run")
    assert found.code == 1
    assert told in found.err.splitlines()[-1]
    report = elastocal("report", folder, "--out", tmp_path / "again.html")
    assert told in " ".join(report.err.split())


def test_a_file_that_the_report_does_not_show_is_named(signed, tmp_path):
    folder = copied_run(signed, tmp_path)
    path = folder / "run" / "plan" / "plan.json"
    path.write_text(path.read_text() + "\n")
    found = elastocal("verify", folder / "report.html")
    assert found.code == 1
    assert "run/plan/plan.json is not the one that the report shows" in found.err.splitlines()[-1]


@pytest.mark.slow
def test_what_is_not_signed_is_said_and_refused_where_a_key_is_asked_for(keys):
    run = reported.finished() / "run"
    said = elastocal("verify", run)
    assert said.code == 0, said.err
    assert "not signed     signature: the run is not signed" in said.err
    assert (
        "there is no signature.json"
        in elastocal("verify", run, "--key", public(keys)).err.splitlines()[-1]
    )


def test_a_signed_run_goes_on_with_its_key_alone(signed, keys, tmp_path):
    planned = signed.parent / "planned"
    run = (planned / "cell" / "cell.yaml", "--plan", planned / "plan", "--out", signed / "run")
    for more, told in (((), "give --sign with its key"), (("--sign", keys / "other"), "signer is")):
        assert told in elastocal("run", *run, "--resume", "--yes", *more).reason


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("mine", "--key", "mine.pub"), "neither a report (.html) nor the folder of a run"),
        ((".", "--key", "mine"), "is a private key: --key takes the public one"),
        ((".", "--key", "text"), "text is no public key (PEM)"),
        (("nowhere.html",), "there is no such file or folder"),
        (("page.html",), "has no manifest"),
    ],
)
def test_what_cannot_be_verified_is_refused_in_a_line(keys, monkeypatch, arguments, told):
    monkeypatch.chdir(keys)
    (keys / "text").write_text("no key")
    (keys / "page.html").write_text("<html></html>")
    target, *rest = arguments
    assert told in elastocal("verify", target, *rest).err.strip().splitlines()[-1]


@pytest.mark.parametrize("name", ["mine.pub", "text"])
def test_what_is_no_private_key_is_refused_before_any_work(keys, name, tmp_path):
    (keys / "text").write_text("no key")
    out = tmp_path / "r.html"
    refused = elastocal("report", reported.finished(), "--out", out, "--sign", keys / name)
    assert "is no private key that is not encrypted" in refused.reason
    assert not out.exists()


def test_without_the_package_signatures_are_refused_in_a_line(keys, tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    out = tmp_path / "r.html"
    refused = elastocal("report", reported.finished(), "--out", out, "--sign", keys / "mine")
    assert "pip install 'elastocal[sign]'" in refused.reason


def test_a_manifest_names_nothing_outside_its_folder(signed, tmp_path):
    manifest = read_manifest(signed / "report.html").manifest
    (tmp_path / "secret").write_text("x")
    folder = tmp_path / "inner"
    folder.mkdir()
    for name in ("../secret", str(tmp_path / "secret")):
        (link,) = file_links(
            replace(manifest, files=(replace(manifest.files[0], name=name),)), (folder,)
        )
        assert "lies beside it" in link.text
