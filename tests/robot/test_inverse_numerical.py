"""The numerical solver, and the proof and polish that all solvers share."""

from dataclasses import dataclass

import numpy as np
import pytest

from elastocal.errors import RobotError
from elastocal.robot import Robot
from elastocal.robot.inverse import pose_error
from elastocal.robot.inverse.numerical import NearInverse, NumericalInverse, inverse_for
from elastocal.robot.inverse.opw import OpwInverse
from elastocal.robot.inverse.solver import InverseKinematics, distinct
from support.measured_arms import chain
from support.urdfs import KR_LIKE, offset_wrist_urdf, opw_arm_urdf, planar_arm_urdf

ARM = Robot.from_urdf(opw_arm_urdf(**KR_LIKE), "tcp")


@dataclass(frozen=True, eq=False)
class _OneGuess(InverseKinematics):
    """A solver whose only candidate is the same for every pose."""

    guess: np.ndarray

    @property
    def branches(self) -> int:
        return 1

    @property
    def method(self) -> str:
        return "a guess"

    def candidates(self, T_base_tcp, external):  # noqa: ARG002
        return np.broadcast_to(self.guess, (len(T_base_tcp), 1, 6))


class TestProof:
    q = np.array([0.3, -0.4, 1.0, 0.5, 0.8, -0.2])

    def test_a_candidate_that_nearly_reaches_its_pose_is_polished(self):
        found = _OneGuess(ARM, self.q + 1e-5).solve(ARM.forward(self.q))
        np.testing.assert_allclose(found, [self.q], atol=1e-9)

    def test_a_candidate_that_misses_its_pose_is_not_returned(self):
        assert not len(_OneGuess(ARM, self.q + 0.3).solve(ARM.forward(self.q)))

    def test_polish_does_not_leave_the_limits(self):
        outside = np.array([0.3, -0.4, 1.0, 0.5, np.pi + 1e-6, -0.2])
        limits = [(-3.0, 3.0)] * 4 + [(-1.0, np.pi), (-3.0, 3.0)]
        arm = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, limits=limits), "tcp")
        guess = np.where(np.arange(6) == 4, np.pi, outside)
        assert not len(_OneGuess(arm, guess).solve(arm.forward(outside)))


