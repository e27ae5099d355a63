import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi

from elastocal.blocks import Bullets, Table
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, Hinge, Parameter, layout
from elastocal.elastic.layouts import bearing_joint
from elastocal.identification import (
    CalibrateResult,
    CalibrationSummary,
    Choice,
    DriveCompliances,
    FitOptions,
    Observability,
    Prior,
    Term,
    attainable_rank,
    build,
    calibrate,
    choose_model,
    describe,
    describe_briefly,
    factor,
    observability,
    solve,
    summary,
    with_knowledge,
)
from elastocal.identification.calibration import Calibration
from elastocal.identification.observability import (
    FaintParameter,
    find_faint,
    find_hidden,
    left_open,
)
from elastocal.identification.show import show_calibration
from elastocal.identification.solve import Factored
from elastocal.identification.spring_sums import sum_text
from elastocal.records import from_data, to_data
from elastocal.robot import Robot
from support.cells import robot
from support.problems import campaign, elastic, linear_readings, made_up
from support.shared import GOLDEN, needs_shared

HINGE = Hinge("j.x", "j", (1.0, 0.0, 0.0)).parameters[0].unit
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


def test_a_combination_that_bounds_leave_no_room_is_in_no_group():
    """Both springs end at zero: neither can give way to the other, and the fit is the only one."""
    model, problem = elastic(), build(elastic(), campaign())
    system, names = factor(problem), list(model.parameter_names)
    pair = ("joint_5.axial", "joint_6.y")

    def groups(*at_zero):
        c = np.full(18, 1e-6)
        c[[names.index(name) for name in at_zero]] = 0.0
        found = observability(system, model.springs, problem, c)
        assert found.rank == 15
        return [describe(group) for group in found.unobservable]

    every = [describe(group) for group in observability(system, model.springs).unobservable]
    assert groups() == every
    # One of them alone may still grow at the expense of the other.
    assert groups(pair[0]) == groups(pair[1]) == every
    assert groups(*pair) == [every[0], every[2]]
    # A spring of two combinations lets one grow into the other.
    assert len(groups("joint_4.axial", "joint_5.z")) == 3
    free = replace(problem, lower=np.full(18, -np.inf))
    both = np.where(np.isin(names, pair), 0.0, 1e-6)
    assert len(observability(system, model.springs, free, both).unobservable) == 3


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


A_MINUS_B = (Term("a", 1.0), Term("b", -1.0))
FAINT = tuple(FaintParameter(name, 1e-6, 2e-6, reach) for name, reach in (("d", 3e-7), ("e", 4e-7)))
FIVE = Observability(3, 10.0, (False, False, True, False, False), (A_MINUS_B,), FAINT)


@pytest.mark.parametrize(
    ("weights", "number"),
    [
        ({"a": 1.0}, 1),
        ({"a": 1.0, "b": -1.0}, 1),
        # What the data leave open moves both alike, so it cancels in their sum.
        ({"a": 1.0, "b": 1.0}, None),
        ({"a": 1.0, "b": 1.0 + 1e-9}, None),
        ({"c": 1.0}, None),
        ({"b": 2.0, "f": 1.0}, 1),
        ({"f": 1.0}, 2),
    ],
)
def test_a_sum_of_springs_is_open_where_a_combination_changes_it(weights, number):
    seen = replace(FIVE, unobservable=(A_MINUS_B, (Term("f", 1.0),)))
    assert seen.group_of(weights) == number


@pytest.mark.parametrize(
    ("weights", "reach"),
    [
        ({"d": 2.0}, 6e-7),
        ({"d": 1.0, "e": -1.0}, 5e-7),
        ({"d": 1.0, "c": 0.0}, 3e-7),
        ({"d": 1.0, "c": 1.0}, None),
    ],
)
def test_noise_leaves_a_sum_open_as_far_as_independent_parts_where_none_is_seen(weights, reach):
    found = FIVE.faint_reach(weights)
    assert found is None if reach is None else found == pytest.approx(reach)


