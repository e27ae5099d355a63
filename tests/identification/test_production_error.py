"""The error to expect on production: what it is made of, and an interval for many looks."""

from functools import cache

import numpy as np
import pytest
from scipy.special import ndtr

from elastocal.errors import IdentificationError
from elastocal.identification import (
    FEWEST,
    FitOptions,
    ProductionError,
    ProductionRows,
    build,
    choose_model,
    level_of_a_look,
    production_error,
    solve,
    with_knowledge,
)
from support.cells import TRACKED, Cell, rich_truth, robot, unseen

OPTIONS = FitOptions()


@cache
def readings(poses: int):
    return Cell(rich_truth(), noise=TRACKED, seed=3, poses=poses).readings()


@cache
def production() -> ProductionRows:
    rows = unseen(rich_truth())
    return ProductionRows(rows.joint_position, rows.force)


@cache
def expected(poses: int) -> ProductionError:
    return production_error(robot(), readings(poses), production(), OPTIONS)


def test_the_bounds_of_one_sided_tests_after_each_of_several_equal_steps_are_the_known_ones():
    # Pocock's constants at 5 %: C. Jennison, B. W. Turnbull, Group Sequential Methods, 2000.
    for looks, bound in ((1, 1.645), (2, 1.875), (5, 2.122), (10, 2.270)):
        level = level_of_a_look(1, looks)
        assert level == pytest.approx(float(ndtr(bound)), abs=5e-4)


def test_a_later_first_look_costs_less():
    assert level_of_a_look(4, 12) > level_of_a_look(8, 12) > level_of_a_look(11, 12) > 0.95


def test_the_true_error_lies_in_the_interval():
    few, rows = expected(12), unseen(rich_truth())
    choice = choose_model(robot(), readings(12), "auto", OPTIONS, production=production())
    options = with_knowledge(OPTIONS, choice.known, choice.model, readings(12))
    compliance = solve(build(choice.model, readings(12), options)).compliance
    predicted = choice.model.deflection(compliance, rows.joint_position, rows.force)
    true = np.sqrt(np.mean(np.sum(np.square(predicted - rows.deflection), axis=1)))
    assert few.low < true < few.high
    assert few.springs == choice.taken
    assert few.error == pytest.approx(np.hypot(few.model, few.fit))


def test_more_poses_narrow_the_interval_and_leave_what_springs_cannot_express():
    few = expected(12)
    more = few.after(12, 0.25)
    assert (more.poses, more.model) == (24, few.model)
    assert more.fit == pytest.approx(0.5 * few.fit)
    assert more.high / more.error < few.high / few.error


def test_an_interval_for_many_looks_is_wider_about_the_same_error():
    once = expected(12)
    often = ProductionError.of(
        once.poses, once.springs, once.model, once.fit, once.spread, level_of_a_look(FEWEST, 31)
    )
    assert often.error == once.error
    assert often.low < once.low < once.high < often.high


def test_too_few_poses_are_refused_by_number():
    with pytest.raises(IdentificationError, match=r"7 poses: .* from 8 on"):
        production_error(robot(), readings(7), production(), OPTIONS)
