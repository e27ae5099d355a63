"""Bounds and stiffnesses that a spring file knows beforehand."""

from pathlib import Path

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, KnownSpring, known_springs, layout
from elastocal.errors import ElastocalError, IdentificationError
from elastocal.identification import (
    CalibrationSummary,
    FitOptions,
    calibrate,
    summary,
    with_knowledge,
)
from elastocal.records import from_data, to_data
from support.cells import robot
from support.problems import elastic, linear_readings

NAMES = elastic("actuated").spring_names


def file_of(folder: Path, *springs: str, include: str = "actuated") -> str:
    path = folder / "springs.yaml"
    lines = ["schema: elastocal.springs/1", f"include: {include}", "springs:"]
    path.write_text("\n".join([*lines, *(f"  - {{{spring}}}" for spring in springs)]) + "\n")
    return str(path)


def fitted(*known: KnownSpring, springs: str = "actuated", sigma: float = 20e-6):
    readings, truth = linear_readings("actuated", sigma)
    model = elastic(springs)
    options = with_knowledge(FitOptions(), known, model, readings)
    return calibrate(model, readings, np.random.default_rng(0), options), truth


def test_a_file_says_what_is_known_of_included_springs_and_adds_none(tmp_path):
    name = file_of(
        tmp_path,
        'joint: joint_2, stiffness: "1.25 MN*m/rad", uncertainty: "20 %"',
        'joint: joint_1, bounds: ["0.5 MN*m/rad", "5 MN*m/rad"]',
        'joint: joint_3, bounds: ["0.1 urad/(N*m)", "1 urad/(N*m)"]',
    )
    assert layout(robot(), name) == layout(robot(), "actuated")
    known = {each.name: each for each in known_springs(robot(), name)}
    shorter = str(Path(name).rename(tmp_path / "springs.yml"))
    assert known_springs(robot(), shorter) == tuple(known.values())
    first, second, third = (known[each] for each in NAMES[:3])
    assert (second.name, second.compliance) == (NAMES[1], pytest.approx(0.8e-6))
    assert second.sigma == pytest.approx(0.16e-6)
    assert (first.low, first.high) == (pytest.approx(0.2e-6), pytest.approx(2e-6))
    assert (third.low, third.high) == (pytest.approx(0.1e-6), pytest.approx(1e-6))


def test_a_layout_by_name_knows_nothing():
    assert known_springs(robot(), "bearing") == ()


@pytest.mark.parametrize(
    ("spring", "message"),
    [
        ('joint: joint_2, stiffness: "1.2 MN*m/rad"', "come together"),
        ('joint: joint_2, uncertainty: "20 %"', "come together"),
        ('joint: joint_2, stiffness: "1.2", uncertainty: "20 %"', "not a stiffness or compliance"),
        ('joint: joint_2, stiffness: "1 MN*m/rad", uncertainty: "0.2"', "must be a percentage"),
        ('joint: joint_2, stiffness: "1 MN*m/rad", uncertainty: "much %"', "must be a percentage"),
        ('joint: joint_2, stiffness: "0 N*m/rad", uncertainty: "2 %"', "must be above 0"),
        ('joint: joint_2, bounds: ["1 N*m/rad", "1 N*m/rad"]', "two different values"),
        ('joint: joint_2, stiffness: "1 N/um", uncertainty: "2 %"', "must have the unit of rad"),
        ('joint: joint_2, kind: tensor, bounds: ["1 N*m/rad", "2 N*m/rad"]', "has 6 numbers"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(tmp_path, spring, message):
    with pytest.raises(ElastocalError, match=message) as refused:
        known_springs(robot(), file_of(tmp_path, spring))
    assert "\n" not in str(refused.value)


def test_bounds_hold_the_spring_and_no_other():
    free, truth = fitted()
    low, high = 2.0 * truth[1], 3.0 * truth[1]
    held, _ = fitted(KnownSpring(NAMES[1], low, high))
    assert held.calibrated.compliance[1] == pytest.approx(low)
    assert free.calibrated.compliance[1] == pytest.approx(truth[1], rel=0.1)
    assert np.all(held.calibrated.draws[:, 1] >= low)


def test_a_certain_prior_wins_and_a_vague_one_does_not():
    truth = fitted()[1]
    certain, _ = fitted(KnownSpring(NAMES[1], None, None, 2.0 * truth[1], 1e-6 * truth[1]))
    vague, _ = fitted(KnownSpring(NAMES[1], None, None, 2.0 * truth[1], 10.0 * truth[1]))
    assert certain.calibrated.compliance[1] == pytest.approx(2.0 * truth[1], rel=1e-3)
    free, _ = fitted()
    assert vague.calibrated.compliance[1] == pytest.approx(free.calibrated.compliance[1], rel=1e-3)


def test_a_prior_is_no_data_observability_does_not_count_it():
    readings, _ = linear_readings("bearing", 20e-6)
    model = elastic("bearing")
    known = [KnownSpring(name, None, None, 1e-6, 1e-7) for name in model.spring_names]
    options = with_knowledge(FitOptions(), known, model, readings)
    made = calibrate(model, readings, np.random.default_rng(0), options)
    plain = calibrate(model, readings, np.random.default_rng(0))
    seen, without = made.calibrated.observability, plain.calibrated.observability
    assert seen.rank == without.rank == 15
    assert seen.unobservable == without.unobservable


def test_the_figures_say_which_springs_had_a_prior_and_are_read_back():
    truth = fitted()[1]
    known = (
        KnownSpring(NAMES[1], None, None, truth[1], 0.2 * truth[1]),
        KnownSpring(NAMES[2], 0.0, 1e-5),
    )
    figures = summary(fitted(*known)[0], None, known)
    assert [row.name for row in figures.springs if row.prior] == [NAMES[1]]
    assert from_data(CalibrationSummary, to_data(figures), "m").known == known


def test_a_spring_that_the_model_does_not_have_is_refused():
    with pytest.raises(IdentificationError, match="the model has no spring"):
        fitted(KnownSpring("joint_9.axial", 0.0, 1e-6))


def test_without_noise_a_prior_has_no_part():
    made, truth = fitted(KnownSpring(NAMES[1], None, None, 1e-5, 1e-7), sigma=0.0)
    np.testing.assert_allclose(made.calibrated.compliance, truth, rtol=1e-6)
    assert isinstance(made.calibrated.model, ElasticModel)