@pytest.mark.parametrize("sensible", ["its scale", "what was fitted", "the others of its unit"])
@pytest.mark.parametrize(("part", "hidden"), [(0.98, True), (1.02, False)])
def test_a_parameter_is_faint_below_twice_the_noise_averaged_over_the_poses(sensible, part, hidden):
    problem, truth = made_up(np.random.default_rng(0), blocks=9)
    c = truth.copy()
    scale = np.full(5, 1e-9)
    if sensible == "what was fitted":
        c = np.array([2.0, 3.0, 7.0, 2.0, 3.0])
    elif sensible == "the others of its unit":
        c = np.array([7.0, 7.0, 0.0, 0.0, 100.0])
    else:
        scale[2] = 7.0
    noise = 0.01 * np.random.default_rng(1).normal(size=problem.d.shape)
    hides = 2.0 * np.median(np.linalg.norm(noise, axis=1)) / chi.median(3) / np.sqrt(9)
    # The root mean square deflection that 7 of the third parameter make.
    size = 7.0 * np.sqrt(np.mean(np.sum(problem.O[:, :, 2] ** 2, axis=1)))
    problem.O[:, :, 2] *= part * hides / size
    problem.O[:, :, [0, 1, 3, 4]] *= 100.0
    problem = replace(problem, d=problem.O @ c + noise)
    units = [HINGE, HINGE, HINGE, HINGE, replace(HINGE, si="m/N")]
    parameters = [
        Parameter(name, "j", unit, float(s))
        for name, unit, s in zip("abcde", units, scale, strict=True)
    ]
    whole = Observability(5, 1.0, (True,) * 5, ())
    found = find_faint(whole, problem, c, parameters)
    assert found.observable == (True, True, not hidden, True, True)
    if hidden:
        (faint,) = found.faint
        assert faint.name == "c"
        assert (faint.deflection, faint.noise) == pytest.approx((part * hides, hides))
        assert faint.reach == pytest.approx(7.0 / part)
    in_a_group = replace(whole, unobservable=((Term("c", 1.0),),))
    assert find_faint(in_a_group, problem, c, parameters).faint == ()


@pytest.mark.parametrize("offset", [None, [0.1, 0.2, 0.3]])
def test_the_attainable_rank_is_what_a_rich_campaign_reaches(offset):
    moment = np.random.default_rng(0).normal(0.0, 200.0, (155, 3))
    for name in ("actuated", "bearing", "bearing-ends", "tensor"):
        model = elastic(name)
        rich = build(model, replace(campaign(), moment=moment), marker_offset=offset)
        reached = observability(factor(rich), model.springs).rank
        assert attainable_rank(model, offset) == reached, name


def test_weights_of_parameters_of_other_units_count_in_their_sensible_sizes():
    """A weight of 1e-8 is small beside 1, but not where a sensible value is that small as well."""
    big, small = (
        SimpleNamespace(parameters=(Parameter(name, name, HINGE, scale),))
        for name, scale in (("big", 1.0), ("small", 1e-8))
    )
    # Of both the data see the sum of multiples of their sizes alone.
    seen = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)
    system = Factored(np.array([1.0, 0.0]), seen, np.zeros(2), np.array([1.0, 1e8]))
    found = observability(system, (big, small))
    assert found.rank == 1
    ((first, second),) = found.unobservable
    assert (first.spring, second.spring) == ("big", "small")
    assert (first.weight, second.weight) == pytest.approx((1.0, -1e-8))


def test_a_spring_with_but_a_trace_in_a_combination_is_observable():
    """Rich models have combinations that are all but invisible, with a part of every spring."""
    springs = [
        SimpleNamespace(parameters=(Parameter(name, name, HINGE, 1.0),)) for name in ("a", "b", "c")
    ]
    hidden = np.array([1.0, -0.5, 0.005])
    seen = np.linalg.svd(hidden[None] / np.linalg.norm(hidden))[2]
    system = Factored(np.array([1.0, 0.9, 0.0]), np.roll(seen, -1, axis=0), np.zeros(3), np.ones(3))
    found = observability(system, springs)
    assert [describe(group) for group in found.unobservable] == ["a - 0.5 b"]
    assert found.observable == (False, False, True)


def test_a_long_combination_is_told_by_its_size():
    terms = [Term(name, 1.0) for name in "abcdefg"]
    assert describe_briefly(terms[:2]) == "(a + b)"
    assert describe_briefly(terms) == "7 springs mixed"


def test_a_marker_on_the_axis_of_the_last_joint_never_shows_its_spring():
    model, q = elastic("actuated"), np.array([0.1, -0.8, 1.2, 0.3, 0.7, 0.2])
    assert attainable_rank(model) == 6
    jacobian = model.spring_jacobian(q)
    to_axis = np.cross(jacobian.rotation[:, 5], jacobian.translation[:, 5])
    offset = model.robot.forward(q)[:3, :3].T @ to_axis
    assert np.linalg.norm(offset) > 0.01
    assert attainable_rank(model, offset) == 5


