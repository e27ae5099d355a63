"""Forgeries of a signed report and of a signed run: `verify` refuses every one of them."""

import json
import random
import re
import shutil

import pytest

from elastocal import dataset
from elastocal.procedure import derive_run, file_sha256
from elastocal.verdict import (
    OF_REPORT,
    OF_RUN,
    chain,
    read_manifest,
    read_private_key,
    sign,
    write_signature,
)
from elastocal.verdict.signing import read_signature
from support import forged, sealed
from support.by_day import some_by_day
from support.forged import CLOSED, OPENED, PAGE, RUN, refusal

_DERIVED = {}
"""Runs that were derived, by all that they are derived from: that takes most of a verification."""
NOW = "2026-01-02T03:04:05+00:00"


@pytest.fixture(autouse=True)
def derived_once(monkeypatch):
    def derive(run, sensor=None):
        files = [*run.glob("*.jsonl"), *(run / "cell").rglob("*"), *run.glob("[ps]*/*")]
        key = run, *(file_sha256(file) for file in sorted(files) if file.is_file())
        if key not in _DERIVED:
            _DERIVED[key] = derive_run(run, sensor)
        return _DERIVED[key]

    monkeypatch.setattr(chain, "derive_run", derive)


def text(old, new):
    """Return what replaces a text in the page, once."""

    def change(folder):
        page = (folder / PAGE).read_bytes()
        assert old.encode() in page
        (folder / PAGE).write_bytes(page.replace(old.encode(), new.encode(), 1))

    return change


def whole(change):
    """Return what changes the bytes of the page."""

    def changed(folder):
        (folder / PAGE).write_bytes(change((folder / PAGE).read_bytes()))

    return changed


def manifest(change):
    """Return what changes the bytes of the manifest alone."""

    def changed(folder):
        before, found, after = forged.split((folder / PAGE).read_bytes())
        assert change(found) != found
        (folder / PAGE).write_bytes(before + change(found) + after)

    return changed


def renewed(**changes):
    return lambda folder: forged.renew(folder / PAGE, **changes)


def edit_the_verdict(folder):
    text(read_manifest(folder / PAGE).manifest.verdict, "Released")(folder)


def renew_the_page(folder):
    """Edit the verdict and renew the page's hash and the manifest's own."""
    edit_the_verdict(folder)
    forged.renew(folder / PAGE, page_sha256=read_manifest(folder / PAGE).page_sha256)


def renew_a_file(folder):
    files = read_manifest(folder / PAGE).manifest.files
    wrong = type(files[0])(files[0].name, "0" * 64)
    forged.renew(folder / PAGE, files=(wrong, *files[1:]))


def sign_again(folder):
    found = read_manifest(folder / PAGE)
    key = read_private_key(forged.signed() / "other")
    forged.renew(folder / PAGE, signature=sign(key, OF_REPORT, found.signed_sha256, NOW))


def take_the_signature_of_the_run(folder):
    forged.renew(folder / PAGE, signature=read_signature(folder / RUN / "signature.json"))


def take_the_manifest_of_the_older(folder):
    older = forged.split((folder / "older.html").read_bytes())[1]
    manifest(lambda _: older)(folder)


def make_it_one_of_before(found):
    data = json.loads(found) | {"schema": "elastocal.manifest/1"}
    data.pop("content_sha256")
    return json.dumps(data, separators=(",", ":")).encode()


def hide_in_a_key_that_stands_twice(found):
    return b'{"light":"</SCRIPT><dialog open><h1>GREEN</h1></dialog>",' + found[1:]


def older(folder):
    shutil.copy(folder / "older.html", folder / PAGE)


def other(name):
    """Return what takes a file of the other run, signed by the same key."""
    return lambda folder: shutil.copy(forged.signed() / "twin" / name, folder / name)


def pose(number):
    return f"run/streams/pose_{number:04d}_1.mcap"


def swap_streams(folder):
    one, two = folder / pose(0), folder / pose(1)
    kept = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(kept)


def file(name, old, new):
    def change(folder):
        data = (folder / name).read_bytes()
        assert re.search(old, data)
        (folder / name).write_bytes(re.sub(old, new, data, count=1))

    return change


def edit(name, **changes):
    return lambda folder: sealed.edit(folder / name, lambda data: data.update(changes))


def scale_residuals(folder):
    path = folder / RUN / "dataset.nc"
    data = dataset.read(path).to_xarray().copy(deep=True)
    data["marker_displacement"] = data["marker_displacement"] * 0.2
    dataset.write(dataset.Dataset.from_xarray(data), path)


def remove(name):
    return lambda folder: (folder / name).unlink()


def drop_the_last_pose(folder):
    """Cut the journal before its last commit; every line that is left is sound."""
    path = folder / RUN / "journal.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    last = max(n for n, line in enumerate(lines) if b'"event":"commit"' in line)
    path.write_bytes(b"".join(lines[:last]))


