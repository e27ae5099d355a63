import hashlib
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import (
    Limit,
    filling,
    read_bytes,
    read_text,
    remove_leftovers,
    replacing,
    sha256,
    write_text,
)
from support.cli import PATIENCE, elastocal


def test_text_comes_back_as_it_was_written(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "µm\r\nline\n")
    assert path.read_bytes() == "µm\r\nline\n".encode()
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_is_replaced_whole_and_a_reader_keeps_the_old_one(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with path.open() as reader:
        write_text(path, "new")
        assert reader.read() == "old"
    assert read_text(path) == "new"


@pytest.mark.parametrize("reason", [KeyboardInterrupt, ValueError])
def test_an_interruption_leaves_the_old_file_and_nothing_else(tmp_path, reason):
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def interrupted():
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise reason

    with pytest.raises(reason):
        interrupted()
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize("writer", [replacing, lambda place: filling(place, "last")])
def test_a_signal_as_soon_as_it_is_made_leaves_nothing(tmp_path, monkeypatch, writer):
    def interrupted(place):
        assert place.exists()
        raise KeyboardInterrupt

    monkeypatch.setattr("elastocal.files.show_life", interrupted)
    with pytest.raises(KeyboardInterrupt), writer(tmp_path / "out"):
        pass
    assert not list(tmp_path.iterdir())


def test_the_temporary_file_is_beside_its_target_with_its_suffix(tmp_path):
    with replacing(tmp_path / "a.nc") as temporary:
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".nc")
        assert not (tmp_path / "a.nc").exists()
    assert (tmp_path / "a.nc").exists()


def test_the_temporary_name_may_be_replaced_by_the_writer(tmp_path):
    """Libraries that write to a new file of their own and rename it are served, too."""
    with replacing(tmp_path / "a.txt") as temporary:
        other = tmp_path / "other"
        other.write_text("whole")
        other.replace(temporary)
    assert read_text(tmp_path / "a.txt") == "whole"


def test_a_new_file_has_the_usual_permissions(tmp_path):
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "a.txt", "text")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o640


def test_a_missing_folder_or_a_folder_for_a_file_cannot_be_written(tmp_path):
    for path in (tmp_path / "none" / "a.txt", tmp_path):
        with pytest.raises(FileAccessError, match=f"cannot write {path}: ") as refusal:
            write_text(path, "text")
        assert isinstance(refusal.value, OSError)
    assert not list(tmp_path.iterdir())


