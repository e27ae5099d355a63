"""When a run has enough poses by the error to expect on production, and what it says if not."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from elastocal.errors import IdentificationError, ProcedureError
from elastocal.identification import FEWEST, ProductionError
from elastocal.procedure import RunFolder
from elastocal.workflows import until
from elastocal.workflows.until import AccuracyWatch, ReachedAccuracy
from support.fake_runs import plan

CELL = SimpleNamespace(name="fake", process=object())


def error(poses: int, model: float, fit: float) -> ProductionError:
    """Return an error of both parts, in mm, that is known exactly."""
    return ProductionError.of(poses, "gears", 1e-3 * model, 1e-3 * fit, 1e-9, 0.95)


@pytest.fixture
def watch(monkeypatch):
    """Return a watch of a run of 12 poses whose error falls by 0.01 mm a pose, and its lines."""
    lines, covered = [], SimpleNamespace(is_enough=True, sentence=lambda: "half is covered")

    def expected(_cell, count, _level):
        if count == 9:
            raise IdentificationError("nothing fits")
        return error(count, 0.1, 0.20 - 0.01 * count)

    monkeypatch.setattr(until, "cell_error", expected)
    monkeypatch.setattr(until, "plan_coverage", lambda *_: covered)
    monkeypatch.setattr(until.procedure, "read_pose", lambda *_: None)
    monkeypatch.setattr(AccuracyWatch, "_dataset", lambda each: len(each._poses))
    monkeypatch.setattr(AccuracyWatch, "_say", lambda _, line: lines.append(line))
    made = AccuracyWatch(CELL, plan(12), RunFolder(Path("run")), 0.135e-3, 0.05, lines.extend)
    return made, lines, covered


def visit(watch: AccuracyWatch, poses: range) -> list[str]:
    return [watch(SimpleNamespace(pose=pose)) for pose in poses]


def test_it_stops_at_the_first_pose_with_which_the_upper_end_is_low_enough(watch):
    made, lines, _ = watch
    assert visit(made, range(FEWEST - 1)) == [""] * (FEWEST - 1)
    assert lines == []
    *before, last = visit(made, range(FEWEST - 1, 11))
    assert before == ["", "", ""]
    assert last.startswith(
        "0.135 mm reached with 11 poses: the error on production is below 0.135 mm"
    )
    assert [each.poses for each in made.looks] == [8, 10, 11]
    assert "after 9 poses no error can be stated: nothing fits" in lines


def test_a_resumed_run_looks_once_at_the_poses_that_it_has(watch):
    made, _, _ = watch
    for pose in range(11):
        made.add(SimpleNamespace(pose=pose))
    assert made.look().startswith("0.135 mm reached with 11 poses")
    assert made.reason == made.look()


def test_it_goes_on_while_the_poses_do_not_cover_production(watch):
    made, lines, covered = watch
    covered.is_enough = False
    assert visit(made, range(12)) == [""] * 12
    assert lines[-1] == "half is covered"


def test_what_can_never_be_judged_is_refused_at_once():
    run, short = RunFolder(Path("run")), plan(FEWEST - 1)
    with pytest.raises(ProcedureError, match="the plan has 7 poses"):
        AccuracyWatch(CELL, short, run, 1e-4, 0.05, print)
    nothing = SimpleNamespace(name="fake", process=None)
    with pytest.raises(ProcedureError, match=r"'fake' names no process: give process\.file"):
        AccuracyWatch(nothing, plan(12), run, 1e-4, 0.05, print)
    for wanted, risk in ((float("nan"), 0.05), (0.0, 0.05), (1e-4, float("nan")), (1e-4, 0.5)):
        with pytest.raises(ProcedureError, match=r"--until|--risk"):
            AccuracyWatch(CELL, plan(12), run, wanted, risk, print)


@pytest.mark.parametrize(
    ("model", "fit", "words"),
    [
        (0.1, 0.12, "not reached; with 2 more poses it may be"),
        (0.16, 0.01, "no number of poses shows 0.150 mm"),
        (0.149, 0.2, "nor expected soon"),
    ],
)
def test_it_says_whether_more_poses_would_do(model, fit, words):
    last = error(31, model, fit)
    further = tuple(last.after(n, 31 / (31 + 4 * n)) for n in (1, 2, 4, 8, 16))
    found = ReachedAccuracy(0.15e-3, 0.05, False, (last,), further)
    assert words in found.sentence()
    assert "could not be estimated" in ReachedAccuracy(1e-4, 0.05, False, ()).sentence()
