import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, bearing_joint, layout
from elastocal.identification import (
    FitOptions,
    Prior,
    Term,
    build,
    calibrate,
    describe,
    factor,
    observability,
    solve,
)
from elastocal.robot import Robot
from support.problems import campaign, elastic
from support.shared import GOLDEN, needs_shared

WRIST = [
    "joint_a4.axial - joint_a5.x",
    "joint_a5.axial - joint_a6.y",
    "(joint_a4.y + joint_a4.z) - (joint_a5.axial + joint_a5.z)",
    "(joint_a5.x + joint_a5.z) - (joint_a6.axial + joint_a6.z)",
]
"""What no force shows on three wrist axes that meet (spec section 2, trap 1)."""


def seen(model, readings):
    return observability(factor(build(model, readings)), model.springs)


def golden(make):
    numbers = json.loads((GOLDEN / "golden_6r.json").read_text())
    robot = Robot.from_file(GOLDEN / "golden_6r.urdf", "tcp")
    model = ElasticModel(robot, make(robot))
    nothing = np.zeros((20, 3))
    readings = Readings(
        pose=np.arange(20),
        load_case=np.array(["normal"] * 20),
        joint_position=numbers["joint_position"],
        force=numbers["force"],
        controller_displacement=nothing,
        marker_displacement=nothing,
    )
    return seen(model, readings)


@needs_shared
def test_golden_6r_shows_fourteen_of_eighteen_and_names_the_rest():
    found = golden(bearing_joint)
    assert (found.rank, found.springs) == (14, 18)
    assert [describe(group) for group in found.unobservable] == WRIST


@needs_shared
def test_golden_6r_shows_thirteen_with_distal_frames():
    found = golden(partial(bearing_joint, distal=True))
    assert found.rank == 13
    assert len(found.unobservable) == 5


@needs_shared
def test_golden_6r_shows_all_six_axial_springs():
    found = golden(lambda robot: layout(robot, "actuated"))
    assert (found.rank, found.observable, found.unobservable) == (6, (True,) * 6, ())


def test_an_arm_of_another_maker_has_the_same_gaps_in_its_own_axes():
    found = seen(elastic(), campaign())
    assert found.rank == 15
    assert [describe(group) for group in found.unobservable] == [
        "joint_4.axial - joint_5.z",
        "joint_5.axial - joint_6.y",
        "(joint_5.x + joint_5.z) - (joint_6.axial + joint_6.x)",
    ]


def test_springs_in_no_combination_are_observable():
    found = seen(elastic(), campaign())
    named = {term.spring for group in found.unobservable for term in group}
    observable = {
        name for name, ok in zip(elastic().spring_names, found.observable, strict=True) if ok
    }
    assert observable == set(elastic().spring_names) - named


def test_adding_an_unobservable_combination_changes_no_predicted_deflection():
    model, readings = elastic(), campaign()
    found = seen(model, readings)
    for group in found.unobservable:
        c = np.zeros(18)
        for term in group:
            c[model.spring_names.index(term.spring)] = 1e-6 * term.weight
        shift = model.deflection(c, readings.joint_position, readings.force)
        assert np.abs(shift).max() < 1e-15


def test_neither_moments_nor_a_marker_aside_tell_springs_on_one_line_apart():
    moment = np.random.default_rng(0).normal(0.0, 200.0, (155, 3))
    problem = build(elastic(), replace(campaign(), moment=moment), marker_offset=[0.1, 0.2, 0.3])
    assert observability(factor(problem), elastic().springs).rank == 15


def test_few_poses_show_less_and_the_basis_says_what():
    some = campaign().take(campaign().load_case == "normal")
    found = seen(elastic(), some.take([0, 7, 14]))
    assert found.rank == 9
    assert len(found.unobservable) == 9


def test_condition_is_that_of_the_scaled_columns():
    problem = build(elastic("actuated"), campaign())
    rows = problem.O.reshape(-1, 6)
    expected = np.linalg.cond(rows / np.linalg.norm(rows, axis=0))
    assert seen(elastic("actuated"), campaign()).condition == pytest.approx(expected, rel=1e-9)


def test_the_condition_counts_only_what_is_observable():
    system = solve(build(elastic(), campaign())).factored
    expected = system.s[0] / system.s[14]
    assert seen(elastic(), campaign()).condition == pytest.approx(expected)
    assert expected < 1000.0


def test_a_prior_makes_nothing_observable():
    """It is what was believed before: a table must not show it as measured."""
    prior = Prior(mean=np.full(18, 1e-6), sigma=np.full(18, 1e-6), noise=2e-5)
    calibration = calibrate(
        elastic(), campaign(), np.random.default_rng(0), FitOptions(prior=prior, draws=40)
    )
    assert calibration.calibrated.observability.rank == 15


@pytest.mark.parametrize(
    ("group", "expected"),
    [
        ([("a", 1.0)], "a"),
        ([("a", 1.0), ("b", -1.0)], "a - b"),
        ([("a", 1.0), ("b", 0.5), ("c", -1.0)], "(a + 0.5 b) - c"),
        ([("a", 1.0), ("b", 1.0)], "(a + b)"),
        ([("a", 0.33333), ("b", -1.0)], "0.333 a - b"),
    ],
)
def test_a_combination_is_written_as_a_person_would(group, expected):
    assert describe([Term(*term) for term in group]) == expected