def test_a_pipe_is_not_replaced_by_a_file(tmp_path):
    """Renaming onto /dev/null would take it away from the whole machine."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(FileAccessError, match=f"cannot write {pipe}"):
        write_text(pipe, "text")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b" \n\t", "the file is empty"),
        (b"\xff\xfe\x00", "not a UTF-8 text file"),
    ],
)
def test_what_is_not_text_is_refused(tmp_path, content, message):
    path = tmp_path / "a.txt"
    path.write_bytes(content)
    with pytest.raises(FileAccessError, match=f"cannot read {path}: {message}"):
        read_text(path)


def test_a_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot read .*none: No such file"):
        read_text(tmp_path / "none")


def test_the_mark_that_windows_puts_in_front_is_dropped(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbfpose")
    assert read_text(path) == "pose"


def test_a_hash_is_that_of_the_utf8_bytes():
    assert sha256("µm") == hashlib.sha256("µm".encode()).hexdigest()
    assert sha256("a\n") != sha256("a\r\n")


class TestFilling:
    def test_a_new_folder_appears_with_all_its_files(self, tmp_path):
        with filling(tmp_path / "deep" / "plan", "plan.json") as folder:
            (folder / "plan.json").write_text("1")
            (folder / "pool.nc").write_text("2")
            assert not (tmp_path / "deep" / "plan").exists()
        names = {entry.name for entry in (tmp_path / "deep" / "plan").iterdir()}
        assert names == {"plan.json", "pool.nc"}
        assert [entry.name for entry in (tmp_path / "deep").iterdir()] == ["plan"]

    def test_an_error_leaves_nothing_behind(self, tmp_path):
        def interrupted():
            with filling(tmp_path / "plan", "plan.json") as folder:
                (folder / "pool.nc").write_text("2")
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            interrupted()
        assert list(tmp_path.iterdir()) == []

    def test_a_folder_that_holds_files_is_refused_before_the_work(self, tmp_path):
        (tmp_path / "mine.txt").write_text("keep")
        with (
            pytest.raises(FileAccessError, match=r"holds files already \(mine.txt\)"),
            filling(tmp_path, "plan.json"),
        ):
            pytest.fail("the block must not run")

    def test_force_replaces_what_has_the_same_name_and_keeps_the_rest(self, tmp_path):
        for name in ("mine.txt", "plan.json", "pool.nc"):
            (tmp_path / name).write_text("old")
        with filling(tmp_path, "plan.json", force=True) as folder:
            (folder / "plan.json").write_text("new")
        assert (tmp_path / "plan.json").read_text() == "new"
        assert (tmp_path / "mine.txt").read_text() == "old"

    def test_a_folder_that_cannot_be_made_is_named(self, tmp_path):
        (tmp_path / "file").write_text("")
        with (
            pytest.raises(FileAccessError, match="file/plan"),
            filling(tmp_path / "file" / "plan", "plan.json"),
        ):
            pytest.fail("the block must not run")


def test_the_folder_that_one_is_in_can_be_filled(tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    with filling(Path(), "last.txt", force=True) as folder:
        assert folder.parent == tmp_path
        (folder / "last.txt").write_text("x")
    assert [each.name for each in here.iterdir()] == ["last.txt"]
    assert [each.name for each in tmp_path.iterdir()] == ["here"]


def test_what_is_wrong_with_another_file_is_told_of_that_file(tmp_path):
    def copied():
        with replacing(tmp_path / "out.txt") as temporary:
            temporary.write_text(read_text(tmp_path / "gone.txt"))

    with pytest.raises(FileAccessError, match=r"^cannot read .*gone\.txt: "):
        copied()
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.json")
    with pytest.raises(FileAccessError, match=r"a\.json: it is a pipe or a device, not a file"):
        read_text(tmp_path / "a.json")
    with pytest.raises(FileAccessError, match=r"a\.json: it is a pipe or a device, not a file"):
        read_bytes(tmp_path / "a.json")


def test_no_file_is_read_whole_that_is_larger_than_its_kind_may_be(tmp_path):
    with (tmp_path / "a.src").open("wb") as file:
        file.truncate(3_000_001)
    few = Limit("ELASTOCAL_MAX_OF_A_TEST", 3, "MB")
    assert len(read_bytes(tmp_path / "a.src")) == 3_000_001
    with pytest.raises(SchemaError, match=r"a\.src has 3 MB, which is more than 3 MB .*OF_A_TEST"):
        read_bytes(tmp_path / "a.src", few)
    with (tmp_path / "a.src").open("r+b") as file:
        file.truncate(100_000_001)
    with pytest.raises(SchemaError, match=r"100 MB .*ELASTOCAL_MAX_FILE_MB"):
        read_bytes(tmp_path / "a.src")


def test_a_name_that_is_no_text_is_refused_in_the_words_of_the_file(tmp_path):
    with pytest.raises(FileAccessError, match=r"a\.yaml: a name in it is no text in UTF-8"):
        write_text(tmp_path / "a.yaml", "log: " + os.fsdecode(b"\xff.csv"))
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_still_called_one(tmp_path):
    with pytest.raises(FileAccessError, match="Is a directory"):
        read_text(tmp_path)


@pytest.mark.parametrize("below", ["", "c", "c/d"])
def test_a_file_where_a_folder_should_be_is_called_one(tmp_path, below):
    (tmp_path / "model.json").write_text("x")
    with (
        pytest.raises(FileAccessError, match=r"model\.json is a file, not a folder"),
        filling(tmp_path / "model.json" / below, "a.c"),
    ):
        pass


KILLED = """
import os, signal, sys
from pathlib import Path
from elastocal.files import filling, replacing
where = Path(sys.argv[1])
with replacing(where / "a.json") as temporary, filling(where / "plan", "plan.json") as folder:
    temporary.write_text("half")
    (folder / "plan.json").write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


class TestWhatAKilledWriterLeaves:
    @pytest.fixture
    def where(self, tmp_path):
        subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False, timeout=PATIENCE)
        assert len(list(tmp_path.iterdir())) == 2
        return tmp_path

    def test_it_is_removed_by_the_next_command_that_writes_there(self, where):
        remove_leftovers(where)
        assert list(where.iterdir()) == []

    def test_so_it_is_beside_a_folder_and_a_file_that_are_written(self, where):
        remove_leftovers(where / "plan")
        assert [each.name.partition(".elastocal-")[0] for each in where.iterdir()] == [".a.json"]
        remove_leftovers(where / "a.json")
        assert list(where.iterdir()) == []

    def test_it_is_no_file_of_somebody_else_to_a_demo(self, where):
        (where / "README.md").write_text("# A demo of elastocal: afp\n")
        assert "holds a demo already" in elastocal("demo", "--out", where).reason

    def test_what_is_at_work_is_left_alone(self, tmp_path):
        with filling(tmp_path / "plan", "plan.json") as folder:
            write_text(folder / "plan.json", "whole")
            with replacing(tmp_path / "a.json") as temporary:
                temporary.write_text("whole")
                remove_leftovers(tmp_path)
        assert read_text(tmp_path / "plan" / "plan.json") == "whole"
        assert read_text(tmp_path / "a.json") == "whole"
