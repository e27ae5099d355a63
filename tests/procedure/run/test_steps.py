"""The state machine as data: every way through it is safe."""

import itertools

import pytest

from elastocal.procedure.run.runner import ACTIONS
from elastocal.procedure.run.steps import (
    MAY_TOUCH,
    ON_APPROACH_LINE,
    Fault,
    FaultScope,
    Step,
    StepResult,
    next_step,
)

READING = [Step.LOAD, Step.SETTLE, Step.AVERAGE]
AFTER = [Step.RELEASE, Step.LIFT, Step.RELEASED, Step.RETRACT, Step.COMMIT]


def visit(loads, outcomes=()):
    """States of one attempt; outcomes are those of SETTLE and AVERAGE in turn, then GOOD."""
    given, step, passed = iter(outcomes), Step.MOVE, []
    while step is not Step.DONE:
        passed.append(step)
        judged = step in (Step.SETTLE, Step.AVERAGE)
        outcome = next(given, StepResult.GOOD) if judged else StepResult.GOOD
        if outcome is StepResult.LOAD_CASE_LOST or (
            step is Step.AVERAGE and outcome is StepResult.GOOD
        ):
            loads -= 1
        step = next_step(step, outcome, loads)
    return passed


def test_a_pose_with_two_load_cases_takes_the_steps_of_procedure_1():
    before = [Step.MOVE, Step.AIM, Step.NEAR, Step.UNLOADED, Step.ENGAGE]
    assert visit(2) == before + 2 * READING + AFTER


def test_a_load_case_that_cannot_be_had_is_followed_by_the_next_one():
    assert visit(2, [StepResult.LOAD_CASE_LOST])[5:] == [
        Step.LOAD, Step.SETTLE, *READING, *AFTER
    ]  # fmt: skip


def test_a_spoiled_window_settles_again():
    spoiled = [StepResult.GOOD, StepResult.REPEAT]
    assert visit(1, spoiled)[5:] == [
        Step.LOAD, Step.SETTLE, Step.AVERAGE, Step.SETTLE, Step.AVERAGE, *AFTER,
    ]  # fmt: skip


@pytest.mark.parametrize("outcomes", [*itertools.product(StepResult, repeat=4)])
def test_on_every_way_there_is_one_contact_and_one_retract_before_the_commit(outcomes):
    # SETTLE cannot spoil a window: it has none yet.
    fixed = [
        StepResult.GOOD if o is StepResult.REPEAT and i % 2 == 0 else o
        for i, o in enumerate(outcomes)
    ]
    passed = visit(2, fixed)
    assert passed.count(Step.ENGAGE) == passed.count(Step.RETRACT) == 1
    assert passed[-5:] == AFTER


def test_every_state_has_an_action_or_is_the_commit_or_the_end():
    assert set(Step) - set(ACTIONS) == {Step.COMMIT, Step.DONE}


def test_what_touches_is_off_the_approach_pose():
    assert MAY_TOUCH < ON_APPROACH_LINE
    assert Step.MOVE not in ON_APPROACH_LINE


def test_every_fault_has_a_message_of_its_own_and_says_what_it_ends():
    messages = [fault.message("x") for fault in Fault]
    assert len(set(messages)) == len(messages)
    assert {fault.scope for fault in Fault} == set(FaultScope)
