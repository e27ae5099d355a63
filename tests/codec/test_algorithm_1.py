"""The codec's arrays are those of Algorithm 1 in plain loops (tests/support/algorithm_1.py)."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.codec import CodecData, CodecOptions, Variant, cross_validate
from elastocal.codec.variants import SOLVERS
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import build
from support.algorithm_1 import Reference, algorithm_1
from support.by_day import some_by_day
from support.cells import Cell, rich_truth, robot

SPLITS = 3


@pytest.fixture(scope="module")
def readings() -> Readings:
    return Cell(rich_truth(), poses=12, seed=4).readings()


def compare(
    data: CodecData, wanted: Reference, readings: Readings, sizes=None, within: float = 1e-10
) -> None:
    """Choices exactly; errors, and the deflections that compliances predict, to round-off.

    A compliance that cannot be told from others is not compared by itself: it is defined to
    some 1e-5 only, whatever the order of the rows (docs/decisions/0030-codec.md).
    """
    np.testing.assert_array_equal(data.verification, wanted.verification)
    chosen = [[[p for p in row if p >= 0] for row in split] for split in data.chosen[0].tolist()]
    rows = np.arange(len(data.n_train)) if sizes is None else np.array(sizes) - 1
    assert [[split[k] for k in rows] for split in chosen] == wanted.chosen
    springs = data.variants[0].springs
    O = build(ElasticModel(robot(), layout(robot(), springs)), readings).O  # noqa: E741
    found, expected = data.compliance[0][:, rows], np.array(wanted.compliance)
    seen = np.einsum("rin,ckn->ckri", O, found), np.einsum("rin,ckn->ckri", O, expected)
    assert relative(data.error_mean[0][:, rows], np.array(wanted.error_mean)) < within
    assert relative(data.error_max[0][:, rows], np.array(wanted.error_max)) < within
    size = np.abs(seen[1]).max(axis=(2, 3))
    assert np.max(np.abs(seen[0] - seen[1]).max(axis=(2, 3)) / size) < within
    if springs == "actuated":
        assert relative(found, expected) < within


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest difference in units of the largest number of the same fit."""
    size = np.abs(expected).max(axis=2, keepdims=True)
    return float(np.max(np.abs(found - expected) / size))


@pytest.mark.parametrize("springs", ["actuated", "bearing"])
@pytest.mark.parametrize("search", ["cover", "random", "ioops", "exchange-a"])
def test_every_number_is_that_of_the_plain_loops(readings, springs, search):
    data = cross_validate(
        robot(), readings, [Variant(search=search, springs=springs)], CodecOptions(splits=SPLITS)
    )
    wanted = algorithm_1(robot(), readings, SPLITS, search=search, springs=springs)
    compare(data, wanted, readings)


def test_all_verification_sets_of_all_poses(readings):
    data = cross_validate(robot(), readings, [Variant(springs="actuated")])
    compare(data, algorithm_1(robot(), readings, 12, springs="actuated"), readings)
    assert data.seed_pose.tolist() == data.verification[:, 0].tolist() == list(range(12))


@pytest.mark.parametrize("cases", [("normal",), ("normal", "east")])
def test_training_load_cases_leave_verification_on_all_of_them(readings, cases):
    variant = Variant(springs="actuated", load_cases="+".join(cases))
    data = cross_validate(robot(), readings, [variant], CodecOptions(splits=SPLITS))
    wanted = algorithm_1(robot(), readings, SPLITS, springs="actuated", cases=cases)
    compare(data, wanted, readings)


@pytest.mark.parametrize("solver", some_by_day(["huber", "cauchy"]))
def test_robust_losses_fit_as_the_loops_do(readings, solver):
    variant = Variant(springs="actuated", solver=solver)
    data = cross_validate(robot(), readings, [variant], CodecOptions(splits=2))
    wanted = algorithm_1(robot(), readings, 2, springs="actuated", options=SOLVERS[solver])
    compare(data, wanted, readings)


def test_unbounded_fits_are_those_of_the_loops(readings):
    variant = Variant(springs="actuated", solver="unbounded")
    data = cross_validate(robot(), readings, [variant], CodecOptions(splits=SPLITS))
    options = SOLVERS["unbounded"]
    wanted = algorithm_1(robot(), readings, SPLITS, springs="actuated", options=options)
    compare(data, wanted, readings)
    assert data.compliance[0].min() < 0.0


def test_ratio_and_seed_are_followed(readings):
    data = cross_validate(
        robot(),
        readings,
        [Variant(springs="actuated", search="random")],
        CodecOptions(splits=SPLITS, ratio=1.0, seed=7),
    )
    wanted = algorithm_1(
        robot(), readings, SPLITS, springs="actuated", search="random", ratio=1.0, seed=7
    )
    compare(data, wanted, readings)
    assert data.training_poses == 6


@pytest.mark.slow
def test_missing_readings_are_left_out_of_training_and_verification(readings):
    rng = np.random.default_rng(5)
    left = readings.take(rng.random(len(readings)) < 0.7)
    for search in ("cover", "ioops"):
        data = cross_validate(
            robot(), left, [Variant(springs="actuated", search=search)], CodecOptions(splits=2)
        )
        wanted = algorithm_1(robot(), left, 2, springs="actuated", search=search)
        compare(data, wanted, left)


def test_a_pose_measured_twice_is_one_pose(readings):
    twice = readings.pose == 3
    rows = np.concatenate([np.arange(len(readings)), np.flatnonzero(twice)])
    doubled = readings.take(rows)
    renamed = doubled.pose.copy()
    renamed[len(readings) :] = 99
    data = cross_validate(
        robot(),
        replace(doubled, pose=renamed),
        [Variant(springs="actuated")],
        CodecOptions(splits=SPLITS),
    )
    assert data.pose_labels[3] == (3, 99)
    assert any("poses 3, 99 are one configuration" in finding for finding in data.findings)
    compare(data, algorithm_1(robot(), doubled, SPLITS, springs="actuated"), doubled)


@pytest.mark.slow
def test_thirty_one_poses_eighteen_springs_by_exchange():
    readings = Cell(rich_truth(), seed=1).readings()
    data = cross_validate(robot(), readings, [Variant(search="ioops", springs="bearing")])
    sizes = (1, 2, 5, 11, 22)
    wanted = algorithm_1(robot(), readings, 31, search="ioops", sizes=sizes)
    # Conditions up to 1e6, the tolerance of the rank, times round-off.
    compare(data, wanted, readings, sizes, within=1e-9)
