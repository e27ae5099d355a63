"""The list of steps before a run, against the run."""

import pytest

from elastocal.procedure import RunEnd, itinerary
from elastocal.procedure.run.routes import remaining_times
from elastocal.procedure.run.steps import Step
from support.fake_runs import FakeRun, plan, settings

PLAN = plan(3)
SETTINGS = settings(PLAN)


def test_it_lists_every_state_of_every_pose_and_the_way_home():
    steps = itinerary(PLAN, SETTINGS)
    of_one = [step.step for step in steps if step.pose == 1]
    loads = 2 * [Step.LOAD, Step.SETTLE, Step.AVERAGE]
    before = [Step.MOVE, Step.AIM, Step.NEAR, Step.UNLOADED, Step.ENGAGE]
    assert of_one == [*before, *loads, Step.RELEASE, Step.LIFT, Step.RELEASED, Step.RETRACT]
    assert (steps[-1].pose, steps[-1].what) == (None, "to HOME by way of 1 via pose")
    assert steps[0].what == "from HOME to approach pose"


def test_what_remains_falls_with_every_pose():
    left = remaining_times(PLAN, SETTINGS)
    assert left.shape == (4,)
    assert left[0] == pytest.approx(sum(step.seconds for step in itinerary(PLAN, SETTINGS)))
    assert (left[:-1] > left[1:]).all()


def test_the_run_takes_about_as_long(tmp_path):
    run = FakeRun(tmp_path / "run", plan=PLAN)
    assert run.start().end is RunEnd.DONE
    # Cycles are waited out whole and the fake arm has no acceleration.
    assert run.cell.world.clock.now() == pytest.approx(remaining_times(PLAN, SETTINGS)[0], rel=0.35)
