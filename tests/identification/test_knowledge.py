"""Bounds and stiffnesses that a spring file knows beforehand."""

import re
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
        ('joint: joint_2, kind: gear, bounds: ["1 N*m/rad", "2 N*m/rad"]', "has 4 numbers"),
        ('joint: joint_2, K1: "1 MN*m/rad", uncertainty: "20 %"', "is no gear"),
        ('joint: joint_2, kind: gear, K1: "1 MN*m/rad"', "K1, K2, K3 and uncertainty come"),
        ('joint: joint_2, kind: gear, K1: "1 N/um", uncertainty: "20 %"', "are in N.m/rad"),
        (
            'joint: joint_2, kind: gear, K2: "1 MN*m/rad", T1: "10 N*m", uncertainty: "20 %"',
            "needs T1 and T2",
        ),
        ('joint: joint_2, kind: gear, K3: "1 MN*m/rad", uncertainty: "20 %"', "it needs T2"),
        (
            'joint: joint_2, kind: gear, K1: "1 MN*m/rad", T1: "9 N*m", T2: "8 N*m",'
            ' uncertainty: "20 %"',
            "T1 must be below T2",
        ),
        (
            'joint: joint_2, kind: gear, K1: "5 MN*m/rad", T1: "300 N*m", T2: "900 N*m",'
            ' K3: "1 MN*m/rad", uncertainty: "20 %"',
            "K1, K2, K3 must grow: a gear stiffens",
        ),
        (
            'joint: joint_2, bounds: ["1 MN*m/rad", "2 MN*m/rad"], stiffness: "3 MN*m/rad",'
            ' uncertainty: "20 %"',
            "stiffness must lie within bounds",
        ),
        (
            'joint: joint_2, stiffness: "1e-9 N*m/rad", uncertainty: "2 %"',
            "largest rotational compliance",
        ),
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


@pytest.mark.slow
def test_a_certain_prior_wins_and_a_vague_one_does_not():
    truth = fitted()[1]
    certain, _ = fitted(KnownSpring(NAMES[1], None, None, 2.0 * truth[1], 1e-6 * truth[1]))
    vague, _ = fitted(KnownSpring(NAMES[1], None, None, 2.0 * truth[1], 10.0 * truth[1]))
    assert certain.calibrated.compliance[1] == pytest.approx(2.0 * truth[1], rel=1e-3)
    free, _ = fitted()
    assert vague.calibrated.compliance[1] == pytest.approx(free.calibrated.compliance[1], rel=1e-3)


@pytest.mark.slow
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


@pytest.mark.slow
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


SHEET = (
    'joint: joint_2, kind: gear, name: joint_2.gear, K1: "2 MN*m/rad", T1: "300 N*m",'
    ' K2: "2.5 MN*m/rad", T2: "900 N*m", K3: "3.2 MN*m/rad", uncertainty: "{} %"'
)


def with_gear(folder: Path, uncertainty: float):
    """Return the fit of an arm whose second joint has a gear with that data sheet."""
    name = file_of(folder, SHEET.format(uncertainty), include="bearing")
    springs = tuple(s for s in layout(robot(), name) if s.name != "joint_2.axial")
    model, readings = ElasticModel(robot(), springs), linear_readings("actuated", 20e-6)[0]
    known = known_springs(robot(), name)
    options = with_knowledge(FitOptions(), known, model, readings)
    made = calibrate(model, readings, np.random.default_rng(0), options)
    columns = [name.startswith("joint_2.gear") for name in model.parameter_names]
    return known, made.calibrated.compliance[columns], made


def test_a_data_sheets_stiffnesses_are_mean_compliances_between_its_torques(tmp_path):
    known, *_ = with_gear(tmp_path, 20)
    knees = np.array([300.0, 1000.0, 3000.0])
    assert [each.name for each in known] == ["joint_2.gear"] * 3
    for each, low, high, K in zip(known, (0, 300, 900), (300, 900, 1800), (2, 2.5, 3.2)):  # noqa: B905
        mean = knees * (np.arctan(high / knees) - np.arctan(low / knees)) / (high - low)
        np.testing.assert_allclose(each.weights, [1.0, *mean], rtol=1e-12)
        assert each.compliance == pytest.approx(1e-6 / K)
        assert each.sigma == pytest.approx(0.2e-6 / K)


@pytest.mark.slow
def test_a_certain_data_sheet_holds_the_gear_and_a_vague_one_does_not(tmp_path):
    known, certain, _ = with_gear(tmp_path, 0.0001)
    for each in known:
        assert np.dot(each.weights, certain) == pytest.approx(each.compliance, rel=2e-2)
    known, vague, made = with_gear(tmp_path, 1000)
    true = linear_readings("actuated", 20e-6)[1][1]
    assert np.dot(known[1].weights, vague) == pytest.approx(true, rel=0.2)
    assert abs(true / known[1].compliance - 1.0) > 0.5
    # In the table it is the compliance without torque, and it says that a prior had a part.
    figures = summary(made, None, known)
    assert [row.name for row in figures.springs if row.prior] == ["joint_2.gear"]
    assert from_data(CalibrationSummary, to_data(figures), "m").known == known


def test_k1_alone_is_the_compliance_without_torque(tmp_path):
    name = file_of(tmp_path, 'joint: joint_2, kind: gear, K1: "2 MN*m/rad", uncertainty: "5 %"')
    (known,) = known_springs(robot(), name)
    assert known.weights == (1.0, 1.0, 1.0, 1.0)


def test_the_data_sheet_of_the_page_on_springs_is_read(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "how-to" / "custom-springs.md"
    (block,) = [
        b for b in re.findall(r"```yaml\n(.*?)```", page.read_text(), re.DOTALL) if "K1" in b
    ]
    path = tmp_path / "sheet.yaml"
    path.write_text(block.replace("joint_a", "joint_"))
    known = known_springs(robot(), str(path))
    assert [each.weights is not None for each in known] == [True, True, True]
    assert len(layout(robot(), str(path))) == 18
