"""OPW arms: parameters from the axes, the closed form against another, singular poses."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from elastocal.robot import Robot
from elastocal.robot.inverse import inverse_for
from elastocal.robot.inverse.numerical import NumericalInverse
from elastocal.robot.inverse.opw import (
    NotOrthoParallelError,
    OpwInverse,
    derive_opw,
    opw_branches,
)
from support.urdfs import (
    CEILING,
    FLOOR,
    KR_LIKE,
    WALL,
    offset_wrist_urdf,
    opw_arm_urdf,
    planar_arm_urdf,
    sliding_arm_urdf,
)

LENGTHS = ("a1", "a2", "b", "c1", "c2", "c3", "c4")
SIDEWAYS = {**KR_LIKE, "b": 0.12}
SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "data"


def _robot(text: str) -> Robot:
    return Robot.from_urdf(text, "tcp")


def _shared(name: str) -> Robot:
    path = SHARED / name / f"{name}.urdf"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    return Robot.from_file(path, "tcp")


def _circular_gap(a, b):
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi)


class TestDerivation:
    @pytest.mark.parametrize("parameters", [KR_LIKE, SIDEWAYS])
    def test_lengths_of_the_arm_are_recovered(self, parameters):
        derived = derive_opw(_robot(opw_arm_urdf(**parameters))).parameters
        for name in LENGTHS:
            assert getattr(derived, name) == pytest.approx(parameters[name], abs=1e-12)
        assert derived.signs == (1,) * 6
        np.testing.assert_allclose(derived.offsets, 0.0, atol=1e-12)

    def test_senses_and_zeros_of_the_joints_are_recovered(self):
        signs, offsets = (-1, 1, -1, -1, 1, -1), (0.0, -0.5, 1.7, 0.4, -0.4, 0.0)
        derived = derive_opw(_robot(opw_arm_urdf(**KR_LIKE, signs=signs, offsets=offsets)))
        assert derived.parameters.signs == signs
        np.testing.assert_allclose(derived.parameters.offsets, offsets, atol=1e-12)

    @pytest.mark.parametrize("mount", [FLOOR, WALL, CEILING])
    def test_mounting_changes_no_length_of_the_arm(self, mount):
        derived = derive_opw(_robot(opw_arm_urdf(**SIDEWAYS, mount=mount))).parameters
        # Which way is up, and with it the sign of a2 and b, depends on where the base is.
        for name in ("a1", "a2", "b", "c2", "c3", "c4"):
            length = abs(getattr(derived, name))
            assert length == pytest.approx(abs(SIDEWAYS[name]), abs=1e-12)

    def test_it_is_certified_against_the_forward_kinematics_of_the_robot(self):
        assert derive_opw(_robot(opw_arm_urdf(**SIDEWAYS, mount=WALL))).deviation < 1e-13

    @pytest.mark.parametrize(
        ("name", "lengths"),
        [
            ("golden_6r", (0.35, 0.041, 0.0, 0.675, 1.15, 1.2, 0.565)),
            ("fanuc_r2000ic", (0.312, -0.225, 0.0, 0.67, 1.075, 1.28, 0.5343)),
        ],
    )
    def test_published_arms_are_recognised(self, name, lengths):
        derived = derive_opw(_shared(name))
        np.testing.assert_allclose(
            [getattr(derived.parameters, length) for length in LENGTHS], lengths, atol=1e-9
        )
        assert derived.deviation < 1e-12


class TestRefusal:
    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            (offset_wrist_urdf(), "joint_4, joint_5, joint_6 must meet in one point .* 0.08"),
            (opw_arm_urdf(**KR_LIKE, skew=1e-6), "joint_1, joint_2 must be perpendicular"),
            (opw_arm_urdf(**{**KR_LIKE, "c2": 0.0}), "joint_2 and joint_3 has no length"),
            (opw_arm_urdf(**{**KR_LIKE, "a2": 0.0, "c3": 0.0}), "and the wrist has no length"),
            (sliding_arm_urdf(), "six revolute joints: revolute, revolute, prismatic"),
            (planar_arm_urdf(), "six revolute joints: revolute, revolute, revolute"),
        ],
    )
    def test_the_condition_that_fails_is_named(self, text, reason):
        with pytest.raises(NotOrthoParallelError, match=reason):
            derive_opw(_robot(text))

    def test_the_numerical_solver_takes_over_and_knows_why(self):
        solver = inverse_for(_robot(offset_wrist_urdf()), seed=5)
        assert isinstance(solver, NumericalInverse)
        assert "spherical wrist" in solver.reason
        assert solver.seed == 5

    def test_an_opw_arm_gets_the_closed_form(self):
        assert isinstance(inverse_for(_robot(opw_arm_urdf(**KR_LIKE))), OpwInverse)


class TestAgainstAnotherImplementation:
    @pytest.mark.parametrize("parameters", [KR_LIKE, SIDEWAYS, {**KR_LIKE, "a1": 0.0, "a2": 0.0}])
    def test_branch_slots_are_those_of_py_opw_kinematics(self, parameters):
        library = pytest.importorskip("py_opw_kinematics")
        from scipy.spatial.transform import RigidTransform

        other = library.Robot(library.KinematicModel(**parameters), degrees=False)
        ours = derive_opw(_robot(opw_arm_urdf(**parameters))).parameters
        theta = np.random.default_rng(3).uniform(-np.pi, np.pi, (200, 6))
        poses = ours.forward(theta)
        theirs = other.reach(RigidTransform.from_matrix(poses)).joints
        branches = opw_branches(ours, poses, np.zeros(6))
        missing = np.isnan(branches).any(axis=-1)
        np.testing.assert_array_equal(missing, np.isnan(theirs).any(axis=-1))
        gap = _circular_gap(branches, theirs)
        assert np.nanmax(gap) < 1e-5
        assert np.nanmedian(gap) < 1e-14


class TestPool:
    @pytest.mark.parametrize("name", ["golden_6r", "fanuc_r2000ic"])
    def test_published_arms_come_back_to_where_they_were(self, name):
        robot = _shared(name)
        limits, rng = robot.limits, np.random.default_rng(5)
        lower, upper = np.maximum(limits.lower, -3.1), np.minimum(limits.upper, 3.1)
        q = rng.uniform(lower, upper, (300, 6))
        found = OpwInverse(robot).solve_many(robot.forward(q))
        gap = np.abs(found.q - q[:, None]).max(axis=-1)
        assert np.nanmin(gap, axis=-1).max() < 1e-7

    def test_an_arm_bends_its_elbow_and_wrist_as_its_slot_says(self):
        robot = _robot(opw_arm_urdf(**KR_LIKE))
        q = np.random.default_rng(2).uniform(-1.0, 1.0, (50, 6))
        found = OpwInverse(robot).solve_many(robot.forward(q)).q
        bend = found[..., 2] + np.arctan2(KR_LIKE["a2"], KR_LIKE["c3"])
        assert np.nanmin(bend[:, 0::2]) >= 0.0
        assert np.nanmax(bend[:, 1::2]) <= 0.0
        assert np.nanmin(found[:, :4, 4]) >= 0.0
        assert np.nanmax(found[:, 4:, 4]) <= 0.0


class TestSingularPoses:
    """KR_LIKE with no offset of axis 4: `q3 = 0` stretches the elbow exactly."""

    robot = _robot(opw_arm_urdf(**{**KR_LIKE, "a2": 0.0}))
    solver = OpwInverse(robot)

    def _assert_reached(self, q, pose):
        assert len(q)
        np.testing.assert_allclose(self.robot.forward(q), np.tile(pose, (len(q), 1, 1)), atol=1e-9)

    def test_a_straight_wrist_puts_joint_4_at_zero(self):
        pose = self.robot.forward([0.4, -0.3, 1.1, 0.9, 0.0, -0.2])
        q = self.solver.solve(pose)
        self._assert_reached(q, pose)
        straight = q[np.abs(q[:, 4]) < 1e-9]
        # Front and back shoulder, two elbows: the wrist is straight in one of the four.
        np.testing.assert_allclose(straight, [[0.4, -0.3, 1.1, 0.0, 0.0, 0.7]], atol=1e-9)

    def test_a_straight_wrist_puts_joint_4_as_near_to_zero_as_its_limits_allow(self):
        limits = [(-3.1, 3.1)] * 3 + [(0.5, 3.0), (-2.0, 2.0), (-3.1, 3.1)]
        robot = _robot(opw_arm_urdf(**KR_LIKE, limits=limits))
        q = OpwInverse(robot).solve(robot.forward([0.4, -0.3, 1.1, 0.9, 0.0, -0.2]))
        straight = q[np.abs(q[:, 4]) < 1e-9]
        np.testing.assert_allclose(straight[:, 3:], [[0.5, 0.0, 0.2]], atol=1e-9)

    @pytest.mark.parametrize("bend", [1e-13, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4])
    def test_a_nearly_straight_wrist_is_reached_exactly(self, bend):
        q = np.random.default_rng(8).uniform(-1.5, 1.5, (100, 6))
        q[:, 4] = bend
        found = self.solver.solve_many(self.robot.forward(q))
        first = np.nanmin(np.abs(found.q - q[:, None])[..., :3].max(axis=-1), axis=-1)
        assert first.max() < 1e-7
        pose, branch = np.nonzero(found.exists)
        reached = self.robot.forward(found.q[pose, branch])
        np.testing.assert_allclose(reached, self.robot.forward(q)[pose], atol=1e-9, rtol=0)

    def test_a_stretched_elbow_is_reached_and_given_once(self):
        q = np.random.default_rng(9).uniform(-1.0, 1.0, (200, 6))
        # Leaning forward: the front shoulder is the one that is stretched.
        q[:, 1], q[:, 2] = np.abs(q[:, 1]), 0.0
        poses = self.robot.forward(q)
        found = self.solver.solve_many(poses)
        assert found.exists[:, [0, 1, 4, 5]].all()
        pose, branch = np.nonzero(found.exists)
        reached = self.robot.forward(found.q[pose, branch])
        np.testing.assert_allclose(reached, poses[pose], atol=1e-9, rtol=0)
        # Round-off of 1e-16 in the cosine of the elbow is 1e-8 in its angle.
        np.testing.assert_allclose(found.q[:, 0, :3], found.q[:, 1, :3], atol=2e-7)
        assert len(self.solver.solve(poses[0])) == 2

    def test_stretched_straight_up_is_reached(self):
        pose = self.robot.forward(np.zeros(6))
        q = self.solver.solve(pose)
        self._assert_reached(q, pose)
        assert np.abs(q).max(axis=1).min() < 1e-7

    def test_a_wrist_centre_on_axis_1_puts_joint_1_at_zero(self):
        q2 = -0.4
        q3 = np.arcsin(-(KR_LIKE["a1"] + KR_LIKE["c2"] * np.sin(q2)) / KR_LIKE["c3"]) - q2
        pose = self.robot.forward([0.8, q2, q3, 0.3, 0.9, -0.5])
        found = self.solver.solve_many(pose[None])
        self._assert_reached(found.q[0][found.exists[0]], pose)
        np.testing.assert_array_equal(found.q[0, [0, 1, 4, 5], 0], 0.0)
        np.testing.assert_allclose(found.q[0, [2, 3, 6, 7], 0], np.pi, atol=1e-15)

    @pytest.mark.parametrize("change", [{}, {"a1": 0.0}, {"a1": 0.0, "c2": 1.2}, {"b": 0.1}])
    def test_right_angles_everywhere_are_reached(self, change):
        """729 poses, most of them singular in more than one way."""
        limits = ((-6.3, 6.3),) * 6
        robot = _robot(opw_arm_urdf(**{**KR_LIKE, "a2": 0.0, **change}, limits=limits))
        angles = (0.0, np.pi / 2, np.pi)
        poses = robot.forward(list(itertools.product(angles, repeat=6)))
        found = OpwInverse(robot).solve_many(poses)
        assert found.reachable.all()
        pose, branch = np.nonzero(found.exists)
        reached = robot.forward(found.q[pose, branch])
        np.testing.assert_allclose(reached, poses[pose], atol=1e-9, rtol=0)

    def test_a_wrist_centre_beside_axis_1_at_its_offset_is_reached(self):
        robot = _robot(opw_arm_urdf(**{**SIDEWAYS, "a2": 0.0}))
        q2 = -0.4
        q3 = np.arcsin(-(KR_LIKE["a1"] + KR_LIKE["c2"] * np.sin(q2)) / KR_LIKE["c3"]) - q2
        q = np.random.default_rng(4).uniform(-1.5, 1.5, (100, 6))
        q[:, 1:3] = q2, q3
        found = OpwInverse(robot).solve_many(robot.forward(q))
        assert found.reachable.all()
