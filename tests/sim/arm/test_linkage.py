import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import Robot
from elastocal.sim.arm import (
    Linkage,
)


def random_joints(linkage, seed=1, count=20):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, len(linkage.joint_names)))


@pytest.mark.parametrize(("name", "base"), [("linkage", None), ("mixed", "base")])
def test_forward_kinematics_agrees_with_pinocchio(name, base, request):
    linkage = request.getfixturevalue(name)
    robot = Robot.from_urdf(linkage.urdf, linkage.tip, base)
    q = random_joints(linkage)
    assert linkage.joint_names == robot.joint_names
    np.testing.assert_allclose(linkage.forward(q), robot.forward(q), atol=1e-13)


@pytest.mark.parametrize("name", ["linkage", "mixed"])
def test_jacobian_is_the_derivative_of_the_tip_position(name, request):
    linkage = request.getfixturevalue(name)
    q, h = random_joints(linkage), 1e-6
    J = linkage.jacobian(q)
    for k in range(q.shape[1]):
        step = h * np.eye(q.shape[1])[k]
        ahead, behind = linkage.forward(q + step), linkage.forward(q - step)
        linear = (ahead - behind)[:, :3, 3] / (2 * h)
        np.testing.assert_allclose(J[:, :3, k], linear, atol=1e-8)
        spin = ahead[:, :3, :3] @ behind[:, :3, :3].transpose(0, 2, 1) / (2 * h)
        angular = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        skew = np.stack([spin[:, 1, 2], spin[:, 2, 0], spin[:, 0, 1]], axis=1)
        np.testing.assert_allclose(J[:, 3:, k], 0.5 * (angular - skew), atol=1e-8)


def test_masses_are_those_of_the_moving_links(linkage, mixed):
    assert sum(mass.mass for mass in linkage.masses) == 865.0
    assert sum(mass.mass for mass in mixed.masses) == 75.0
    assert [mass.joint for mass in linkage.masses] == [1, 2, 3, 4, 5, 6, 6]


def test_gravity_torque_of_the_point_masses_agrees_with_pinocchio(linkage):
    masses = sum(m.mass * (m.centre[0] - 0.33) for m in linkage.masses if m.joint >= 2)
    robot = Robot.from_urdf(linkage.urdf, linkage.tip)
    assert -masses * 9.80665 == pytest.approx(robot.gravity_torques(np.zeros(6))[1])


def test_limits_are_read(mixed, linkage):
    np.testing.assert_array_equal(linkage.upper, [3.5, 3.5, 3.5, 6.1, 2.1, 6.1])
    assert mixed.lower[1] == -np.inf


@pytest.mark.parametrize(("tip", "base"), [("tpc", None), ("tcp", "bse"), ("base", None)])
def test_a_chain_that_is_not_there_is_refused(linkage, tip, base):
    with pytest.raises(RobotError, match="no chain from base link"):
        Linkage.from_urdf(linkage.urdf, tip, base)


def test_text_that_is_not_xml_is_refused():
    with pytest.raises(RobotError, match="not valid XML"):
        Linkage.from_urdf("<robot", "tcp")


def test_a_planar_joint_is_refused(linkage):
    text = linkage.urdf.replace('name="a3" type="revolute"', 'name="a3" type="planar"')
    with pytest.raises(RobotError, match="'a3' is planar"):
        Linkage.from_urdf(text, "tcp")


def test_an_axis_of_no_length_is_refused(linkage):
    text = linkage.urdf.replace("0 0 -1", "0 0 0")
    with pytest.raises(RobotError, match="'a1' has axis"):
        Linkage.from_urdf(text, "tcp")
