import subprocess
import sys

import numpy as np
import pytest

from elastocal.errors import RobotError, SpringError
from elastocal.sim.arm import (
    Linear,
    Linkage,
    TruthSpring,
    bearing_truth,
    with_link_bending,
    with_stiffening_gears,
)
from elastocal.sim.arm.elastic_arm import GRAVITY, ElasticArm
from elastocal.sim.arm.gears import StiffeningGear
from elastocal.sim.arm.statics import EquilibriumError

LENGTH = 2.0
K = 1000.0
BEAM = (
    '<robot name="beam"><link name="base"/><link name="beam"><inertial><origin xyz="1 0 0"/>'
    '<mass value="12"/></inertial></link><link name="tip"/>'
    '<joint name="hinge" type="continuous"><parent link="base"/><child link="beam"/>'
    '<axis xyz="0 0 1"/></joint>'
    '<joint name="end" type="fixed"><parent link="beam"/><child link="tip"/>'
    f'<origin xyz="{LENGTH} 0 0"/></joint></robot>'
)


def beam(springs=None, **options):
    hinge = TruthSpring("hinge", (0.0, 0.0, 1.0), Linear(K))
    return ElasticArm(Linkage.from_urdf(BEAM, "tip"), springs or (hinge,), **options)


def spring_jacobian(arm, q, h=1e-6):
    """Return d tcp / d theta of the undeformed arm by finite differences, (..., 3, spring)."""
    steps = h * np.eye(len(arm.springs))
    at = [
        arm.tcp_position(q, np.broadcast_to(s, (*q.shape[:-1], len(s))))
        - arm.tcp_position(q, np.broadcast_to(-s, (*q.shape[:-1], len(s))))
        for s in steps
    ]
    return np.stack(at, axis=-1) / (2 * h)


class TestHingedBeam:
    """One hinge has a closed-form balance: k theta = F L cos(theta)."""

    def test_a_cross_force_turns_it_until_the_torques_balance(self):
        rest = beam().equilibrium([0.0], [0.0, 300.0, 0.0])
        assert K * rest.theta[0] == pytest.approx(300.0 * LENGTH * np.cos(rest.theta[0]), rel=1e-9)
        assert 0.4 < rest.theta[0] < 0.6

    def test_deflection_follows_the_arc_not_its_tangent(self):
        rest = beam().equilibrium([0.0], [0.0, 300.0, 0.0])
        angle = rest.theta[0]
        arc = LENGTH * np.array([np.cos(angle) - 1.0, np.sin(angle), 0.0])
        np.testing.assert_allclose(rest.deflection, arc, atol=1e-12)
        np.testing.assert_allclose(rest.tcp_position, arc + np.array([LENGTH, 0, 0]), atol=1e-12)

    def test_a_pull_stiffens_it(self):
        free = beam().equilibrium([0.0], [0.0, 10.0, 0.0]).theta[0]
        pulled = beam().equilibrium([0.0], [500.0, 10.0, 0.0]).theta[0]
        assert pulled == pytest.approx(free * K / (K + 500.0 * LENGTH), rel=1e-3)

    def test_it_buckles_under_a_push_beyond_k_over_length(self):
        beam().equilibrium([0.0], [-0.99 * K / LENGTH, 0.0, 0.0])
        with pytest.raises(EquilibriumError, match="unstable"):
            beam().equilibrium([0.0], [-1.01 * K / LENGTH, 0.0, 0.0])

    def test_a_crooked_push_leads_to_the_buckled_shape(self):
        rest = beam().equilibrium([0.0], [-800.0, 5.0, 0.0])
        angle = rest.theta[0]
        torque = LENGTH * (5.0 * np.cos(angle) + 800.0 * np.sin(angle))
        assert K * angle == pytest.approx(torque, rel=1e-9)
        assert angle > 1.0

    def test_its_weight_sags_it_before_it_is_loaded(self):
        sagging = beam(gravity=(0.0, -9.81, 0.0)).equilibrium([0.0], [0.0, 0.0, 0.0])
        angle = sagging.theta[0]
        assert K * angle == pytest.approx(-12 * 9.81 * 1.0 * np.cos(angle), rel=1e-9)
        np.testing.assert_allclose(sagging.deflection, 0.0, atol=1e-12)

    def test_a_slide_gives_by_force_over_stiffness(self):
        slide = TruthSpring("hinge", (0.0, 2.0, 0.0), Linear(4e5), revolute=False, distal=True)
        rest = beam((slide,)).equilibrium([np.pi / 2], [70.0, 0.0, 0.0])
        np.testing.assert_allclose(rest.deflection, [70.0 / 4e5, 0.0, 0.0], atol=1e-15)

    def test_a_hinge_within_the_link_has_the_shorter_lever(self):
        flexure = TruthSpring(
            "hinge", (0.0, 0.0, 1.0), Linear(K), distal=True, at=(0.75 * LENGTH, 0.0, 0.0)
        )
        rest = beam((flexure,)).equilibrium([0.0], [0.0, 1.0, 0.0])
        assert rest.deflection[1] == pytest.approx((0.25 * LENGTH) ** 2 / K, rel=1e-5)


@pytest.fixture(
    params=["bearing", "everything"],
)
def arm(request, linkage):
    if request.param == "bearing":
        return bearing_truth(linkage)
    arm = with_link_bending(bearing_truth(linkage, gravity=GRAVITY), {"a2": 9e6, "a3": 9e6})
    return with_stiffening_gears(arm)


def test_every_torque_balances_at_equilibrium(arm, poses, forces):
    rest = arm.equilibrium(poses.joints[:, None], forces)
    assert rest.imbalance.shape == forces.shape[:2]
    assert rest.imbalance.max() < 1e-7


