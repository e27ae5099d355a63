"""The suite that every check of a calibration pose passes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from elastocal.planning import CollisionScene
from elastocal.planning.checks import (
    CollisionCheck,
    EdgeCheck,
    FlatnessCheck,
    FrictionCheck,
    JointLimitsCheck,
    SensorCheck,
    SightCheck,
    SingularityCheck,
    Station,
    TorqueCheck,
    TravelLimitsCheck,
    WristCheck,
    verdicts,
)
from elastocal.planning.surface import DiskFit
from elastocal.robot import Rail, Robot, on_rail
from elastocal.shapes import Body, Box
from support.postures import FORCE_TCP, arm, postures


def scene() -> CollisionScene:
    tool = Body("tool", Box(0.2, 0.2, 0.2), np.eye(4))
    away = np.eye(4)
    away[:3, 3] = (0.0, 3.0, 0.5)
    return CollisionScene(arm(), (tool,), (Body("post", Box(0.2, 0.2, 1.0), away),))


@cache
def railed() -> Robot:
    return Robot.from_urdf(on_rail(arm().urdf, Rail("rail", (0.0, 1.0, 0.0), -1.0, 1.0)), "tcp")


def posed(check):
    """Return postures of the check's own robot: that on the rail stands all along it."""
    if not isinstance(check, TravelLimitsCheck):
        return postures()
    rail = np.linspace(-0.9, 0.9, len(postures()))[:, None]
    return replace(
        postures(),
        q=np.hstack([rail, postures().q]),
        q_approach=np.hstack([rail, postures().q_approach]),
    )


def every_check():
    count = len(postures())
    fit = DiskFit(np.linspace(0.0, 0.1, count), np.zeros(count))
    T_sensor_tcp = np.eye(4)
    T_sensor_tcp[2, 3] = 0.3
    return [
        JointLimitsCheck(arm(), 0.05),
        TravelLimitsCheck(railed(), 0.0),
        SingularityCheck(arm(), 0.05),
        WristCheck(arm(), 0.1),
        FrictionCheck(FORCE_TCP, 0.5, 1.5),
        TorqueCheck(arm(), FORCE_TCP, np.full(6, 9000.0), 60.0, np.array([0.0, 0.0, -0.2])),
        SensorCheck(FORCE_TCP, T_sensor_tcp, np.full(3, 1500.0), np.full(3, 240.0)),
        EdgeCheck(np.linspace(0.0, 0.3, count), 0.03, 0.005),
        FlatnessCheck(fit, 0.05),
        CollisionCheck(scene(), 0.02, 0.1, 0.003),
        SightCheck(
            (Station("north", (3.0, 2.0, 2.0), 1.0, 10.0),),
            np.array([0.0, 0.1, -0.1]),
            np.array([0.0, 0.0, -1.0]),
            1.0,
        ),
    ]


@pytest.mark.parametrize("check", every_check(), ids=lambda check: check.name)
class TestEveryCheck:
    def test_gives_one_finite_margin_a_posture(self, check):
        margin = check.margin(posed(check))
        assert margin.shape == (len(postures()),)
        assert np.all(np.isfinite(margin))

    def test_judges_each_posture_by_itself(self, check):
        chosen = np.array([7, 3, 11])
        alone = check.margin(posed(check).take(chosen))
        np.testing.assert_allclose(alone, check.margin(posed(check))[chosen], atol=1e-9)

    def test_has_a_name_a_unit_and_advice(self, check):
        assert check.name.isidentifier()
        assert check.unit
        assert len(check.advice.split()) > 3

    def test_of_no_posture_is_empty(self, check):
        assert check.margin(posed(check).take([])).shape == (0,)


def test_verdicts_say_which_postures_pass_every_check():
    checks = [check for check in every_check() if check.name != "travel_limits"]
    found = verdicts(checks, postures())
    assert np.array_equal(found.passed, np.all(found.margin > 0.0, axis=0))
    assert len(set(found.names)) == len(found.names)
    assert found.take([3, 1]).margin.shape == (len(found.names), 2)


def test_a_margin_that_is_not_a_number_does_not_pass():
    class Unsure(FrictionCheck):
        def margin(self, postures):
            return np.full(len(postures), np.nan)

    found = verdicts([Unsure(FORCE_TCP, 0.5, 1.0)], postures())
    assert not np.any(found.passed)