class TestPoseError:
    def test_it_is_what_a_small_joint_step_makes(self):
        q, step = TestProof.q, 1e-6 * np.array([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
        error = pose_error(ARM.forward(q)[None], ARM.forward(q + step)[None])[0]
        jacobian = ARM.jacobian(q)
        predicted = np.concatenate([jacobian.translation, jacobian.rotation]) @ step
        np.testing.assert_allclose(error, predicted, atol=1e-10)

    def test_half_a_turn_is_no_small_error(self):
        turned = ARM.forward(TestProof.q) @ np.diag([-1.0, -1.0, 1.0, 1.0])
        error = pose_error(ARM.forward(TestProof.q)[None], turned[None])[0]
        assert np.linalg.norm(error[3:]) == pytest.approx(np.pi)


class TestDistinct:
    def test_rows_a_turn_apart_are_one(self):
        rows = np.array([[3.1, 0, 0, 0, 0, 0], [3.1 - 2 * np.pi, 0, 0, 0, 0, 0], [3.0] + [0] * 5])
        np.testing.assert_array_equal(distinct(ARM, rows, 1e-6), rows[[0, 2]])

    def test_nothing_stays_nothing(self):
        assert distinct(ARM, np.empty((0, 6)), 1e-6).shape == (0, 6)


class TestNumericalInverse:
    def test_it_finds_the_branches_of_the_closed_form(self):
        q = np.random.default_rng(11).uniform(-2.5, 2.5, (5, 6))
        for pose in ARM.forward(q):
            exact = OpwInverse(ARM).solve(pose)
            exact = exact[np.lexsort(np.round(exact, 6).T[::-1])]
            np.testing.assert_allclose(NumericalInverse(ARM).solve(pose), exact, atol=1e-8)

    def test_solutions_ascend(self):
        robot = Robot.from_urdf(offset_wrist_urdf(), "tcp")
        q = NumericalInverse(robot).solve(robot.forward(TestProof.q))
        assert len(q) > 1
        assert q.tolist() == sorted(q.tolist())

    def test_the_seed_decides_where_it_looks(self):
        pose = ARM.forward(TestProof.q)
        few = [NumericalInverse(ARM, seed=seed, starts=3).solve(pose) for seed in (0, 0, 1, 2)]
        np.testing.assert_array_equal(few[0], few[1])
        assert any(not np.array_equal(few[0], other) for other in few[2:])

    def test_a_singular_pose_gives_a_bounded_sample_of_its_solutions(self):
        pose = ARM.forward([0.4, -0.3, 1.1, 0.9, 0.0, -0.2])
        q = NumericalInverse(ARM).solve(pose)
        assert 1 <= len(q) <= 16
        np.testing.assert_allclose(ARM.forward(q), np.tile(pose, (len(q), 1, 1)), atol=2e-9)

    def test_an_arm_of_three_joints_is_solved_in_its_plane(self):
        robot = Robot.from_urdf(planar_arm_urdf(), "tcp")
        solver, q = NumericalInverse(robot), np.array([0.3, -0.9, 0.4])
        found = solver.solve(robot.forward(q))
        assert len(found) == 2
        assert np.abs(found - q).max(axis=1).min() < 1e-8
        beside = robot.forward(q)
        beside[1, 3] += 0.01
        assert not len(solver.solve(beside))

    @pytest.mark.parametrize("name", ["starts", "iterations"])
    def test_no_work_is_refused(self, name):
        with pytest.raises(RobotError, match=f"{name} = 0: must be at least 1"):
            NumericalInverse(ARM, **{name: 0})


def _universal(quarter: str, half: str = "3.141592653589793") -> Robot:
    """Return an arm with three parallel axes, in frames of Denavit and Hartenberg."""
    z = "0 0 1"
    return chain(
        ("0 0 0.18", z), ("0 0 0", z, f"{quarter} 0 0"), ("-0.61 0 0", z), ("-0.57 0 0.17", z),
        ("0 -0.12 0", z, f"{quarter} 0 0"), ("0 0.12 0", z, f"{quarter} {half} {half}"),
    )  # fmt: skip


def _opw(skew: float = 0.0) -> Robot:
    return Robot.from_urdf(opw_arm_urdf(**KR_LIKE, skew=skew), "tcp")


NEAR = {
    "spherical wrist, 1.5708": (_opw(4e-6), _opw()),
    "spherical wrist, as built": (_opw(1e-3), _opw()),
    "parallel axes, 1.5708": (_universal("1.5708", "3.1416"), _universal("1.5707963267948966")),
    "parallel axes, 1.571": (_universal("1.571", "3.142"), _universal("1.5707963267948966")),
}
"""Arms that miss a closed form, and the same without that."""


@pytest.mark.parametrize("arm", NEAR)
class TestNearInverse:
    """An arm that has a closed form but for the digits of its file."""

    def test_digits_of_the_file_do_not_cost_the_closed_form(self, arm):
        near, exact = NEAR[arm]
        assert type(inverse_for(near)) is NearInverse
        assert type(inverse_for(exact)) is type(inverse_for(near).nearest)

    def test_it_returns_as_many_branches_as_the_arm_without_them(self, arm):
        near, exact = NEAR[arm]
        q = np.random.default_rng(3).uniform(-2.5, 2.5, (50, 6))
        found = inverse_for(near).solve_many(near.forward(q))
        reference = inverse_for(exact).solve_many(exact.forward(q))
        assert abs(found.exists.sum() - reference.exists.sum()) <= 0.01 * reference.exists.sum()
        gap = np.abs(found.q - q[:, None])
        gap = np.abs(np.angle(np.exp(1j * gap))).max(axis=-1)
        assert np.nanmin(gap, axis=1).max() < 1e-6

    def test_it_names_what_it_misses(self, arm):
        method = inverse_for(NEAR[arm][0]).method
        kind = "three parallel axes" if "parallel" in arm else "a spherical wrist"
        assert method.startswith(f"descents from the closed form of arms with {kind}, which it")


@pytest.mark.parametrize("bend", [0.0, 1e-5, 1e-3])
def test_a_straight_wrist_is_reached_by_an_arm_that_is_nearly_opw(bend):
    tilted = _opw(4e-6)
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (50, 6))
    q[:, 4] = bend
    assert inverse_for(tilted).solve_many(tilted.forward(q)).reachable.all()


class TestQuicker:
    """Answers that need not find every solution are those of all solutions."""

    robot = Robot.from_urdf(offset_wrist_urdf(), "tcp")
    T = robot.forward(np.random.default_rng(3).uniform(-1.0, 1.0, (6, 6)))

    def test_poses_are_reachable_that_have_a_solution(self):
        some = self.T.copy()
        some[::3, 0, 3] += 9.0
        solver = NumericalInverse(self.robot)
        expected = solver.solve_many(some).reachable
        assert expected.tolist() == [False, True, True] * 2
        assert solver.reachable(some).tolist() == expected.tolist()
        assert solver.quick().solve_many(some).reachable.tolist() == expected.tolist()

    def test_a_pose_beside_is_reached_in_the_slot_of_the_first(self):
        solver = NumericalInverse(self.robot)
        here, beside = solver.solve_many(self.T).q, self.T.copy()
        beside[:, 2, 3] += 1e-4
        found = solver.beside(beside, here)
        there = np.isfinite(found[..., 0])
        assert there.sum() >= 0.9 * np.isfinite(here[..., 0]).sum()
        pose, _ = np.nonzero(there)
        np.testing.assert_allclose(self.robot.forward(found[there]), beside[pose], atol=1e-8)
        assert np.median(np.abs(found[there] - here[there]).max(axis=-1)) < 1e-2
