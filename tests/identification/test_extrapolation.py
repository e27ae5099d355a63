"""Beyond the torques of their calibration gears are known to a fifth, within them as fitted."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, Gear, actuated
from elastocal.identification import CalibratedModel, CalibrationDomain, Observability
from elastocal.robot import T_from_xyzabc
from elastocal.sim.arm import press_poses
from support.cells import linkage, robot

KNEE, HARD, SOFT = 700.0, 2e-7, 3e-7
SEEN = Observability(1, 1.0, (True,), ())


def geared() -> ElasticModel:
    """Return the arm with a gear for its second joint alone."""
    second = actuated(robot())[1]
    gear = Gear(second.name, second.joint, second.axes[0].axis, knees=(KNEE,))
    return ElasticModel(robot(), (gear,))


def calibrated(model: ElasticModel, q: np.ndarray, force: np.ndarray) -> CalibratedModel:
    load = model.load_torques(q, force)
    joints = np.zeros(q.shape[1])
    domain = CalibrationDomain(
        q, force, None, joints, joints + np.abs(load).max(), np.arange(len(q))
    )
    c = np.array([HARD, SOFT][: len(model.parameters)])
    return CalibratedModel(model, c, np.tile(c, (60, 1)), SEEN, domain=domain)


@pytest.fixture(scope="module")
def presses() -> tuple[np.ndarray, np.ndarray]:
    q = press_poses(linkage(), 12, np.random.default_rng(4)).joints
    return q, np.tile([0.0, 0.0, 900.0], (len(q), 1))


def test_within_the_calibrated_torques_the_interval_is_that_of_the_draws(presses):
    q, force = presses
    found = calibrated(geared(), q, force).predict(q, 0.5 * force)
    np.testing.assert_allclose(found.low, found.deflection, atol=1e-15)
    np.testing.assert_allclose(found.high, found.deflection, atol=1e-15)


@pytest.mark.parametrize("part", [-1.5, 1.6])
def test_beyond_them_a_gear_is_off_by_a_fifth_of_what_it_turns_there(presses, part):
    q, force = presses
    model = geared()
    found = calibrated(model, q, force).predict(q, part * force)
    # By small steps along the way of the torque, at each of which it is within or beyond.
    weight, load = model.weight_torques(q)[:, 0], model.load_torques(q, force)[:, 0]
    met = np.concatenate([weight, weight + load])
    way = np.linspace(weight, weight + part * load, 20001)
    step = np.abs(part * load) / 20000.0
    beyond = ((way > met.max()) | (way < met.min())).sum(axis=0) * step
    end = np.clip(weight + part * load, met.min(), met.max())
    turned = 0.225 * (HARD + SOFT / (1.0 + (end / KNEE) ** 2)) * beyond
    assert np.any(beyond > 100.0)
    lever = model.spring_jacobian(q).translation[..., 0]
    expected = np.abs(lever) * turned[:, None]
    np.testing.assert_allclose(found.high - found.deflection, expected, rtol=1e-2, atol=1e-7)
    np.testing.assert_allclose(found.deflection - found.low, expected, rtol=1e-2, atol=1e-7)


def test_a_longer_tool_is_held_against_the_torques_of_the_calibrated_one(presses):
    q, _ = presses
    aside = np.tile([900.0, 0.0, 0.0], (len(q), 1))
    found = calibrated(geared(), q, aside)
    longer = found.with_tool(T_from_xyzabc(0.0, 0.0, 0.5, 0.0, 0.0, 0.0))
    as_calibrated, with_longer = found.predict(q, aside), longer.predict(q, aside)
    np.testing.assert_allclose(as_calibrated.high, as_calibrated.deflection, atol=1e-15)
    assert np.max(with_longer.high - with_longer.deflection) > 1e-5


def test_springs_of_one_stiffness_have_no_such_doubt(presses):
    q, force = presses
    linear = ElasticModel(robot(), actuated(robot())[1:2])
    found = calibrated(linear, q, force).predict(q, -force)
    np.testing.assert_allclose(found.high, found.deflection, atol=1e-15)


def test_where_the_calibration_is_not_known_nothing_is_added(presses):
    q, force = presses
    found = replace(calibrated(geared(), q, force), domain=None).predict(q, -force)
    np.testing.assert_allclose(found.high, found.deflection, atol=1e-15)
