"""What every spring layout keeps, on every kind of arm."""

import re
from functools import cache, partial

import numpy as np
import pytest

from elastocal.elastic import LAYOUTS, ElasticModel, Spring, layout
from elastocal.elastic.layouts import SpringEntry, bearing_joint, custom
from elastocal.elastic.springs.hinge import axial
from elastocal.errors import SpringError
from elastocal.robot import Robot
from elastocal.sim.arm import (
    Linkage,
)
from elastocal.testing import LayoutSuite
from support.virtual_chain import ARMS, configurations, numerical_column


def everything(robot: Robot) -> tuple[Spring, ...]:
    """Return what a spring file can ask for at the last joint, behind the axial springs."""
    entries = tuple(
        SpringEntry(joint=robot.joint_names[-1], axis=axis, kind=kind, frame=frame, offset=offset)
        for axis in ("x", (1.0, -2.0, 0.5))
        for kind in ("revolute", "prismatic")
        for frame, offset in (
            ("proximal", ("0 mm", "0 mm", "0 mm")),
            ("distal", ("30 mm", "-1 m", "2 mm")),
        )
    )
    return (*LAYOUTS["actuated"](robot), *custom(robot, entries))


HINGED = {name: each for name, each in LAYOUTS.items() if name != "tensor"}
"""Layouts of springs with one axis each; tensors are tried with the kinds of springs."""
CASES = {
    **HINGED,
    "bearing-joint, distal": partial(bearing_joint, distal=True),
    "custom": everything,
}


@cache
def arm(name: str) -> tuple[Robot, Linkage]:
    return Robot.from_urdf(ARMS[name], "tcp"), Linkage.from_urdf(ARMS[name], "tcp")


@pytest.mark.parametrize("arm_name", ARMS)
@pytest.mark.parametrize("case", CASES)
class TestEveryLayout(LayoutSuite):
    @pytest.fixture
    def layout(self, case):
        return CASES[case]

    @pytest.fixture
    def robot(self, arm_name):
        return arm(arm_name)[0]

    def test_axial_springs_come_first_in_the_order_of_the_joints(self, case, arm_name):
        robot = arm(arm_name)[0]
        joints = robot.chain.joints
        springs = CASES[case](robot)
        assert springs[: len(joints)] == tuple(axial(joint) for joint in joints)
        order = [robot.joint_names.index(spring.joint) for spring in springs[len(joints) :]]
        assert order == sorted(order)

    def test_axial_columns_are_those_of_the_rigid_robot(self, case, arm_name):
        robot, linkage = arm(arm_name)
        q = configurations(linkage, 4)
        found = ElasticModel(robot, CASES[case](robot)).spring_jacobian(q)
        rigid, n = robot.jacobian(q), len(robot.joint_names)
        np.testing.assert_allclose(found.translation[..., :n], rigid.translation, atol=1e-12)
        np.testing.assert_allclose(found.rotation[..., :n], rigid.rotation, atol=1e-12)

    def test_columns_are_finite_differences_of_the_chain_with_the_spring_moved(
        self, case, arm_name
    ):
        robot, linkage = arm(arm_name)
        springs = CASES[case](robot)
        for q in configurations(linkage, 2, seed=3):
            found = ElasticModel(robot, springs).spring_jacobian(q)
            columns = [numerical_column(linkage, q, spring) for spring in springs]
            translation, rotation = np.moveaxis(columns, 0, -1)
            np.testing.assert_allclose(found.translation, translation, atol=2e-9)
            np.testing.assert_allclose(found.rotation, rotation, atol=2e-9)


@pytest.mark.parametrize("name", ["auto", "gears", "gears+friction", "bearing-gears"])
def test_a_layout_that_is_made_from_readings_is_refused_with_who_takes_it(name):
    robot = Robot.from_urdf(ARMS["six axes"], "tcp")
    words = rf"layout '{re.escape(name)}' is made from readings: springs=.* of calibrate takes it"
    with pytest.raises(SpringError, match=words):
        layout(robot, name)