class TestDirectionsThatBoundsLeaveOpen:
    FREE, AT_BOUND = 1.0, 0.0

    def open_directions(self, rows, at_lower):
        """Return the rank that is left of a null space, given by rows, with springs at bounds."""
        below = np.where(at_lower, self.AT_BOUND, self.FREE)
        found = left_open(np.array(rows, dtype=float), below, np.full(len(rows), self.FREE))
        return found.shape[1]

    def test_without_a_spring_at_a_bound_all_are(self):
        assert self.open_directions(np.eye(3), [False] * 3) == 3

    def test_a_spring_that_may_move_inward_holds_none(self):
        assert self.open_directions(np.eye(3), [True, False, False]) == 3

    def test_two_springs_that_drive_one_another_outward_hold_their_direction(self):
        assert self.open_directions([[1, 0], [-1, 0], [0, 1]], [True, True, False]) == 1

    def test_three_springs_hold_a_plane(self):
        corners = [[1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0], [0, 0, 1]]
        assert self.open_directions(corners, [True, True, True, False]) == 1
        assert self.open_directions(corners, [True, True, False, False]) == 3

    @pytest.mark.parametrize("rounding", [0.0, 1e-15, -1e-15, 1e-13, -1e-13])
    def test_opposite_rows_hold_themselves_whatever_the_rounding(self, rounding):
        """Multipliers of 1e13 would reach any direction from rows that rounding keeps apart."""
        rows = [[1, rounding, 0], [-1, rounding, 0], [0.3, 0.9, 0], [0, 0, 1]]
        assert self.open_directions(rows, [True, True, True, False]) == 2

    @pytest.mark.parametrize("seed", [*range(40), 2458, 2512, 2930, 6676, 6913])
    def test_rows_that_nearly_depend_on_one_another_have_an_answer(self, seed):
        """Linear programmes of the last five ended without one: `calibrate` in a traceback."""
        rng = np.random.default_rng(seed)
        n = rng.integers(6, 44)
        k = rng.integers(1, min(14, n))
        null_space = np.linalg.qr(rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-14, 0, n))[0]
        null_space = null_space[:, :k] * (rng.random((n, k)) > 0.5)
        null_space = null_space + 10.0 ** rng.uniform(-16, -6) * rng.normal(size=null_space.shape)
        room = (rng.random((2, n)) > 0.4).astype(float)
        found = left_open(null_space, *room)
        assert np.isfinite(found).all()
        assert 0 <= found.shape[1] <= k


def fitted(readings: Readings, springs: str) -> tuple[Choice, CalibrationSummary, Calibration]:
    """Return a choice of springs and a calibration with them."""
    choice = choose_model(robot(), readings, springs, FitOptions(trust_conventions=True))
    options = FitOptions(trust_conventions=True)
    options = with_knowledge(options, choice.known, choice.model, readings)
    made = calibrate(choice.model, readings, np.random.default_rng(0), options)
    return choice, summary(made, None, choice.known), made


def test_springs_that_noise_mixes_are_named_with_the_sum_that_the_readings_tell():
    """Axis 3 tilts as axis 4 does, but for the short way between them."""
    readings, truth = linear_readings("bearing", 20e-6, poses=8)
    planted = dict(zip(elastic("bearing").parameter_names, truth, strict=True))
    _, found, made = fitted(readings, "bearing")
    (group,) = found.hidden
    assert {term.spring for term in group} == {"joint_3.x", "joint_3.z", "joint_4.x"}
    rows = {row.name: row for row in found.springs}
    number = len(found.unobservable) + 1
    assert all(rows[term.spring].group == number for term in group)
    for each in found.sums:
        value = sum(term.weight * planted[term.spring] for term in each.terms)
        assert each.low <= value <= each.high
    # The sum of two is told some times better than either.
    mixed = {term.spring for term in group}
    of_group = [each for each in found.sums if mixed >= {term.spring for term in each.terms}]
    best = min(of_group, key=lambda each: (each.high - each.low) / each.compliance)
    names = {term.spring for term in best.terms}
    alone = min(rows[name].high - rows[name].low for name in names)
    assert best.high - best.low < 0.5 * alone
    shown = list(show_calibration(found))
    items = [item for block in shown if isinstance(block, Bullets) for item in block.items]
    assert any(str(item).startswith(f"group {number}, hidden by noise: ") for item in items)
    # What no force tells apart has its sum, too.
    assert [{"joint_5.axial", "joint_6.y"}] == [
        {term.spring for term in each.terms}
        for each in found.sums
        if len(each.terms) == 2 and each.terms[0].spring == "joint_5.axial"
    ]
    firsts = [row[0] for block in shown if isinstance(block, Table) for row in block.rows]
    assert sum_text(best.terms) in firsts
    kept = from_data(CalibrateResult, to_data(CalibrateResult.of(made.calibrated, found)), "m")
    assert kept.observability == made.calibrated.observability


