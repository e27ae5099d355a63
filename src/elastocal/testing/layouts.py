"""Contract of every spring layout."""

from collections.abc import Callable

import numpy as np
import pytest

from elastocal.arrays import FloatArray
from elastocal.elastic import ElasticModel, Spring
from elastocal.robot import Robot, catalogue


class LayoutSuite:
    """Tests of a layout, the fixture ``layout``: a function from a robot to its springs."""

    @pytest.fixture
    def robot(self) -> Robot:
        """Return an arm of the catalogue."""
        return catalogue.load("KR 120 R2700 extra HA")

    @pytest.fixture
    def springs(
        self, layout: Callable[[Robot], tuple[Spring, ...]], robot: Robot
    ) -> tuple[Spring, ...]:
        """Return the springs of the robot."""
        return layout(robot)

    @pytest.fixture
    def q(self, robot: Robot) -> FloatArray:
        """Return five configurations within the limits, half a turn or 1 m where there are none."""
        low = np.where(np.isfinite(robot.limits.lower), robot.limits.lower, -1.0)
        high = np.where(np.isfinite(robot.limits.upper), robot.limits.upper, 1.0)
        return low + (high - low) * np.random.default_rng(3).uniform(0.1, 0.9, (5, len(low)))

    def test_names_are_unique_and_begin_with_the_joint(self, springs: tuple[Spring, ...]) -> None:
        assert len({spring.name for spring in springs}) == len(springs)
        assert all(spring.name.startswith(f"{spring.joint}.") for spring in springs)

    def test_axes_are_unit_vectors(self, springs: tuple[Spring, ...]) -> None:
        axes = np.array([each.axis for spring in springs for each in spring.axes])
        np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-15)

    def test_springs_stand_in_the_order_of_the_joints_those_about_axes_first(
        self, springs: tuple[Spring, ...], robot: Robot
    ) -> None:
        about = [spring.name.endswith(".axial") for spring in springs]
        assert about == sorted(about, reverse=True)
        for is_axial in (True, False):
            joints = [each.joint for each, ax in zip(springs, about, strict=True) if ax is is_axial]
            order = [robot.joint_names.index(joint) for joint in joints]
            assert order == sorted(order)

    def test_cartesian_compliance_is_symmetric_and_positive_semidefinite(
        self, springs: tuple[Spring, ...], robot: Robot, q: FloatArray
    ) -> None:
        model = ElasticModel(robot, springs)
        c = np.random.default_rng(2).uniform(1e-7, 1e-5, len(model.parameters))
        found = model.cartesian_compliance(c, q)
        whole = np.block(
            [[found.translation, found.coupling], [found.coupling.swapaxes(1, 2), found.rotation]]
        )
        np.testing.assert_allclose(whole, whole.swapaxes(1, 2), atol=1e-20)
        eigenvalues = np.linalg.eigvalsh(whole)
        assert np.all(eigenvalues >= -1e-14 * eigenvalues.max())

    def test_the_deflection_is_linear_in_each_parameter(
        self, springs: tuple[Spring, ...], robot: Robot, q: FloatArray
    ) -> None:
        model, force = ElasticModel(robot, springs), np.array([100.0, -200.0, 300.0])
        c = np.random.default_rng(2).uniform(1e-7, 1e-5, len(model.parameters))
        alone = [model.deflection(row, q, force) for row in np.diag(c)]
        np.testing.assert_allclose(np.sum(alone, axis=0), model.deflection(c, q, force), rtol=1e-9)
