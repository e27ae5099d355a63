"""The journal: on the disk before anything moves on, and readable after any crash."""

import errno
import json
import os
import re

import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.procedure import Event, Journal, PoseLog, read_journal
from elastocal.procedure.record import Action, read_commits
from support.fake_runs import RECORD

LOG = PoseLog(pose=3, attempt=2, streams="pose_0003_2.mcap", windows=())


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.jsonl"


@pytest.fixture
def begun(path):
    with Journal(path) as journal:
        journal.write(1.5, Event.START, run=RECORD)
        journal.write(2.0, Event.BEGIN, pose=3, attempt=1, action=Action.MOVE, target=(0.1, 0.2))
    return path


def unchecked(path):
    """Take the checksums out of a journal, so that it is one of before."""
    path.write_text(re.sub(',"line_check":"[0-9a-f]{16}"', "", path.read_text()))


def test_what_is_written_is_read(begun):
    first, second = read_journal(begun)
    assert (first.n, first.time, first.event, first.run) == (0, 1.5, Event.START, RECORD)
    assert (second.pose, second.action, second.target) == (3, Action.MOVE, (0.1, 0.2))


def test_the_first_line_carries_its_schema_and_is_refused_without(begun):
    unchecked(begun)
    lines = begun.read_text().splitlines()
    assert json.loads(lines[0])["run"]["schema_name"] == "elastocal.journal/1"
    begun.write_text(lines[0].replace('"schema_name":"elastocal.journal/1",', "") + "\n")
    with pytest.raises(SchemaError, match="is not the start of a run"):
        read_journal(begun)


def test_a_line_is_json_with_number_time_and_event(begun):
    line = json.loads(begun.read_text().splitlines()[1])
    assert re.fullmatch("[0-9a-f]{16}", line.pop("line_check"))
    assert line == {
        "n": 1, "time": 2.0, "event": "begin", "pose": 3, "attempt": 1, "action": "move",
        "target": [0.1, 0.2],
    }  # fmt: skip


def test_numbers_go_on_after_it_is_opened_again(begun):
    with Journal(begun) as journal:
        assert journal.write(3.0, Event.END).n == 2
    assert [entry.n for entry in read_journal(begun)] == [0, 1, 2]


def test_every_entry_is_synced_before_write_returns(path):
    sizes = []
    with Journal(path, lambda file: sizes.append(os.fstat(file).st_size)) as journal:
        for _ in range(3):
            journal.write(0.0, Event.END)
            assert sizes[-1] == path.stat().st_size
    assert len(sizes) == 3


@pytest.mark.parametrize("cut", [1, 5, 30])
def test_a_torn_last_line_is_not_read_and_cut_off(begun, cut):
    data = begun.read_bytes()
    begun.write_bytes(data[:-cut])
    assert len(read_journal(begun)) == 1
    with Journal(begun) as journal:
        assert journal.write(3.0, Event.RESUME).n == 1
    assert [entry.event for entry in read_journal(begun)] == [Event.START, Event.RESUME]


def test_commits_are_found_in_order(begun):
    with Journal(begun) as journal:
        journal.write(3.0, Event.COMMIT, pose=3, attempt=2, log=LOG)
    assert read_commits(begun) == (LOG,)


def test_what_a_full_disk_took_of_a_line_is_given_back(begun):
    before = begun.read_bytes()

    def full(_):
        raise OSError(28, "No space left on device")

    with Journal(begun, full) as journal:
        with pytest.raises(FileAccessError, match=r"cannot write .*jsonl: No space left on device"):
            journal.write(3.0, Event.END)
        assert begun.read_bytes() == before
    with Journal(begun) as journal:
        assert journal.write(3.0, Event.END).n == 2


def test_a_line_that_is_written_in_parts_is_written_whole(begun, monkeypatch):
    write = os.write
    with Journal(begun) as journal:
        monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:9]))
        journal.write(3.0, Event.END)
    assert read_journal(begun)[-1].event is Event.END


def test_what_was_written_of_a_line_before_a_disk_was_full_is_given_back(begun, monkeypatch):
    before, write, left = begun.read_bytes(), os.write, [9]

    def filling(file: int, data: bytes) -> int:
        if not left:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data[: left.pop()])

    with Journal(begun) as journal:
        monkeypatch.setattr(os, "write", filling)
        with pytest.raises(FileAccessError, match="No space left on device"):
            journal.write(3.0, Event.END)
    assert begun.read_bytes() == before


def test_a_second_process_is_refused(begun):
    with Journal(begun), pytest.raises(FileAccessError, match="another process runs here"):
        Journal(begun)
    with Journal(begun) as journal:
        journal.write(0.0, Event.END)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"n":0,"time":0.0,"event":"end"}\n', "line 1 is not the start of a run"),
        ("no json\n", "line 1 is not valid JSON"),
        ('{"n":0,"time":0.0,"event":"never"}\n', "line 1: event: "),
        ('{"n":7,"time":0.0,"event":"end"}\n', "line 1: n must be 0, got 7"),
        ('{"n":0,"time":0.0,"event":"end","x":1}\n', "line 1: unknown key 'x'"),
    ],
)
def test_what_is_no_journal_is_refused(path, text, message):
    path.write_text(text)
    with pytest.raises(SchemaError, match=message):
        read_journal(path)


def test_a_journal_that_is_not_there_is_refused(path):
    with pytest.raises(FileAccessError, match="cannot read"):
        read_journal(path)


def test_every_changed_byte_of_a_line_is_found(begun):
    data = begun.read_bytes()
    for place in range(len(data) - 1):
        begun.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(SchemaError, match=r"journal\.jsonl: line [12]"):
            read_journal(begun)


@pytest.mark.parametrize("more", [b" ", b"\r", b"\n", b"0", b"\xef\xbb\xbf"])
def test_every_byte_too_much_is_found(begun, more):
    data = begun.read_bytes()
    for place in range(len(data)):
        begun.write_bytes(data[:place] + more + data[place:])
        with pytest.raises(SchemaError, match=r"journal\.jsonl: line [123]"):
            read_journal(begun)


def test_a_line_that_is_gone_is_found_although_the_numbers_were_mended(begun):
    with Journal(begun) as journal:
        journal.write(3.0, Event.END)
    first, _, last = begun.read_text().splitlines(keepends=True)
    begun.write_text(first + last.replace('"n":2', '"n":1'))
    with pytest.raises(SchemaError, match=r"line 2 was changed .*, or the one before it is gone"):
        read_journal(begun)


def test_a_journal_of_before_is_read_and_goes_on_with_checksums(begun):
    unchecked(begun)
    before = read_journal(begun)
    with Journal(begun) as journal:
        journal.write(3.0, Event.RESUME)
        journal.write(4.0, Event.END)
    assert read_journal(begun)[:2] == before
    data = begun.read_bytes()
    begun.write_bytes(data.replace(b'"time":3.0', b'"time":3.5'))
    with pytest.raises(SchemaError, match="line 3 was changed"):
        read_journal(begun)


def test_a_key_that_stands_twice_in_a_line_is_refused(path):
    path.write_text('{"n":0,"time":0.0,"time":1.0,"event":"end"}\n')
    with pytest.raises(SchemaError, match="line 1 is not valid JSON: key 'time' stands twice"):
        read_journal(path)
