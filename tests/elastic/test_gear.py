"""What friction does to a gear: it lags, and takes energy."""

import numpy as np
import pytest

from elastocal.elastic import Gear, SpringLoad
from elastocal.elastic.model import FrictionElements
from elastocal.errors import SpringError

GEAR = Gear("a.gear", "a", (0.0, 0.0, 1.0), knees=(400.0,), slips=(50.0, 150.0))
C = np.array([2e-7, 3e-7, 1e-7, 4e-7])
"""Hard, soft, and two friction elements, in rad/(N·m)."""


def loop(amplitude: float, weight: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return torque and angle over one closed swing of the torque, behind a first one."""
    torque = amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, 4001))[:, None]
    states = FrictionElements.of([GEAR]).path(torque)
    load = SpringLoad(
        (torque[:, 0],), (np.full(len(torque), weight),), (states[:, 0], states[:, 1])
    )
    angle = np.transpose(GEAR.angles(load)[0]) @ C
    return torque[2000:, 0], angle[2000:]


@pytest.mark.parametrize("weight", [0.0, 900.0])
@pytest.mark.parametrize("amplitude", [60.0, 400.0, 3000.0])
def test_a_closed_swing_takes_energy(amplitude, weight):
    torque, angle = loop(amplitude, weight)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))
    assert work > 1e-9 * amplitude


def test_a_swing_below_every_limit_takes_none():
    torque, angle = loop(49.0)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))
    assert work == pytest.approx(0.0, abs=1e-15)


def test_lost_motion_is_the_angle_between_the_two_ways_through_zero_torque():
    torque, angle = loop(1000.0)
    rising, falling = angle[0], angle[1000]
    assert torque[[0, 1000]] == pytest.approx([0.0, 0.0], abs=1e-9)
    (stated,) = (each for each in GEAR.characteristics if each.name == "a.gear lost motion")
    assert falling - rising == pytest.approx(np.dot(stated.weights, C), rel=1e-9)
    assert np.dot(stated.weights, C) == pytest.approx(2.0 * (50.0 * C[2] + 150.0 * C[3]))


def test_makers_stiffnesses_are_the_slope_without_torque_and_at_the_middle_knee():
    gear = Gear("a.gear", "a", (0.0, 0.0, 1.0), knees=(100.0, 400.0, 1500.0))
    c = np.array([2e-7, 3e-7, 1e-7, 4e-7])
    at_rest, at_knee = gear.characteristics
    assert (at_rest.name, at_knee.name) == ("a.gear", "a.gear at 400 N·m")
    for stated, torque in ((at_rest, 0.0), (at_knee, 400.0)):
        ahead, behind = (
            np.array(gear.angles(SpringLoad((np.array(torque + by),)))[0]) for by in (0.1, -0.1)
        )
        assert np.dot(stated.weights, c) == pytest.approx((ahead - behind) @ c / 0.2, rel=1e-6)


@pytest.mark.parametrize(
    ("torques", "message"),
    [
        ({"knees": (300.0, 1e300)}, "a knee of gear 'a.gear' is 1e.300 N.m: the largest moment"),
        ({"knees": (0.0,)}, "a knee of gear 'a.gear' is 0 N.m: it must be above 0"),
        ({"slips": (-5.0,)}, "a slip of gear 'a.gear' is -5 N.m: it must be above 0"),
    ],
)
def test_torques_that_no_gear_bears_are_refused(torques, message):
    with pytest.raises(SpringError, match=message):
        Gear("a.gear", "a", (0.0, 0.0, 1.0), **torques)