def sign_the_run_again(folder):
    path, key = folder / RUN / "signature.json", read_private_key(forged.signed() / "other")
    write_signature(path, sign(key, OF_RUN, file_sha256(folder / RUN / "journal.jsonl"), NOW))


STYLE = "<style>#verdict{display:none}</style></head>"
OF_THE_PAGE = {
    "the verdict": edit_the_verdict,
    "a figure": whole(lambda page: re.sub(rb"[1-9] of 5 poses|>[1-9]", b">0", page, count=1)),
    "a style that hides": text("</head>", STYLE),
    "a script": text("</body>", "<script>document.body.innerHTML='GREEN'</script></body>"),
    "a comment": text("<body>", "<body><!-- -->"),
    "an attribute that hides": text("<main>", "<main hidden>"),
    "a letter as an entity": text("<title>S", "<title>&#83;"),
    "another charset": text('charset="utf-8"', 'charset="utf-7"'),
    "a picture": whole(
        lambda page: (
            re.sub(rb"base64,....", b"base64,AAAA", page, count=1)
            if b"base64," in page
            else page.replace(b'id="data">{', b'id="data">{ ', 1)
        )
    ),
    "a byte order mark": whole(lambda page: b"\xef\xbb\xbf" + page),
    "UTF-16": whole(lambda page: page.decode().encode("utf-16")),
    "other ends of lines": whole(lambda page: page.replace(b"\n", b"\r\n")),
    "a space before it": whole(lambda page: b" " + page),
    "a page behind it": whole(lambda page: page + b"<h1>GREEN</h1>"),
    "an end of line behind it": whole(lambda page: page + b"\n"),
    "its last byte": whole(lambda page: page[:-1]),
    "its second half": whole(lambda page: page[: len(page) // 2]),
    "a light in the manifest": manifest(
        lambda found: re.sub(rb'"light":(null|"\w+")', b'"light":"green"', found)
    ),
    "a key that stands twice": manifest(lambda found: b'{"light":"green",' + found[1:]),
    "markup in a key that stands twice": manifest(hide_in_a_key_that_stands_twice),
    "a space in the manifest": manifest(lambda found: found.replace(b":", b": ", 1)),
    "an end of line in the manifest": manifest(lambda found: found + b"\n"),
    "an escape in the manifest": manifest(lambda found: found.replace(b"run", b"\\u0072un", 1)),
    "another order of its keys": manifest(
        lambda found: json.dumps(
            dict(reversed(json.loads(found).items())), separators=(",", ":")
        ).encode()
    ),
    "a manifest of before": manifest(make_it_one_of_before),
    "a manifest renewed": renewed(light="green", verdict="Released"),
    "page and manifest renewed": renew_the_page,
    "a file renewed": renew_a_file,
    "no signature": renewed(signature=None),
    "a signature by another key": sign_again,
    "the signature of the run": take_the_signature_of_the_run,
    "capitals in the signature": manifest(
        lambda found: re.sub(
            rb'("signature":")([0-9a-f]{128})', lambda m: m[1] + m[2].upper(), found
        )
    ),
    "a second manifest": text("</body>", f"{OPENED}{{}}{CLOSED}</body>"),
    "a manifest before it": text("<body>", f"<body>{OPENED}{{}}{CLOSED}"),
    "another spelling of its place": text(OPENED, OPENED.replace("script", "SCRIPT")),
    "the manifest of an older report": take_the_manifest_of_the_older,
    "an older report of the run": older,
    "the report on another run": other(PAGE),
}
OF_THE_RUN = {
    "the journal of another run": other("run/journal.jsonl"),
    "a time in the journal": file("run/journal.jsonl", rb'"time":1', b'"time":2'),
    "the last pose": drop_the_last_pose,
    "two streams swapped": swap_streams,
    "a stream of another run": other(pose(0)),
    "a stream is gone": remove(pose(2)),
    "the tolerance": file("run/cell/cell.yaml", rb"tolerance: .0.3 mm.", b'tolerance: "3 mm"'),
    "a comment in the cell": file("run/cell/cell.yaml", rb"# ", b"# x "),
    "other ends of lines in the cell": file("run/cell/cell.yaml", rb"\n", b"\r\n"),
    "the mesh of the cell": file("run/cell/dome.stl", rb"^.", b"x"),
    "a space in the plan": file("run/plan/plan.json", rb"\n", b"\n "),
    "a warning": edit("run/summary.json", warnings=["none"]),
    "a space in the summary": file("run/summary.json", rb"\n", b"\n "),
    "scaled residuals": scale_residuals,
    "the dataset of another run": other("run/dataset.nc"),
    "no signature of the run": remove("run/signature.json"),
    "the signature of another run": other("run/signature.json"),
    "the run signed by another key": sign_the_run_again,
    "a space in its signature": file("run/signature.json", rb"\n", b"\n "),
    "a key twice in its signature": file("run/signature.json", rb"\{", b'{"of": "run",'),
}
OF_WHAT_IS_SHOWN = {
    "a comment in the cell": OF_THE_RUN["a comment in the cell"],
    "a compliance": file("model.json", rb'"compliance": \[\s+[-\d.e]+', b'"compliance": [ 1e-9'),
    "a compliance and its hash": edit("model.json", compliance=[1e-9] * 18),
    "the model of another run": other("model.json"),
}


def test_what_nobody_touched_is_whole(tmp_path):
    folder = forged.copied(tmp_path / "all")
    assert refusal(folder / PAGE) == ""
    assert refusal(folder / RUN) == ""


@pytest.mark.parametrize("kind", some_by_day(OF_THE_PAGE, 2))
def test_a_forged_page_is_refused(tmp_path, kind):
    folder = forged.copied(tmp_path / "all")
    before = (folder / PAGE).read_bytes()
    OF_THE_PAGE[kind](folder)
    assert (folder / PAGE).read_bytes() != before
    # With the run beside it only where that is what tells.
    alone = kind not in ("an older report of the run", "the report on another run")
    if alone:
        shutil.rmtree(folder / RUN)
        (folder / "model.json").unlink()
    assert refusal(folder / PAGE)


@pytest.mark.parametrize("kind", some_by_day(OF_THE_RUN, 6))
def test_a_forged_run_is_refused(tmp_path, kind):
    folder = forged.copied(tmp_path / "all")
    (folder / "model.json").unlink()
    OF_THE_RUN[kind](folder)
    assert refusal(folder / RUN)


@pytest.mark.slow
@pytest.mark.parametrize("kind", some_by_day(OF_WHAT_IS_SHOWN, 2))
def test_what_a_report_shows_is_held_against_it(tmp_path, kind):
    folder = forged.copied(tmp_path / "all")
    OF_WHAT_IS_SHOWN[kind](folder)
    assert "is not the one that the report shows" in refusal(folder / PAGE)


def places(size, rng, count):
    """Return places in a file: both ends, and some between them; of none, one of the ends."""
    ends = [0, size - 1] if count else [rng.choice([0, size - 1])]
    return sorted({*ends, *(rng.randrange(size) for _ in range(count))})


def mutants(data, rng, place):
    """Yield the bytes with one inserted, deleted and changed at a place."""
    yield data[:place] + bytes([rng.choice(b" \n\t<a0\0\xff,")]) + data[place:]
    yield data[:place] + data[place + 1 :]
    yield data[:place] + bytes([data[place] ^ (1 << rng.randrange(8))]) + data[place + 1 :]


def changed_pages(page, rng, count):
    """Yield pages with one byte inserted, deleted or changed, in each of their regions."""
    before, found, after = map(len, forged.split(page))
    edges = {0, len(page) - 1, before - len(OPENED), before - 1, before, before + found - 1}
    edges |= {before + found, before + found + len(CLOSED) - 1, before + found + len(CLOSED)}
    edges |= {before + found + after - 1}
    inner = [before + rng.randrange(found) for _ in range(count // 2)]
    outer = [rng.randrange(len(page)) for _ in range(count - count // 2)]
    for place in (*edges, *inner, *outer):
        yield from mutants(page, rng, place)


def refuse_pages(folder, seed, count):
    page = (forged.signed() / "all" / PAGE).read_bytes()
    path, tried = folder / PAGE, 0
    for changed in changed_pages(page, random.Random(seed), count):
        if changed == page:
            continue
        path.write_bytes(changed)
        tried += 1
        assert refusal(path), tried
    return tried


def files_of_a_run(folder):
    return sorted(path for path in (folder / RUN).rglob("*") if path.is_file())


def refuse_runs(folder, seed, count):
    """Change each file of a run at its ends and at some places between them."""
    (folder / "model.json").unlink()
    rng, tried = random.Random(seed), 0
    for path in files_of_a_run(folder):
        data = path.read_bytes()
        for place in places(len(data), rng, count):
            changed = rng.choice([each for each in mutants(data, rng, place) if each != data])
            path.write_bytes(changed)
            tried += 1
            assert refusal(folder / RUN), (path.name, place)
        path.write_bytes(data)
    return tried


def test_every_single_change_of_a_page_is_refused(tmp_path):
    assert refuse_pages(tmp_path, 1, 140) > 440


@pytest.mark.slow
def test_a_single_change_of_any_file_of_a_run_is_refused(tmp_path):
    folder = forged.copied(tmp_path / "all")
    assert refuse_runs(folder, 2, 0) == len(files_of_a_run(folder)) > 10


@pytest.mark.slow
def test_a_hundred_thousand_changes_are_refused(tmp_path):
    pages = refuse_pages(tmp_path, 3, 33_000)
    runs = refuse_runs(forged.copied(tmp_path / "all"), 4, 150)
    assert pages + runs > 100_000