def test_spring_torques_are_those_of_the_force_on_the_deformed_arm(linkage, poses, forces):
    arm = bearing_truth(linkage)
    q, force, h = poses.joints, forces[:, 1], 1e-6
    theta = arm.equilibrium(q, force).theta
    for k, spring in enumerate(arm.springs):
        step = h * np.eye(len(arm.springs))[k]
        moved = arm.tcp_position(q, theta + step) - arm.tcp_position(q, theta - step)
        power = np.sum(moved * force, axis=1) / (2 * h)
        np.testing.assert_allclose(spring.law.evaluate(theta[:, k])[1], power, atol=1e-5)


def test_small_loads_are_answered_by_the_compliance_of_the_undeformed_arm(linkage, poses, forces):
    arm = bearing_truth(linkage)
    J = spring_jacobian(arm, poses.joints)
    c = np.array([1.0 / spring.law.k for spring in arm.springs])
    force = 1e-3 * forces[:, 2]
    expected = np.einsum("pis,s,pjs,pj->pi", J, c, J, force)
    actual = arm.equilibrium(poses.joints, force).deflection
    np.testing.assert_allclose(actual, expected, atol=1e-5 * np.abs(expected).max())


def test_full_loads_are_not(linkage, poses, forces):
    arm = bearing_truth(linkage)
    small = arm.equilibrium(poses.joints, 1e-3 * forces[:, 2]).deflection * 1e3
    full = arm.equilibrium(poses.joints, forces[:, 2]).deflection
    error = np.linalg.norm(full - small, axis=1) / np.linalg.norm(full, axis=1)
    assert 1e-5 < error.max() < 1e-2


def test_small_loads_obey_maxwell_and_betti(arm, poses):
    """The two signs of a load cancel what is even in it: gears that gravity has pre-stressed."""
    q = poses.joints

    def answer(force):
        return 0.5 * (arm.equilibrium(q, force).deflection - arm.equilibrium(q, -force).deflection)

    first, second = np.random.default_rng(2).standard_normal((2, len(q), 3))
    by_first, by_second = answer(first), answer(second)
    work = np.sum(second * by_first, axis=1), np.sum(first * by_second, axis=1)
    np.testing.assert_allclose(*work, rtol=0, atol=1e-6 * np.abs(by_first).max())


def test_a_batch_gives_what_its_members_give(arm, poses, forces):
    together = arm.equilibrium(poses.joints[:, None], forces)
    alone = arm.equilibrium(poses.joints[3], forces[3, 4])
    assert alone.deflection.shape == (3,)
    np.testing.assert_allclose(together.deflection[3, 4], alone.deflection, atol=1e-12)
    np.testing.assert_allclose(together.tcp_position[3, 4], alone.tcp_position, atol=1e-12)


def test_no_force_means_no_deflection(arm, poses):
    rest = arm.equilibrium(poses.joints, np.zeros(3))
    np.testing.assert_allclose(rest.deflection, 0.0, atol=1e-12)


def test_gravity_couples_weakly_with_the_load(linkage, poses, forces):
    light = bearing_truth(linkage).equilibrium(poses.joints, forces[:, 0]).deflection
    heavy = bearing_truth(linkage, gravity=GRAVITY).equilibrium(poses.joints, forces[:, 0])
    difference = np.linalg.norm(heavy.deflection - light, axis=1).max()
    assert 1e-7 < difference < 5e-5


def test_gravity_sags_the_arm_downwards_by_the_order_of_the_load(linkage, poses):
    arm = bearing_truth(linkage, gravity=GRAVITY)
    sag = arm.equilibrium(poses.joints, np.zeros(3)).tcp_position
    sag = sag - linkage.forward(poses.joints)[:, :3, 3]
    assert np.all((sag[:, 2] < -5e-4) & (sag[:, 2] > -2e-2))


def test_springs_are_kept_from_base_to_tip(linkage):
    distal = TruthSpring("a2", (1.0, 0.0, 0.0), Linear(1e6), distal=True)
    proximal = TruthSpring("a2", (0.0, 1.0, 0.0), StiffeningGear(1e6, 0.3, 1e-3))
    first = TruthSpring("a1", (0.0, 0.0, 1.0), Linear(1e6))
    assert ElasticArm(linkage, (distal, proximal, first)).springs == (first, proximal, distal)


def test_a_spring_at_an_unknown_joint_is_refused(linkage):
    with pytest.raises(SpringError, match=r"unknown joint 'a7'.*joints: a1, a2"):
        ElasticArm(linkage, (TruthSpring("a7", (0.0, 0.0, 1.0), Linear(1.0)),))


def test_a_spring_without_direction_is_refused(linkage):
    with pytest.raises(SpringError, match="no direction"):
        ElasticArm(linkage, (TruthSpring("a1", (0.0, 0.0, 0.0), Linear(1.0)),))


def test_an_arm_without_springs_is_refused(linkage):
    with pytest.raises(SpringError, match="at least one spring"):
        ElasticArm(linkage, ())


@pytest.mark.parametrize(
    ("q", "force", "message"),
    [
        (np.zeros(5), np.zeros(3), "last axis must be 6"),
        (np.zeros(6), np.zeros(2), "last axis must be 3"),
        (np.zeros(6), [0.0, np.nan, 0.0], "must be finite"),
    ],
)
def test_what_does_not_fit_is_refused(linkage, q, force, message):
    with pytest.raises(RobotError, match=message):
        bearing_truth(linkage).equilibrium(q, force)


def test_the_truth_runs_without_pinocchio():
    code = "import sys, elastocal.sim.arm.elastic_arm; sys.exit('pinocchio' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
