"""Runs know those before them: measuring until it is green, and old runs, are seen."""

import pytest

from elastocal.errors import VerificationError
from elastocal.procedure import RunFolder, read_journal
from elastocal.procedure.record import HISTORY
from elastocal.verdict import LinkState, begin_record
from elastocal.verdict.history import history_link
from elastocal.workflows import verify
from elastocal.workflows.verify import _expected
from support import reported
from support.fake_runs import RECORD


def begun(folder, name, started):
    run = RunFolder(folder / name)
    run.cell.mkdir(parents=True)
    (run.cell / "cell.yaml").write_text(name)
    return run, begin_record(RECORD.model_copy(update={"started": started}), run, "afp")


@pytest.fixture
def three(tmp_path):
    return [begun(tmp_path, f"run{n}", f"2026-01-0{n}T00:00:00+00:00") for n in (1, 2, 3)]


def test_a_run_states_its_number_its_files_and_those_before_it(three):
    records = [record for _, record in three]
    assert [each.run_number for each in records] == [1, 2, 3]
    assert [each.run for each in records[2].earlier_runs] == [r.identity for r in records[:2]]
    assert list(records[0].files_sha256) == ["cell/cell.yaml"]


def test_later_runs_are_named_where_the_history_is_at_hand(three):
    (run, record), (_, last) = three[0], three[2]
    link = history_link(record, run, "afp")
    assert f"names 2 after it, the last of them {last.identity[:16]}" in link.text
    assert history_link(RECORD, run, "afp") is None


def test_a_history_that_was_cut_is_broken_and_damaged_lines_are_left_out(three, tmp_path):
    run, record = three[2]
    path = tmp_path / HISTORY
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("no json\n" + lines[1] + lines[2])
    link = history_link(record, run, "afp")
    assert link.state is LinkState.BROKEN
    assert "was cut" in link.text


@pytest.mark.slow
def test_another_run_than_the_one_that_is_expected_is_refused():
    run = reported.finished() / "run"
    known = read_journal(run / "journal.jsonl")[0].run.identity
    verify(run, expect=known[:12]).require_whole()
    with pytest.raises(VerificationError, match="not of the run 00000000 that is expected"):
        verify(run, expect="0" * 8).require_whole()
    with pytest.raises(VerificationError, match="--expect"):
        verify(run, expect="newest")


@pytest.mark.parametrize(
    ("expect", "state", "said"),
    [
        ("abcd1234", LinkState.WHOLE, "as expected"),
        ("0" * 8, LinkState.BROKEN, "not of the run 00000000 that is expected"),
    ],
)
def test_a_run_is_held_against_the_expected_one(expect, state, said):
    (link,) = _expected("abcd1234" * 8, expect)
    assert link.state is state
    assert said in link.text
    (old,) = _expected(None, expect)
    assert "does not state its run" in old.text
    assert _expected(None, None) == []
    with pytest.raises(VerificationError, match="--expect"):
        _expected(None, "newest")
