"""Rows of presses of two arms, and readings that do not belong together."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal import dataset
from elastocal.elastic import ElasticModel, bearing, layout
from elastocal.errors import ConventionError, DatasetError, IdentificationError
from elastocal.identification import Contact
from elastocal.records import read_json
from elastocal.sim.two_arms import Tips, press_together, true_arm
from elastocal.two_robots import PairPlan, identify_pair, load_pair_cell, pair_readings
from elastocal.two_robots.presses import PairModel, build_pair, pair_blocks
from support import two_arms


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
