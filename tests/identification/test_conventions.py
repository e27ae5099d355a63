from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import ConventionError, IdentificationError
from elastocal.identification.conventions import check_conventions
from elastocal.robot import Robot
from elastocal.sim.arm import (
    Linkage,
    bearing_truth,
)
from support.cells import QUIET, Cell, linear_truth, rich_truth, urdf
from support.urdfs import planar_arm_urdf

TURNED = urdf().replace('xyz="0.15 0.0 0.565" rpy="0 0 0"', 'xyz="0.15 0.0 0.565" rpy="0 0 1.2"')
"""A tool that is turned on the flange, so that sensor and tcp frame differ."""


@cache
def robot():
    assert urdf() != TURNED
    return Robot.from_urdf(TURNED, "tcp")


@cache
def good(seed=0) -> Readings:
    return Cell(bearing_truth(Linkage.from_urdf(TURNED, "tcp")), seed=seed).readings()


def model(springs):
    return ElasticModel(robot(), layout(robot(), springs))


def turned_back(readings, R, sign=1.0):
    """Return readings whose forces are written in the axes ``R``, shape (reading, 3, 3)."""
    return replace(readings, force=sign * np.einsum("rji,rj->ri", R, readings.force))


def tcp_axes(readings):
    return robot().forward(readings.joint_position)[:, :3, :3]


def sensor_axes(readings):
    return tcp_axes(readings) @ robot().chain.T_last_tip[:3, :3].T


def with_joints(readings, change):
    return replace(readings, joint_position=change(readings.joint_position.copy()))


def clockwise(q):
    return q * [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0]


def coupled(q):
    q[:, 2] = -(q[:, 1] + q[:, 2])
    return q


def from_horizontal(q):
    q[:, 2] = q[:, 1] + q[:, 2]
    return q


def swapped(r):
    return replace(
        r,
        marker_displacement=r.controller_displacement,
        controller_displacement=r.marker_displacement,
    )


MISTAKES = {
    "force on the tooling": (lambda r: replace(r, force=-r.force), "sign turned: elastocal"),
    "controller minus marker": (swapped, "or the displacement"),
    "tcp frame": (lambda r: turned_back(r, tcp_axes(r)), "in the tcp frame, not in base"),
    "tcp frame, turned": (
        lambda r: turned_back(r, tcp_axes(r), -1.0),
        "in the tcp frame with their sign turned",
    ),
    "sensor frame": (
        lambda r: turned_back(r, sensor_axes(r)),
        r"in the sensor \(last link\) frame, not in base",
    ),
    "sensor frame, turned": (
        lambda r: turned_back(r, sensor_axes(r), -1.0),
        r"in the sensor \(last link\) frame with their sign turned",
    ),
    "KUKA's clockwise axes": (lambda r: with_joints(r, clockwise), "joints 1, 4 and 6"),
    "FANUC's coupled axis": (lambda r: with_joints(r, coupled), r"use -\(q2 \+ q3\)"),
    "third joint from the horizontal": (lambda r: with_joints(r, from_horizontal), "use q3 - q2"),
    "reversed joints": (lambda r: with_joints(r, lambda q: q[:, ::-1]), "reverse order"),
}


@pytest.mark.parametrize("springs", ["actuated", "bearing"])
@pytest.mark.parametrize("name", MISTAKES)
def test_every_mistake_is_refused_by_its_name(name, springs):
    make, message = MISTAKES[name]
    with pytest.raises(ConventionError, match=message) as refusal:
        check_conventions(model(springs), make(good()))
    assert "% of the median deflection unexplained" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("springs", ["actuated", "bearing"])
@pytest.mark.parametrize("seed", range(3))
def test_good_data_pass(springs, seed):
    assert 0.0 < check_conventions(model(springs), good(seed)) < 0.3


@pytest.mark.parametrize("truth", [linear_truth, rich_truth])
@pytest.mark.parametrize("poses", [3, 5, 12])
@pytest.mark.parametrize("noise", [QUIET, Cell(linear_truth()).noise])
def test_few_poses_pass(truth, poses, noise):
    readings = Cell(truth(), poses=poses, noise=noise).readings()
    arm = Robot.from_urdf(urdf(), "tcp")
    for springs in ("actuated", "bearing"):
        check_conventions(ElasticModel(arm, layout(arm, springs)), readings)


def test_exact_data_pass():
    readings = good()
    elastic = model("bearing")
    deflection = elastic.deflection(np.full(18, 1e-6), readings.joint_position, readings.force)
    exact = replace(readings, marker_displacement=readings.controller_displacement + deflection)
    assert check_conventions(elastic, exact) < 1e-8


def test_a_moment_is_turned_with_the_force():
    readings = good()
    elastic = model("bearing")
    moment = np.random.default_rng(0).normal(0.0, 100.0, readings.force.shape)
    deflection = elastic.deflection(
        np.full(18, 1e-6), readings.joint_position, readings.force, moment
    )
    measured = replace(
        readings,
        moment=moment,
        marker_displacement=readings.controller_displacement + deflection,
    )
    assert check_conventions(elastic, measured) < 1e-8
    with pytest.raises(ConventionError, match=r"sign turned: elastocal.* leaves 0\.0% of"):
        check_conventions(elastic, replace(measured, force=-measured.force, moment=-moment))
    R = tcp_axes(readings)
    in_tcp = replace(turned_back(measured, R), moment=np.einsum("rji,rj->ri", R, moment))
    with pytest.raises(ConventionError, match=r"tcp frame, not in base.* leaves 0\.0% of"):
        check_conventions(elastic, in_tcp)


def test_a_blunder_does_not_hide_a_mistake():
    readings = good()
    marker = readings.marker_displacement.copy()
    marker[9] += 0.5
    spoiled = replace(readings, marker_displacement=marker)
    check_conventions(model("bearing"), spoiled)
    with pytest.raises(ConventionError, match="sign turned: elastocal"):
        check_conventions(model("bearing"), replace(spoiled, force=-spoiled.force))


def test_data_that_no_reading_explains_pass_with_what_stays_unexplained():
    rng = np.random.default_rng(0)
    readings = good()
    marker = readings.controller_displacement + rng.normal(0.0, 1e-3, readings.force.shape)
    assert check_conventions(model("bearing"), replace(readings, marker_displacement=marker)) > 0.7


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_mistakes_of_a_six_axis_arm_are_not_tried_on_a_small_one(joints):
    rng = np.random.default_rng(0)
    arm = Robot.from_urdf(planar_arm_urdf((1.0, 0.7, 0.2)[:joints]), "tcp")
    elastic = ElasticModel(arm, layout(arm, "actuated"))
    q, force = rng.uniform(-1.5, 1.5, (20, joints)), rng.normal(0.0, 500.0, (20, 3))
    noise = rng.normal(0.0, 1e-5, (20, 3))
    readings = Readings(
        pose=np.arange(20),
        load_case=np.array(["normal"] * 20),
        joint_position=q,
        force=force,
        controller_displacement=noise,
        marker_displacement=elastic.deflection(np.full(joints, 1e-6), q, force),
    )
    assert check_conventions(elastic, readings) < 0.1
    with pytest.raises(ConventionError, match="sign turned"):
        check_conventions(elastic, replace(readings, force=-force))


def test_deflections_of_zero_are_refused():
    readings = good()
    still = replace(readings, marker_displacement=readings.controller_displacement)
    with pytest.raises(IdentificationError, match="deflections are zero"):
        check_conventions(model("bearing"), still)
