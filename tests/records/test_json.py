"""The one reader of JSON: strict, bounded, and the only place at which JSON is read."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import elastocal
from elastocal.errors import SchemaError
from elastocal.records import parse_json, read_json, record, write_json
from support.by_day import some_by_day

SOURCES = Path(elastocal.__file__).parent
_READERS = {"loads", "load", "JSONDecoder", "model_validate_json", "validate_json", "raw_decode"}
_ALLOWED = {"elastic/springs/kinds.py", "records/_json.py", "records/_validation.py"}
"""The reader; and those that validate JSON which was written a line above."""


@record("elastocal.sealed/1", sealed=True)
class Sealed:
    compliance: tuple[float, ...]


@pytest.mark.slow
def test_json_is_read_at_one_place():
    found = set()
    for path in SOURCES.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        # A module that names none of this reads none: parsing all takes seconds.
        spoken = "json" in text.lower() or "raw_decode" in text
        for node in ast.walk(ast.parse(text if spoken else "")):
            named = isinstance(node, ast.Attribute) and node.attr in _READERS
            owner = node.value.id if named and isinstance(node.value, ast.Name) else ""
            if named and (node.attr not in ("loads", "load") or owner == "json"):
                found.add(path.relative_to(SOURCES).as_posix())
            if isinstance(node, ast.ImportFrom) and node.module == "json":
                found.add(path.relative_to(SOURCES).as_posix())
    assert found == _ALLOWED


@pytest.mark.parametrize("text", ['{"a": 1, "a": 1}', '{"b": [{"a": 1, "\\u0061": 2}]}'])
@pytest.mark.parametrize("form", [str, str.encode])
def test_a_key_that_stands_twice_is_refused(text, form):
    with pytest.raises(SchemaError, match="x is not valid JSON: key 'a' stands twice"):
        parse_json(form(text), "x")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"\xff", "not UTF-8"),
        ("[" * 100_000, "nested too deeply"),
        ("[" * 70 + "]" * 70, "ELASTOCAL_MAX_NESTING"),
        ("[" + "0," * 2_000_001 + "0]", "ELASTOCAL_MAX_JSON_VALUES"),
        ("[" + "[]" * 2_000_001, "ELASTOCAL_MAX_JSON_VALUES"),
        ('{"a": 1} 2', "Extra data"),
    ],
)
def test_what_asks_for_too_much_or_is_none_is_refused(text, message):
    with pytest.raises(SchemaError, match=message):
        parse_json(text, "x")


def test_what_is_no_number_is_left_to_the_schema_unless_it_is_asked_for():
    assert parse_json("[NaN]", "x")[0] != 0
    with pytest.raises(SchemaError, match="NaN is no number of JSON"):
        parse_json("[NaN]", "x", finite=True)


def test_a_file_that_says_something_else_than_it_was_sealed_with_is_refused(tmp_path):
    path = tmp_path / "a.json"
    write_json(path, Sealed((1e-6, 2e-6)))
    assert read_json(path, Sealed).compliance == (1e-6, 2e-6)
    stated = json.loads(path.read_text())["content_sha256"]
    path.write_text(path.read_text().replace("1e-06", "3e-06"))
    with pytest.raises(SchemaError, match=f"{path}.* states content_sha256 '{stated[:12]}'"):
        read_json(path, Sealed)
    # A file of before, and one that was edited on purpose, state none.
    path.write_text(path.read_text().replace(f',\n "content_sha256": "{stated}"', ""))
    assert read_json(path, Sealed).compliance == (3e-6, 2e-6)


@pytest.mark.parametrize("stated", ["null", "1", '""', '"\\ud800"'])
def test_a_seal_that_is_no_hash_is_refused(tmp_path, stated):
    path = tmp_path / "a.json"
    path.write_text(
        f'{{"schema": "elastocal.sealed/1", "compliance": [], "content_sha256": {stated}}}'
    )
    with pytest.raises(SchemaError, match=r"was changed after it was written|half of a letter"):
        read_json(path, Sealed)


_HOSTILE = """
import re, sys
from pathlib import Path
from elastocal.errors import ElastocalError
from elastocal.workflows import check, verify
path = Path(sys.argv[1])
try:
    (check if path.suffix == ".json" else verify)(path)
except ElastocalError as error:
    print(str(error)[:300])
"""
_OPENED = '<script type="application/json" id="manifest">'


def hostile(kind: str) -> bytes:
    """Return a file that asks for gigabytes."""
    if kind == "page of objects":
        return f"<html>{_OPENED}".encode() + b'{"files":[' + b"{}," * 30_000_000 + b"{}]}</script>"
    if kind == "page of texts":
        emoji = "\N{GRINNING FACE}".encode()
        return f"<html>{_OPENED}".encode() + b'{"light":"' + emoji * 22_000_000 + b'"}</script>'
    if kind == "page of brackets":
        return f"<html>{_OPENED}".encode() + b"[" * 90_000_000 + b"</script>"
    if kind == "table of objects":
        runs = b"{}," * 650_000 + b"{}"
        return b'{"schema": "elastocal.process/1", "runs": [' + runs + b"]}"
    raise ValueError(kind)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", some_by_day(["page of objects", "page of texts", "page of brackets"])
)
def test_a_page_of_ninety_megabytes_takes_less_than_a_gigabyte(tmp_path, kind):
    memory, told = peak(tmp_path / "a.html", hostile(kind))
    assert "a.html" in told
    assert memory < 1e9


@pytest.mark.slow
def test_a_table_of_empty_runs_takes_less_than_a_gigabyte(tmp_path):
    memory, told = peak(tmp_path / "a.json", hostile("table of objects"))
    assert "key 'cell' is missing" in told
    assert memory < 1e9


def peak(path, data):
    """Return the most memory, in bytes, that a child takes to read a file, and what it says."""
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak of a process is read from /proc")
    path.write_bytes(data)
    # Not by `getrusage`, whose peak is that of the process that started it, too.
    status = 'Path("/proc/self/status").read_text()'
    script = f"{_HOSTILE}print(re.search(r'VmHWM:\\s+(\\d+) kB', {status})[1])"
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    *told, most = done.stdout.splitlines()
    return 1024 * int(most), " ".join(told)


@pytest.mark.parametrize("text", [r'["\ud800"]', r'{"a\uDFFF": 1}', r'{"a": [["x\udc00y"]]}'])
def test_half_of_a_letter_is_refused(text):
    with pytest.raises(SchemaError, match=r"^it holds '.*', half of a letter$"):
        parse_json(text, "it")


def test_two_halves_of_one_letter_are_whole():
    assert parse_json(r'["\ud83d\ude00"]', "it") == ["\U0001f600"]
