"""Contract of every check of a calibration pose."""

import numpy as np
import pytest

from elastocal.planning import CHECKS, Postures
from elastocal.planning.checks import Check
from elastocal.robot import Robot, catalogue, with_tool


class CheckSuite:
    """Tests of a check, the fixture ``check``; ``postures`` are those of its robot."""

    @pytest.fixture
    def robot(self) -> Robot:
        """Return an arm of the catalogue with a tool."""
        T_flange_tcp = np.eye(4)
        T_flange_tcp[:3, 3] = (0.15, 0.0, 0.35)
        urdf = with_tool(catalogue.urdf("KR 120 R2700 extra HA"), "flange", "tcp", T_flange_tcp)
        return Robot.from_urdf(urdf, "tcp")

    @pytest.fixture
    def postures(self, robot: Robot) -> Postures:
        """Return sixty postures anywhere within the middle half of the joints' ranges."""
        limits, rng = robot.limits, np.random.default_rng(6)
        middle, half = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
        q = middle + half * rng.uniform(-0.5, 0.5, (60, len(robot.joint_names)))
        T_base_tcp = robot.forward(q)
        return Postures(T_base_tcp, -T_base_tcp[:, :3, 2], q, q + 0.01, np.arange(60))

    def test_gives_one_finite_margin_a_posture(self, check: Check, postures: Postures) -> None:
        margin = check.margin(postures)
        assert margin.shape == (len(postures),)
        assert np.all(np.isfinite(margin))

    def test_judges_each_posture_by_itself(self, check: Check, postures: Postures) -> None:
        chosen = np.array([7, 3, 11])
        alone = check.margin(postures.take(chosen))
        np.testing.assert_allclose(alone, check.margin(postures)[chosen], atol=1e-9)

    def test_has_a_name_a_unit_and_advice(self, check: Check) -> None:
        assert check.name.isidentifier()
        assert check.unit
        assert len(check.advice.split()) > 3

    def test_of_no_posture_is_empty(self, check: Check, postures: Postures) -> None:
        assert check.margin(postures.take([])).shape == (0,)

    def test_its_class_is_found_by_its_name(self, check: Check) -> None:
        if not hasattr(check, "at_points"):  # of a point, which is no plug-in
            assert check.name in CHECKS, (
                f"no package has the entry point {check.name!r} in elastocal.checks"
            )
            assert CHECKS[check.name] is type(check)
