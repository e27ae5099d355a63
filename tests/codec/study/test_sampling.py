import json
from pathlib import Path

import pytest

from elastocal.codec.study import DESIGN, PARTS, StudyStore, run_study
from elastocal.codec.study.sampling import ONE_AFTER_THE_OTHER, BatchExecutor, batches
from elastocal.errors import CodecError, FileAccessError, SchemaError
from support.studies import numbers, settings, simulate


def run(folder: Path, samples: int, spread=ONE_AFTER_THE_OTHER, **changes):
    return run_study(StudyStore(folder), settings(**changes), samples, simulate, spread)


def executor(do):
    return BatchExecutor(1, do)


@executor
def backwards(work, parts):
    return map(work, reversed(parts))


def killed_after(count, workers=1):
    def do(work, parts):
        yield from map(work, parts[:count])
        raise KeyboardInterrupt

    return BatchExecutor(workers, do)


@executor
def refusing(work, parts):
    raise AssertionError(f"nothing is left to do with {work}, not {parts}")


def test_results_come_in_the_order_of_their_numbers_whatever_was_done_first(tmp_path):
    forward, turned = run(tmp_path / "a", 7), run(tmp_path / "b", 7, backwards)
    assert [each.number for each in turned] == list(range(7))
    assert numbers(forward) == numbers(turned)


def test_a_killed_study_goes_on_and_ends_with_the_same_numbers(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, 9, killed_after(3))
    kept = set(StudyStore(tmp_path).finished(settings()))
    assert kept == {0, 1, 2, 3, 4, 5}
    asked = []

    def noting(work, parts):
        asked.extend(number for part in parts for number in part)
        return map(work, parts)

    again = run(tmp_path, 9, BatchExecutor(3, noting))
    assert asked == [6, 7, 8]
    assert numbers(again) == numbers(run(tmp_path / "whole", 9))


@pytest.mark.parametrize("workers", [1, 2, 300])
def test_every_number_is_in_one_batch_and_the_last_batches_are_single(workers):
    parts = batches(range(1000), workers, 16)
    assert [number for part in parts for number in part] == list(range(1000))
    sizes = [len(part) for part in parts]
    assert sizes == sorted(sizes, reverse=True)
    assert (max(sizes) == 16) == (workers < 300)
    assert set(sizes[-4:]) == {1}


def test_a_finished_study_is_not_done_again(tmp_path):
    first = run(tmp_path, 4)
    assert numbers(run(tmp_path, 4, refusing)) == numbers(first)


def test_more_samples_go_on_with_a_finished_study(tmp_path):
    few = run(tmp_path, 3)
    many = run(tmp_path, 8)
    assert numbers(many)[: len(numbers(few))] == numbers(few)
    assert len(run(tmp_path, 2, refusing)) == 2


def test_progress_counts_what_was_there_before(tmp_path):
    run(tmp_path, 4)
    told = []
    run_study(
        StudyStore(tmp_path), settings(), 6, simulate, ONE_AFTER_THE_OTHER,
        lambda _, done, total: told.append((done, total)),
    )  # fmt: skip
    assert told == [(4, 6), (5, 6), (6, 6)]


@pytest.mark.parametrize(
    ("change", "named"),
    [({"seed": 4}, "seed: 3, not 4"), ({"cell": "other"}, "cell: cell, not other"),
     ({"conditions": settings(5, 11).conditions}, "conditions: 5 cover all")],
)  # fmt: skip
def test_the_folder_of_another_study_is_refused_with_what_differs(tmp_path, change, named):
    run(tmp_path, 2)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(CodecError, match="holds another study") as refusal:
        run(tmp_path, 2, **change)
    assert named in str(refusal.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_folder_that_holds_something_else_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(FileAccessError, match=r"holds thesis\.tex and no study"):
        run(tmp_path, 2)


def test_less_than_one_sample_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(CodecError, match="0 samples: must be at least 1"):
        run(tmp_path / "study", 0)
    assert not (tmp_path / "study").exists()


def test_a_damaged_part_is_refused_by_name(tmp_path):
    run(tmp_path, 2)
    part = next((tmp_path / PARTS).glob("*.json"))
    part.write_text(part.read_text()[:50])
    with pytest.raises(SchemaError, match=part.name):
        run(tmp_path, 2)


def test_a_part_whose_figures_were_edited_is_refused(tmp_path):
    run(tmp_path, 2)
    part = next((tmp_path / PARTS).glob("*.json"))
    contents = json.loads(part.read_text())
    contents["samples"][0]["outcomes"][0]["error_mean"] = 1e-6
    part.write_text(json.dumps(contents))
    with pytest.raises(SchemaError, match=rf"{part.name} was edited, or belongs to a study"):
        run(tmp_path, 2)


def test_a_part_of_a_study_with_another_seed_is_refused(tmp_path):
    run(tmp_path / "a", 2)
    run(tmp_path / "b", 4, seed=4)
    foreign = sorted((tmp_path / "b" / PARTS).glob("*.json"))[-1]
    (tmp_path / "a" / PARTS / foreign.name).write_text(foreign.read_text())
    with pytest.raises(SchemaError, match="with other settings: delete it"):
        run(tmp_path / "a", 4)


def test_settings_of_an_unknown_version_are_refused(tmp_path):
    run(tmp_path, 2)
    path = tmp_path / DESIGN
    path.write_text(path.read_text().replace("study_settings/1", "study_settings/9"))
    with pytest.raises(SchemaError, match="study_settings/9"):
        run(tmp_path, 2)
