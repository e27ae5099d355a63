"""Rows of presses of two arms, and readings that do not belong together."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal import dataset
from elastocal.blocks import Bullets
from elastocal.elastic import ElasticModel, bearing, layout
from elastocal.errors import ConventionError, DatasetError, IdentificationError
from elastocal.identification import Contact
from elastocal.records import read_json
from elastocal.sim.two_arms import Tips, press_together, true_arm
from elastocal.two_robots import (
    PairPlan,
    PairResult,
    identify_pair,
    load_pair_cell,
    pair_readings,
)
from elastocal.two_robots.calibration import (
    LEFT_OUT,
    LOOKS_WRONG,
    MANY_ASIDE,
    SET_ASIDE,
    _screened,
)
from elastocal.two_robots.presses import PairModel, build_pair, pair_blocks
from support import two_arms
from support.by_day import some_by_day


@pytest.fixture(scope="module")
def cell():
    return load_pair_cell(two_arms.finished() / "cell.yaml")


@pytest.fixture(scope="module")
def own(cell):
    run = two_arms.finished() / "run"
    return tuple(
        dataset.read(run / f"{name}.nc").readings(robot.joint_names)
        for name, robot in zip(cell.arms, cell.robots, strict=True)
    )


@pytest.fixture(scope="module")
def pair(cell, own):
    return pair_readings(cell.arms, cell.robots, own, cell.T_first_second)


def test_rows_are_the_derivative_of_the_true_relative_displacement(cell):
    """Finite differences: the truth is the equilibrium of the deformed arms, weightless."""
    T = cell.T_first_second
    q = tuple(each[:4] for each in read_json(two_arms.finished() / "plan.json", PairPlan).q())
    arms = tuple(true_arm(r.urdf, r.tip, r.base, 1.0 + k) for k, r in enumerate(cell.robots))
    loads = {"a": np.array([3.0, 1.0, -10.0]), "b": np.array([0.0, -2.0, -5.0])}
    small = Tips(normal=1e9, across=1e9, marker=0.0)
    own = press_together(arms, T, q, loads, 1e-6, small, np.random.default_rng(0))
    weightless = tuple(replace(r, gravity=(0.0, 0.0, 0.0)) for r in cell.robots)
    readings = tuple(d.readings(r.joint_names) for d, r in zip(own, weightless, strict=True))
    pair = pair_readings(cell.arms, weightless, readings, T)
    models = tuple(ElasticModel(r, layout(r, "bearing-joint")) for r in weightless)
    model = PairModel(cell.arms, models)
    c = np.array([_truth(each.name, arms) for each in model.parameters])
    predicted = pair_blocks(model, pair) @ c
    assert pair.tracked
    size = np.linalg.norm(pair.relative, axis=1)
    assert np.all(np.linalg.norm(predicted - pair.relative, axis=1) < 2e-4 * size)


def _truth(name, arms):
    """Return the compliance of a spring of the truth by the name that the estimator has for it."""
    side, _, own = name.partition(":")
    joint, _, axis = own.partition(".")
    arm = arms[0 if side == "left" else 1]
    number = arm.linkage.joint_names.index(joint)
    axes = arm.linkage.axis[number]
    alike = [each for each in arm.springs if each.joint == joint]
    wanted = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2]}.get(axis, axes)
    (found,) = (each for each in alike if np.allclose(np.abs(each.axis), np.abs(wanted)))
    return 1.0 / found.law.k


def test_the_zero_of_rigid_tips_is_the_controllers_difference(pair):
    moved = pair.first.controller_displacement
    other = pair.second.controller_displacement @ pair.R.T
    assert not pair.tracked
    assert np.array_equal(pair.relative, other - moved)


def test_presses_are_matched_by_pose_and_load_case(cell, own, pair):
    shuffled = own[1].take(np.random.default_rng(0).permutation(len(own[1])))
    again = pair_readings(cell.arms, cell.robots, (own[0], shuffled), cell.T_first_second)
    assert np.array_equal(again.second.force, pair.second.force)
    fewer = own[1].take(np.arange(6, len(own[1])))
    found = pair_readings(cell.arms, cell.robots, (own[0], fewer), cell.T_first_second)
    assert found.unmatched == 6
    assert len(found) == len(pair) - 6


def test_no_press_in_common_is_refused(cell, own):
    other = replace(own[1], pose=own[1].pose + 1000)
    with pytest.raises(DatasetError, match="no press is in the readings of both 'left'"):
        pair_readings(cell.arms, cell.robots, (own[0], other), cell.T_first_second)


def test_forces_of_equal_sign_are_refused(cell, own):
    turned = replace(own[1], force=-own[1].force)
    with pytest.raises(ConventionError, match="equal sign"):
        pair_readings(cell.arms, cell.robots, (own[0], turned), cell.T_first_second)


def test_forces_in_another_frame_are_refused(cell, own):
    turned = replace(own[1], force=own[1].force[:, [1, 2, 0]])
    with pytest.raises(ConventionError, match="are not opposite: their sum is"):
        pair_readings(cell.arms, cell.robots, (own[0], turned), cell.T_first_second)


def test_a_mirrored_base_transform_is_refused(cell, own):
    mirrored = cell.T_first_second.copy()
    mirrored[:3, 0] *= -1.0
    with pytest.raises(ConventionError, match="mirrored"):
        pair_readings(cell.arms, cell.robots, own, mirrored)


@pytest.mark.parametrize("change", ["turned", "elsewhere"])
def test_a_wrong_base_transform_is_refused_since_the_tips_do_not_meet(cell, own, change):
    T = cell.T_first_second.copy()
    if change == "turned":
        T[:3, :3] = np.eye(3)
    else:
        T[1, 3] += 0.2
    with pytest.raises(ConventionError, match="mm apart"):
        pair_readings(cell.arms, cell.robots, own, T)


def test_a_tracker_at_one_arm_alone_is_refused(cell, own):
    tracked = replace(own[0], contacts=None)
    with pytest.raises(DatasetError, match=r"'left' alone"):
        pair_readings(cell.arms, cell.robots, (tracked, own[1]), cell.T_first_second)


def test_without_a_word_of_the_contact_nothing_is_fitted(pair):
    with pytest.raises(IdentificationError, match="what is known of the contact is needed"):
        identify_pair(pair, np.random.default_rng(0))


def test_a_free_contact_is_refused_beside_springs_that_imitate_it(cell, pair):
    first, second = (ElasticModel(robot, bearing(robot)) for robot in cell.robots)
    normal = pair.first.load_case == "normal"
    few = replace(pair, first=pair.first.take(normal), second=pair.second.take(normal))
    with pytest.raises(IdentificationError, match=r"contact\.normal is free"):
        build_pair(PairModel(pair.names, (first, second)), few, Contact())


def test_a_model_of_an_arm_that_is_not_there_is_refused(pair):
    with pytest.raises(IdentificationError, match="no arm 'third'"):
        identify_pair(pair, np.random.default_rng(0), Contact(5e7, 4e7), known={"third": None})


def moved(pair, rows, by):
    """Return the presses with what the first controller says moved at some of them, by metres."""
    said = pair.first.controller_displacement.copy()
    said[rows] += by
    return replace(pair, first=replace(pair.first, controller_displacement=said))


def predicted(found, pair):
    """Return the deflections that both models predict at presses, (arm, press, 3), in m."""
    own = zip(found.models, (pair.first, pair.second), strict=True)
    return np.stack([each.predict(r.joint_position, r.force).deflection for each, r in own])


@pytest.fixture(scope="module")
def sound(cell, pair):
    return identify_pair(pair, np.random.default_rng(0), cell.contact, "gears", draws=40)


@pytest.mark.slow
def test_presses_without_blunders_are_all_kept(pair, sound):
    assert len(sound.pair) == len(pair)
    assert not {SET_ASIDE.name, LOOKS_WRONG.name} & {each.kind for each in sound.findings}


@pytest.mark.slow
@pytest.mark.parametrize("off", some_by_day([1e-3, 3e-3, 50e-3]))
def test_a_blunder_is_set_aside_named_and_moves_neither_arm(cell, pair, sound, off):
    wrong = moved(pair, 40, [0.0, 0.6 * off, 0.8 * off])
    found = identify_pair(wrong, np.random.default_rng(0), cell.contact, "gears", draws=40)
    (named,) = [each for each in found.findings if each.kind == SET_ASIDE.name]
    assert f"pose {pair.first.pose[40]} {pair.first.load_case[40]} was set aside" in named
    assert named.values["error"] == pytest.approx(off, rel=0.1)
    for kept, own in ((found.pair.first, pair.first), (found.pair.second, pair.second)):
        assert np.array_equal(kept.force, np.delete(own.force, 40, axis=0))
    before = predicted(sound, pair)
    error = np.linalg.norm(predicted(found, pair) - before, axis=2).mean(axis=1)
    assert np.all(error < 0.004 * np.linalg.norm(before, axis=2).mean(axis=1))
    shown = PairResult.of("cell", found, ("left.json", "right.json"))
    assert (shown.readings, shown.set_aside) == (len(pair) - 1, 1)
    assert dict(shown.facts())["Presses"] == "149, and 1 set aside as blunders"
    bullets = [each.items for each in shown.show() if isinstance(each, Bullets)]
    assert (named,) in bullets


def test_every_press_of_a_meeting_after_a_slip_is_set_aside(cell, pair):
    rows = pair.first.pose == pair.first.pose[40]
    kept, findings = _screened(moved(pair, rows, [3e-3, 0.0, 0.0]), cell.contact)
    assert len(kept) == len(pair) - 6
    assert len(findings) == 6


def one_in_five(pair, kind, rng):
    """Return presses of which a fifth is wrong: single ones, or all of some meetings."""
    if kind == "presses":
        return np.sort(rng.choice(len(pair), len(pair) // 5, replace=False))
    poses = np.unique(pair.first.pose)
    slipped = rng.choice(poses, len(poses) // 5, replace=False)
    return np.flatnonzero(np.isin(pair.first.pose, slipped))


@pytest.mark.slow
@pytest.mark.parametrize("off", [50e-3, 3e-3])
@pytest.mark.parametrize("kind", ["presses", "meetings"])
def test_where_one_press_in_five_is_wrong_these_are_set_aside_and_no_other(cell, pair, kind, off):
    """Single ones lie in most meetings, where all that presses share is spoilt by them."""
    some = one_in_five(pair, kind, np.random.default_rng(3))
    kept, (many, *named) = _screened(moved(pair, some, [0.0, 0.6 * off, 0.8 * off]), cell.contact)
    np.testing.assert_array_equal(kept.first.force, np.delete(pair.first.force, some, axis=0))
    assert {each.kind for each in named} == {SET_ASIDE.name}
    assert many == "30 of 150 presses were set aside as blunders: more than single mistakes"
    assert many.kind == MANY_ASIDE.name


def test_where_too_many_presses_are_wrong_none_is_set_aside_and_the_worst_is_named(cell, pair):
    some = np.arange(0, len(pair), 3)
    wrong = moved(moved(pair, some, [0.0, 0.0, 10e-3]), 21, [0.0, 0.0, 2e-3])
    kept, (named,) = _screened(wrong, cell.contact)
    assert len(kept) == len(pair)
    assert named.kind == LOOKS_WRONG.name
    assert named.values["count"] == len(some)
    assert f"`--exclude {pair.first.pose[21]}:{pair.first.load_case[21]}`" in named.advice
    assert f"the worst at pose {pair.first.pose[21]} {pair.first.load_case[21]} (" in named


def test_a_press_too_little_off_to_be_set_aside_is_named_and_kept(cell, pair):
    kept, (named,) = _screened(moved(pair, 40, [0.0, 0.0, 0.6e-3]), cell.contact)
    assert len(kept) == len(pair)
    assert (named.kind, named.values["count"]) == (LOOKS_WRONG.name, 1)
    assert f"pose {pair.first.pose[40]} {pair.first.load_case[40]}" in named


def test_presses_are_left_out_of_both_arms_by_name_and_said(cell, own, pair):
    pose, case = pair.first.pose[40], pair.first.load_case[40]
    other = pair.first.pose[0]
    names = f"{pose}:{case}", f"{other}"
    left = pair_readings(cell.arms, cell.robots, own, cell.T_first_second, names)
    gone = np.isin(np.arange(len(pair)), 40) | (pair.first.pose == other)
    for kept, all_of_it in ((left.first, pair.first), (left.second, pair.second)):
        np.testing.assert_array_equal(kept.force, all_of_it.force[~gone])
    assert left.unmatched == 0
    (said,) = _screened(left, cell.contact)[1]
    assert said.kind == LEFT_OUT.name
    assert f"{pose}:{case}" in said
    assert len(left.excluded) == 7


def test_a_meeting_where_the_tips_do_not_meet_may_be_left_out(cell, own):
    first = own[0].pose == own[0].pose[0]
    q = own[0].joint_position.copy()
    q[first, 0] += 0.3
    wrong = replace(own[0], joint_position=q), own[1]
    with pytest.raises(ConventionError, match=f"at pose {own[0].pose[0]} the tips .* mm apart"):
        pair_readings(cell.arms, cell.robots, wrong, cell.T_first_second)
    name = f"{own[0].pose[0]}"
    left = pair_readings(cell.arms, cell.robots, wrong, cell.T_first_second, name)
    assert len(left) == np.count_nonzero(~first)


@pytest.mark.parametrize(
    ("name", "message"),
    [("777", "no usable reading at pose 777"), ("a", "must be POSE or POSE:LOAD_CASE")],
)
def test_a_name_that_is_of_no_press_is_refused(cell, own, name, message):
    with pytest.raises(DatasetError, match=message):
        pair_readings(cell.arms, cell.robots, own, cell.T_first_second, (name,))
