"""The suite that every check of a calibration pose passes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.cell import load_cell, write_example
from elastocal.cell.examples import EXAMPLES
from elastocal.planning import CollisionScene, cell_surface
from elastocal.planning.checks import (
    CollisionCheck,
    EdgeCheck,
    FlatnessCheck,
    FrictionCheck,
    JointLimitsCheck,
    MovingSolids,
    SensorCheck,
    SightCheck,
    SingularityCheck,
    Station,
    TorqueCheck,
    TravelLimitsCheck,
    WristCheck,
    check_margins,
)
from elastocal.planning.pool import CHECKS, POINT_CHECKS, point_checks, robot_checks
from elastocal.planning.surface import DiskFit, sample_uniform
from elastocal.robot import Rail, Robot, on_rail
from elastocal.shapes import Body, Box
from elastocal.testing import CheckSuite
from support.postures import FORCE_TCP, arm, postures

OWN_JOINTS = ("travel_limits",)
"""Checks that judge what the arm without a rail has not."""


def scene(robot: Robot) -> CollisionScene:
    tool = Body("tool", Box(0.2, 0.2, 0.2), np.eye(4))
    away = np.eye(4)
    away[:3, 3] = (0.0, 3.0, 0.5)
    return CollisionScene(robot, (tool,), (Body("post", Box(0.2, 0.2, 1.0), away),))


@cache
def railed() -> Robot:
    return Robot.from_urdf(on_rail(arm().urdf, Rail("rail", (0.0, 1.0, 0.0), -1.0, 1.0)), "tcp")


def on_the_rail(rail):
    """Return the postures of the arm with the rail where it is put."""
    here = np.broadcast_to(rail, len(postures()))[:, None]
    return replace(
        postures(),
        q=np.hstack([here, postures().q]),
        q_approach=np.hstack([here, postures().q_approach]),
    )


def posed(check):
    """Return postures of the check's own robot: that on the rail stands all along it."""
    if check.name not in OWN_JOINTS:
        return postures()
    return on_the_rail(np.linspace(-0.9, 0.9, len(postures())))


def every_check(robot=None):
    """Return one of every check, of the arm or of a robot that carries it."""
    robot = robot or arm()
    count = len(postures())
    fit = DiskFit(np.linspace(0.0, 0.1, count), np.zeros(count))
    T_sensor_tcp = np.eye(4)
    T_sensor_tcp[2, 3] = 0.3
    torques = np.where(np.arange(len(robot.joint_names)) < robot.external_axes, np.nan, 9000.0)
    marker = np.array([0.0, 0.1, -0.1])
    return [
        JointLimitsCheck(robot, 0.05),
        TravelLimitsCheck(railed(), 0.0),
        SingularityCheck(robot, 0.05),
        WristCheck(robot, 0.1),
        FrictionCheck(FORCE_TCP, 0.5, 1.5),
        TorqueCheck(robot, FORCE_TCP, torques, 60.0, np.array([0.0, 0.0, -0.2])),
        SensorCheck(FORCE_TCP, T_sensor_tcp, np.full(3, 1500.0), np.full(3, 240.0)),
        EdgeCheck(np.linspace(0.0, 0.3, count), 0.03, 0.005),
        FlatnessCheck(fit, 0.05),
        CollisionCheck(scene(robot), 0.02, 0.1, 0.003),
        SightCheck(
            (Station("north", (3.0, 2.0, 2.0), 1.0, 10.0),),
            marker,
            np.array([0.0, 0.0, -1.0]),
            1.0,
            moving=MovingSolids(CollisionScene(robot, (), ()), marker),
        ),
    ]


@pytest.mark.parametrize("check", every_check(), ids=lambda check: check.name)
class TestEveryCheck(CheckSuite):
    @pytest.fixture
    def postures(self, check):
        return posed(check)


class TestACheckOfThePosturesThatTheSuiteMakesUp(CheckSuite):
    @pytest.fixture
    def check(self, robot):
        return WristCheck(robot, 0.1)


@pytest.mark.parametrize("number", range(len(every_check())))
def test_a_check_does_not_notice_a_rail_before_the_arm(number):
    alone, carried = every_check()[number], every_check(railed())[number]
    if alone.name in OWN_JOINTS:
        pytest.skip("judges the rail itself")
    # The length that scales the Jacobian is a mean over seeded configurations: others with a rail.
    rtol = 1e-3 if alone.name == "singularity" else 0.0
    margin = carried.margin(on_the_rail(0.0))
    np.testing.assert_allclose(margin, alone.margin(postures()), rtol=rtol, atol=1e-9)


def test_the_suite_holds_every_check_that_is_registered():
    assert {type(check) for check in every_check()} == {*CHECKS.values(), *POINT_CHECKS}


@pytest.mark.parametrize("like", EXAMPLES)
def test_every_check_of_the_examples_is_in_the_suite(like, tmp_path):
    write_example(tmp_path, like)
    cell = load_cell(tmp_path / "cell.yaml")
    surface = cell_surface(cell)
    points = sample_uniform(surface, 3, np.random.default_rng(0))
    made = (*point_checks(cell, surface, points), *robot_checks(cell, surface).all)
    assert {check.name for check in made} <= {check.name for check in every_check()}


def test_checks_are_asked_in_the_order_of_the_registry():
    kinds = sorted(CHECKS.values(), key=lambda kind: kind.order)
    assert len({kind.order for kind in kinds}) == len(kinds)
    assert [kind.slow for kind in kinds] == sorted(kind.slow for kind in kinds)


def test_a_cell_makes_the_checks_that_it_has_numbers_for(tmp_path):
    write_example(tmp_path, "machining")
    cell = load_cell(tmp_path / "cell.yaml")
    surface = cell_surface(cell)
    blind = replace(cell, file=cell.file.model_copy(update={"trackers": (), "sensor": None}))
    names = [check.name for check in robot_checks(blind, surface).all]
    assert "joint_limits" in names
    assert not {"travel_limits", "sensor", "sight"} & set(names)


def test_margins_say_which_postures_pass_every_check():
    checks = [check for check in every_check() if check.name != "travel_limits"]
    found = check_margins(checks, postures())
    assert np.array_equal(found.passed, np.all(found.margin > 0.0, axis=0))
    assert len(set(found.names)) == len(found.names)
    assert found.take([3, 1]).margin.shape == (len(found.names), 2)


def test_a_margin_that_is_not_a_number_does_not_pass():
    class Unsure(FrictionCheck):
        def margin(self, postures):
            return np.full(len(postures), np.nan)

    found = check_margins([Unsure(FORCE_TCP, 0.5, 1.0)], postures())
    assert not np.any(found.passed)
