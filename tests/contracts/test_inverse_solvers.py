"""The contract that every inverse kinematics solver keeps, on every kind of arm."""

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import (
    Rail,
    Robot,
    T_from_xyzabc,
    catalogue,
    on_rail,
    with_joint_origins,
    with_tool,
)
from elastocal.robot.inverse import InverseKinematics
from elastocal.robot.inverse.arm import nearest_zero
from elastocal.robot.inverse.numerical import (
    NearInverse,
    NumericalInverse,
    ParallelInverse,
    inverse_for,
)
from elastocal.robot.inverse.opw import OpwInverse
from support.urdfs import (
    CEILING,
    HALF_TURN,
    KR_LIKE,
    WALL,
    offset_wrist_urdf,
    opw_arm_urdf,
    sliding_arm_urdf,
)

NARROW = ((-3.0, 2.9), (-2.4, 0.9), (-2.0, 2.7), (-6.1, 6.1), (-2.1, 2.1), (-6.1, 6.1))


def _robot(text: str) -> Robot:
    return Robot.from_urdf(text, "tcp")


def _near(robot: Robot) -> InverseKinematics:
    solver = inverse_for(robot)
    assert isinstance(solver, NearInverse)
    return solver


def _parallel_robot(rail: bool = False, skew: float = 0.0) -> Robot:
    """Return a UR20 with a crooked tool, perhaps with its joints turned by so many rad."""
    T = T_from_xyzabc(0.1, -0.05, 0.2, 0.3, 0.2, -0.4)
    text = with_tool(catalogue.urdf("UR20"), "flange", "tcp", T)
    if rail:
        text = on_rail(text, Rail("rail", (0.0, 1.0, 0.0), -1.0, 4.0))
    if skew:
        turned = T_from_xyzabc(0.0, 0.0, 0.0, skew, skew, skew)
        text = with_joint_origins(text, dict.fromkeys(_robot(text).joint_names, turned))
    return _robot(text)


def _solvers() -> dict[str, InverseKinematics]:
    floor = _robot(opw_arm_urdf(**KR_LIKE))
    turned = opw_arm_urdf(
        **{**KR_LIKE, "b": 0.1},
        signs=(-1, 1, -1, -1, 1, -1),
        offsets=(0.3, -0.5, 1.7, 2.0, -0.4, 0.9),
        mount=WALL,
    )
    external = opw_arm_urdf(
        **KR_LIKE, limits=NARROW, mount=CEILING, rail=(-1.0, 4.0), turntable=HALF_TURN
    )
    return {
        "opw": OpwInverse(floor),
        "opw on a wall": OpwInverse(_robot(turned)),
        "opw on external axes": OpwInverse(_robot(external)),
        "parallel axes": ParallelInverse(_parallel_robot()),
        "parallel axes on a rail": ParallelInverse(_parallel_robot(rail=True)),
        "nearly opw": _near(_robot(opw_arm_urdf(**KR_LIKE, skew=4e-6))),
        "nearly parallel axes": _near(_parallel_robot(skew=2e-4)),
        "numerical on an opw arm": NumericalInverse(floor),
        "numerical, offset wrist": NumericalInverse(_robot(offset_wrist_urdf())),
        "numerical on a rail": NumericalInverse(_robot(offset_wrist_urdf(rail=(-1.0, 4.0)))),
        "numerical, prismatic joint": NumericalInverse(_robot(sliding_arm_urdf())),
    }


SOLVERS = _solvers()


@pytest.fixture(params=SOLVERS, scope="module")
def solver(request) -> InverseKinematics:
    return SOLVERS[request.param]


@pytest.fixture(scope="module")
def planted(solver) -> np.ndarray:
    limits = solver.robot.limits
    return np.random.default_rng(7).uniform(limits.lower, limits.upper, (6, len(limits.lower)))


@pytest.fixture(scope="module")
def poses(solver, planted) -> np.ndarray:
    return solver.robot.forward(planted)


@pytest.fixture(scope="module")
def external(solver, planted) -> np.ndarray:
    return planted[:, : solver.robot.external_axes]


@pytest.fixture(scope="module")
def found(solver, poses, external):
    return solver.solve_many(poses, external)


