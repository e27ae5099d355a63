import numpy as np
import pytest

from elastocal.sim.workcell._contact import Contact, ContactLaw

LAW = ContactLaw(4e6, 1.5e6, 2.5e7, 0.5, 8e-6)
R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
NORMAL = -R[:, 2]


def contact():
    return Contact(LAW, np.array([1.0, 2.0, 3.0]), R, NORMAL, np.zeros(6), np.zeros(4))


def moved_tcp(force_tcp):
    force_base = R @ np.array(force_tcp, dtype=float)
    return R.T @ (contact().tool_position(force_base) - contact().anchor)


def test_pressing_sinks_in_by_disk_and_tooling():
    moved = moved_tcp((0, 0, -1000))
    np.testing.assert_allclose(moved, (0, 0, 1000 / 4e6 + 1000 / 2.5e7), atol=1e-15)


def test_the_tool_goes_against_the_force_on_it():
    moved = moved_tcp((200, 0, -1000))
    assert moved[0] < 0.0
    np.testing.assert_allclose(moved_tcp((-200, 0, -1000))[0], -moved[0], rtol=1e-12)


def test_a_small_lateral_force_meets_the_shear_stiffness():
    shear = LAW.shear(np.array([1.0, 0.0, -1000.0]))
    assert shear[0] == pytest.approx(-1.0 / 1.5e6, rel=1e-3)


def test_the_contact_softens_sideways_towards_the_friction_limit():
    forces = np.linspace(10, 499, 40)
    shear = [-LAW.shear(np.array([f, 0.0, -1000.0]))[0] / f for f in forces]
    assert np.all(np.diff(shear) > 0.0)
    assert shear[-1] / shear[0] == pytest.approx(1.5, rel=0.05)


@pytest.mark.parametrize(("lateral", "held"), [(400.0, 400.0), (800.0, 499.5)])
def test_friction_holds_no_more_than_coulombs_limit(lateral, held):
    force = LAW.held(np.array([0.0, lateral, -1000.0]))
    np.testing.assert_allclose(force, (0.0, held, -1000.0))


def test_a_contact_that_does_not_press_holds_nothing_sideways():
    assert LAW.effort(np.array([1.0, 0.0, 0.0])) == np.inf
    assert LAW.effort(np.zeros(3)) == 0.0


def test_random_slip_grows_towards_the_limit():
    sigma = [LAW.slip_sigma(np.array([f, 0.0, -1000.0])) for f in (0.0, 250.0, 450.0, 900.0)]
    assert sigma[0] == 0.0
    assert sigma[1] == pytest.approx(8e-6)
    assert sigma[2] > 5 * sigma[1]
    assert np.isfinite(sigma[3])


def test_a_slip_moves_the_anchor_along_the_surface():
    slipped = contact().slipped(np.array([1e-3, -2e-3]))
    np.testing.assert_allclose(R.T @ (slipped.anchor - contact().anchor), (1e-3, -2e-3, 0))
