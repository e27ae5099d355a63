import numpy as np
import pytest

from elastocal.sim.workcell._timeline import SettlingRamp, Trapezoid, Uniform, joint_move

LAWS = [Uniform(2.0), Trapezoid(3.0, 0.5), Trapezoid(1.0, 0.5), SettlingRamp(1.5, 0.1)]


@pytest.mark.parametrize("law", [*LAWS, SettlingRamp(0.0, 0.1)], ids=repr)
def test_progress_goes_from_0_to_1_and_never_back(law):
    progress = law.at(np.linspace(-0.5, law.duration + 0.5, 2000))
    assert progress[0] == 0.0
    assert progress[-1] == 1.0
    assert np.all(np.diff(progress) >= 0.0)
    assert law.at(law.duration) == 1.0


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_progress_has_no_jump(law):
    progress = law.at(np.linspace(0.0, law.duration, 20001))
    assert np.abs(np.diff(progress)).max() < 3e-4


def test_a_settling_ramp_is_never_faster_than_its_ramp():
    law = SettlingRamp(1.5, 0.12)
    time = np.linspace(0.0, law.duration - 1e-6, 5000)
    assert np.diff(law.at(time)).max() <= np.diff(time)[0] / 1.5 * (1 + 1e-9)


def test_a_settling_ramp_lags_behind_by_its_time_constant():
    law = SettlingRamp(2.0, 0.1)
    assert law.at(1.5) == pytest.approx((1.5 - 0.1) / 2.0, rel=1e-4)
    assert 1.0 - law.at(2.3) == pytest.approx(0.05 * np.exp(-3.0), rel=1e-3)


def test_the_slowest_joint_decides_and_keeps_its_speed():
    law = joint_move(np.array([1.0, 0.2]), np.array([0.5, 2.0]), 0.5)
    assert law.duration == pytest.approx(2.5)
    time = np.linspace(0.0, 2.5, 5001)
    assert np.diff(law.at(time)).max() / np.diff(time)[0] == pytest.approx(0.5, rel=1e-3)


def test_no_way_takes_no_time():
    assert joint_move(np.zeros(3), np.ones(3), 0.5).duration == 0.0
    assert joint_move(np.zeros(3), np.ones(3), 0.5).at(0.0) == 1.0