class TestEverySolver:
    def test_slots_have_the_documented_shape(self, solver, found, poses):
        joints = len(solver.robot.joint_names)
        assert found.q.shape == (len(poses), solver.branches, joints)
        assert found.exists.shape == (len(poses), solver.branches)
        assert found.reachable.shape == (len(poses),)

    def test_the_planted_configuration_is_among_the_solutions(self, solver, found, planted):
        expected = nearest_zero(solver.robot, planted)[:, None]
        # The external axes are returned as given, not nearest to zero.
        count = solver.robot.external_axes
        gap = np.abs(found.q - expected)[..., count:].max(axis=-1)
        assert np.nanmin(gap, axis=-1).max() < 1e-8

    def test_every_solution_reaches_its_pose(self, solver, found, poses):
        pose, branch = np.nonzero(found.exists)
        reached = solver.robot.forward(found.q[pose, branch])
        np.testing.assert_allclose(reached, poses[pose], atol=2e-9, rtol=0)

    def test_every_solution_is_within_the_limits(self, solver, found):
        assert solver.robot.limits.margin(found.q[found.exists]).min() >= 0.0

    def test_external_axes_come_first_and_as_given(self, solver, found, external):
        pose, branch = np.nonzero(found.exists)
        count = solver.robot.external_axes
        np.testing.assert_array_equal(found.q[pose, branch, :count], external[pose])

    def test_it_says_how_it_solves(self, solver):
        assert ("closed form" in solver.method) != isinstance(solver, NumericalInverse)

    def test_a_slot_is_whole_or_empty(self, found):
        assert np.array_equal(np.isnan(found.q).any(axis=-1), np.isnan(found.q).all(axis=-1))

    def test_one_pose_gives_the_slots_of_many(self, solver, found, poses, external):
        alone = solver.solve(poses[2], external[2])
        np.testing.assert_allclose(alone, found.q[2][found.exists[2]], atol=1e-12, rtol=0)

    def test_the_answer_is_the_same_again(self, solver, found, poses, external):
        again = solver.solve_many(poses[:2], external[:2])
        np.testing.assert_allclose(again.q, found.q[:2], atol=1e-12, rtol=0)

    def test_a_pose_out_of_reach_has_no_solution(self, solver, poses, external):
        far = poses[0].copy()
        far[:3, 3] += 50.0
        assert solver.solve(far, external[0]).shape == (0, len(solver.robot.joint_names))
        assert not solver.solve_many(far[None], external[:1]).reachable.any()

    def test_no_pose_is_no_solution(self, solver):
        none = solver.solve_many(np.empty((0, 4, 4)), np.empty((0, solver.robot.external_axes)))
        assert none.q.shape == (0, solver.branches, len(solver.robot.joint_names))

    def test_solutions_cannot_be_changed(self, found):
        with pytest.raises(ValueError, match="read-only"):
            found.q[0, 0, 0] = 0.0

    def test_the_pose_is_not_changed(self, solver, poses, external):
        before = poses[0] + 1e-9
        given = before.copy()
        solver.solve(given, external[0])
        np.testing.assert_array_equal(given, before)

    def test_a_rotation_with_seven_digits_is_accepted(self, solver, poses, external):
        rounded = np.round(poses[1], 7)
        q = solver.solve(rounded, external[1])
        assert len(q)
        np.testing.assert_allclose(solver.robot.forward(q[0]), rounded, atol=2e-7, rtol=0)


class TestEverySolverRefuses:
    @pytest.mark.parametrize("shape", [(4,), (3, 4), (1, 4, 4)])
    def test_one_pose_of_another_shape(self, solver, shape, external):
        with pytest.raises(RobotError, match=r"pose of shape .*: must be \(4, 4\)"):
            solver.solve(np.zeros(shape), external[0])

    def test_many_poses_of_another_shape(self, solver, external):
        with pytest.raises(RobotError, match=r"poses of shape \(4, 4\): must be \(pose, 4, 4\)"):
            solver.solve_many(np.eye(4), external[0])

    def test_a_value_that_is_not_finite(self, solver, poses, external):
        bad = poses.copy()
        bad[3, 0, 3] = np.nan
        with pytest.raises(RobotError, match="pose 3 holds a value that is not finite"):
            solver.solve_many(bad, external)

    @pytest.mark.parametrize(
        "spoil", [np.diag([1, 1, -1, 1]), np.diag([1, 1, 1.1, 1]), np.diag([1, 1, 1, 2])]
    )
    def test_a_transform_that_is_not_rigid(self, solver, poses, external, spoil):
        bad = poses.copy()
        bad[1] = bad[1] @ spoil
        with pytest.raises(RobotError, match="pose 1 is not a rigid transform"):
            solver.solve_many(bad, external)

    def test_a_wrong_number_of_external_positions(self, solver, poses):
        count = solver.robot.external_axes
        with pytest.raises(RobotError, match=f"has {count} external axes"):
            solver.solve(poses[0], np.zeros(count + 1))


@pytest.mark.parametrize("value", [4.1, -1.1, np.nan, np.inf])
@pytest.mark.parametrize("name", ["opw on external axes", "numerical on a rail"])
def test_an_external_position_outside_its_limits_is_refused(name, value):
    solver = SOLVERS[name]
    position = np.zeros(solver.robot.external_axes)
    position[0] = value
    with pytest.raises(RobotError, match=r"external axis rail at .*: must be within -1 and 4"):
        solver.solve(np.eye(4), position)


def test_one_external_position_serves_all_poses():
    solver = SOLVERS["opw on external axes"]
    q = np.tile([0.5, 0.2, 0.1, -0.8, 1.0, 0.4, 0.7, -0.3], (3, 1))
    q[:, 2] += [0.0, 0.1, 0.2]
    found = solver.solve_many(solver.robot.forward(q), [0.5, 0.2])
    assert found.reachable.all()
