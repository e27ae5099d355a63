"""A KUKA-like 6R arm with masses and a tool, and one with every kind of joint."""

import numpy as np
import pytest

from elastocal.sim.arm import (
    Linkage,
    press_forces,
    press_poses,
)


def joint(name, parent, child, xyz, axis, kind="revolute", rpy="0 0 0", limits=(-3.5, 3.5)):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="9000" velocity="2"/></joint>'
    )


def link(name, mass=0.0, centre="0 0 0"):
    if not mass:
        return f'<link name="{name}"/>'
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
        '<inertia ixx="5" iyy="5" izz="5" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


ARM_URDF = (
    '<robot name="arm">'
    + link("base", 100.0)
    + link("l1", 260.0, "0.15 0 -0.1")
    + link("l2", 240.0, "0.5 0 0")
    + link("l3", 190.0, "0.15 0 0.05")
    + link("l4", 45.0, "0.35 0 0")
    + link("l5", 30.0, "0.05 0 0")
    + link("l6", 5.0)
    + link("tcp", 95.0, "0 0.05 -0.1")
    + joint("a1", "base", "l1", "0 0 0.645", "0 0 -1")
    + joint("a2", "l1", "l2", "0.33 0 0", "0 1 0")
    + joint("a3", "l2", "l3", "1.15 0 0", "0 1 0")
    + joint("a4", "l3", "l4", "1.22 0 -0.115", "-1 0 0", limits=(-6.1, 6.1))
    + joint("a5", "l4", "l5", "0 0 0", "0 1 0", limits=(-2.1, 2.1))
    + joint("a6", "l5", "l6", "0.215 0 0", "-1 0 0", limits=(-6.1, 6.1))
    + joint("tool", "l6", "tcp", "0.35 0 0.12", "1 0 0", "fixed", "0 1.5707963267948966 0")
    + "</robot>"
)

MIXED_URDF = (
    '<robot name="mixed">'
    + link("world")
    + link("base")
    + link("carriage", 40.0)
    + link("beam", 20.0, "0.4 0.1 0")
    + link("side", 3.0, "0 0.2 0")
    + link("slider", 10.0, "0.1 0 0.2")
    + link("hand", 2.0)
    + link("tip")
    + joint("floor", "world", "base", "5 1 2", "1 0 0", "fixed", "0.3 -0.4 0.5")
    + joint("rail", "base", "carriage", "0.1 0 0.4", "0 2 0", "prismatic", "0.1 0.2 0.3")
    + joint("swing", "carriage", "beam", "0 0.3 0.2", "1 2 -1", "continuous", "-0.7 0 1.1")
    + joint("branch", "beam", "side", "0.2 0 0", "0 0 1", "revolute")
    + joint("slide", "beam", "slider", "0.8 0 0", "0.6 0 0.8", "prismatic", "0 0.9 0")
    + joint("turn", "slider", "hand", "0.2 0.1 0", "0 0 1", "revolute", "1.2 0 -0.4")
    + joint("grip", "hand", "tip", "0.1 0.2 0.3", "1 0 0", "fixed", "0.5 0.6 0.7")
    + "</robot>"
)


@pytest.fixture(scope="session")
def linkage():
    return Linkage.from_urdf(ARM_URDF, "tcp")


@pytest.fixture(scope="session")
def mixed():
    return Linkage.from_urdf(MIXED_URDF, "tip", "base")


@pytest.fixture(scope="session")
def poses(linkage):
    return press_poses(linkage, 12, np.random.default_rng(5))


@pytest.fixture(scope="session")
def forces(poses):
    return press_forces(poses.T_base_tcp)
