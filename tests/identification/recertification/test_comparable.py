import numpy as np
import pytest

from elastocal.errors import IdentificationError
from elastocal.identification import Term
from elastocal.identification.recertification._sums import (
    common_springs,
    comparable_sums,
)
from elastocal.identification.spring_sums import sum_text, sum_weights
from support.cells import linear_truth
from support.recertified import calibrated, made_up

NAMES = tuple(f"joint_{n}.axial" for n in range(1, 7))
GROUP = ((Term("joint_4.axial", 1.0), Term("joint_6.axial", -1.0)),)


def test_springs_that_both_models_determine_are_compared_one_by_one():
    sums = comparable_sums(made_up(0), made_up(1))
    assert sums == tuple((Term(name, 1.0),) for name in NAMES)


@pytest.mark.parametrize("which", [(GROUP, ()), ((), GROUP), (GROUP, GROUP)])
def test_springs_that_one_model_cannot_tell_apart_are_compared_by_their_sum(which):
    old, new = (made_up(n, unobservable=groups) for n, groups in enumerate(which))
    sums = comparable_sums(old, new)
    assert [sum_text(terms) for terms in sums] == [
        "joint_1.axial", "joint_2.axial", "joint_3.axial", "joint_4.axial + joint_6.axial",
        "joint_5.axial",
    ]  # fmt: skip


def test_a_spring_that_is_not_seen_at_all_is_in_no_comparison():
    old = made_up(0, unobservable=((Term("joint_6.axial", 1.0),),))
    assert [sum_text(each) for each in comparable_sums(old, made_up(1))] == list(NAMES[:5])


def test_every_sum_vanishes_on_what_neither_model_sees_and_there_are_as_many_as_the_rank():
    old, new = (calibrated(linear_truth(), seed) for seed in (0, 1))
    sums = comparable_sums(old, new)
    assert old.observability.rank == new.observability.rank == 14
    W = sum_weights(sums, old.model.spring_names)
    assert np.linalg.matrix_rank(W) == len(sums)
    for seen in (old.observability, new.observability):
        left = (*seen.unobservable, *seen.hidden, *([Term(each.name, 1.0)] for each in seen.faint))
        unseen = sum_weights(left, old.model.spring_names)
        assert len(sums) <= 18 - np.linalg.matrix_rank(unseen)
        np.testing.assert_allclose(W @ unseen.T, 0.0, atol=1e-6)


def test_a_sum_is_the_same_for_every_solution_that_the_data_allow():
    old, new = (calibrated(linear_truth(), seed) for seed in (0, 1))
    sums = comparable_sums(old, new)
    names = old.model.spring_names
    moved = old.compliance + 3e-6 * sum_weights(old.observability.unobservable, names).sum(axis=0)
    W = sum_weights(sums, names)
    np.testing.assert_allclose(W @ moved, W @ old.compliance, atol=1e-11)


def test_of_different_lists_only_common_springs_are_compared():
    eighteen, six = calibrated(linear_truth(), 0), calibrated(linear_truth(), 1, "actuated")
    assert [spring.name for spring in common_springs(eighteen, six)] == list(NAMES)
    told = {term.spring for terms in comparable_sums(eighteen, six) for term in terms}
    # The wrist's axial springs are mixed up with springs that the other model lacks.
    assert told == set(NAMES[:3])


def test_a_combination_of_an_unknown_spring_is_refused_by_its_name():
    damaged = made_up(0, unobservable=((Term("elbow", 1.0), Term("joint_6.axial", 1.0)),))
    with pytest.raises(IdentificationError, match="spring 'elbow', which the model does not have"):
        comparable_sums(damaged, made_up(1))