def test_a_spring_that_a_known_one_hides_is_named_with_it_and_not_called_weak():
    """Tilt of joint 4 about the axis of joint 3: the planted gear was "too weak to see"."""
    problem, truth = made_up(np.random.default_rng(0), blocks=9)
    noise = 0.3 * np.random.default_rng(1).normal(size=problem.d.shape)
    apart = problem.O[:, :, 1].copy()
    problem.O[:, :, 1] = problem.O[:, :, 0] + 1.5e-3 * apart
    problem.O[:, :, 4] *= 1e-6
    problem = replace(problem, d=problem.O @ truth + noise)
    sizes = np.array([1.0, 5.0, 1.0, 1.0, 1.0])
    parameters = [Parameter(name, "j", HINGE, 1.0) for name in "abcde"]
    whole = Observability(5, 1.0, (True,) * 5, ())
    found = find_hidden(whole, problem, truth, parameters, sizes, held=True)
    assert found.observable == (False, True, True, True, False)
    ((first, second),) = found.hidden
    assert (first.spring, second.spring) == ("a", "b")
    assert second.weight / first.weight == pytest.approx(-1.0, abs=0.1)
    assert [each.name for each in found.faint] == ["e"]
    ((one, other),) = found.seen_beside(parameters)
    assert (one.spring, other.spring) == ("a", "b")
    assert one.weight == pytest.approx(other.weight, abs=0.1)


def payloads(
    seed: int, turned: tuple[int, ...], jitter: float = 1e-4
) -> tuple[Readings, np.ndarray]:
    """Return weights hung at the tool of six postures that differ in some joints only."""
    model, rng = elastic("actuated"), np.random.default_rng(seed)
    middle = campaign(31).joint_position[0]
    q = np.tile(middle, (6, 1))
    q[:, turned] += rng.uniform(-0.5, 0.5, (6, len(turned)))
    q += jitter * rng.standard_normal(q.shape)
    q = np.repeat(q, 2, axis=0)
    force = np.tile([[0.0, 0.0, -600.0], [0.0, 0.0, -1200.0]], (6, 1))
    truth = np.array([0.45, 0.35, 0.4, 1.2, 1.5, 2.5]) * 1e-6
    marker = model.deflection(truth, q, force) + 10e-6 * rng.standard_normal(force.shape)
    readings = Readings(
        pose=np.repeat(np.arange(6), 2),
        load_case=np.tile(["60 kg", "120 kg"], 6),
        joint_position=q,
        force=force,
        controller_displacement=np.zeros_like(force),
        marker_displacement=marker,
        reference_joint_position=q.copy(),
    )
    return readings, truth


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_parallel_loads_at_postures_turned_about_the_base_make_no_value_out_of_nothing(seed):
    """Two weights and a vertical axis: the loads are one, and the levers those of one posture."""
    readings, truth = payloads(seed, turned=(0,))
    _, found, _ = fitted(readings, "actuated")
    for row, value in zip(found.springs, truth, strict=True):
        assert not row.observable or row.low <= value <= row.high
    assert not any(row.observable for row in found.springs[4:])
    assert found.hidden or len([row for row in found.springs if row.too_weak]) > 1


@pytest.mark.slow
@pytest.mark.parametrize("jitter", [1e-6, 1e-9])
def test_a_spring_that_some_draws_do_not_turn_stays_that_of_an_arm(jitter):
    """They had hundreds of rad/(N m) in draws, which the model file refuses."""
    readings, _ = payloads(0, (0,), jitter)
    _, found, made = fitted(readings, "actuated")
    assert made.calibrated.draws.max() <= 1.0
    assert CalibrateResult.of(made.calibrated, found).calibrated.compliance.max() < 1.0


def test_springs_whose_loads_turn_them_are_known():
    readings, truth = payloads(0, turned=(0, 1, 3, 5))
    _, found, _ = fitted(readings, "actuated")
    inside = [row.low <= c <= row.high for row, c in zip(found.springs, truth, strict=True)]
    assert sum(inside[1:]) >= 4
    assert sum(row.observable for row in found.springs) >= 3


def test_what_the_prior_alone_made_is_not_known():
    """The wrist's springs bend the arm by far more than the noise, but as those before them do."""
    readings, truth = payloads(1, turned=(0,))
    model = elastic("actuated")
    prior = DriveCompliances.of(robot(), readings, FitOptions()).known_springs(model)
    options = with_knowledge(FitOptions(trust_conventions=True), prior, model, readings)
    made = calibrate(model, readings, np.random.default_rng(0), options)
    sizes = np.array([each.sigma for each in prior])
    spread = np.std(made.calibrated.draws, axis=0)
    known = np.array([row.observable for row in summary(made, None, prior).springs])
    assert known.tolist() == [False, True, True, True, False, False]
    assert np.all(spread[known] < 0.5 * np.maximum(sizes, truth)[known])
    assert np.all(spread[~known] > 0.5 * sizes[~known])
    seen = made.calibrated.observability
    assert "joint_5.axial" not in {each.name for each in seen.faint}
    assert "joint_5.axial" in {term.spring for group in seen.hidden for term in group}
