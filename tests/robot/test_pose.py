"""KUKA poses against SciPy's Euler angles, and at the gimbal."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.robot import T_from_xyzabc, nearest_rotation, xyzabc_from_T


def random_poses(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return poses (count, 6), b within its half turn."""
    span = np.array([3.0, 3.0, 3.0, math.pi, math.pi / 2, math.pi])
    return rng.uniform(-span, span, (count, 6))


def test_angles_are_z_then_new_y_then_new_x():
    poses = random_poses(np.random.default_rng(1), 100)
    expected = Rotation.from_euler("ZYX", poses[:, 3:]).as_matrix()
    T = T_from_xyzabc(*poses.T)
    np.testing.assert_allclose(T[:, :3, :3], expected, atol=1e-14)
    np.testing.assert_array_equal(T[:, :3, 3], poses[:, :3])
    np.testing.assert_array_equal(T[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (100, 1)))


def test_pose_comes_back():
    poses = random_poses(np.random.default_rng(2), 200)
    np.testing.assert_allclose(xyzabc_from_T(T_from_xyzabc(*poses.T)), poses, atol=1e-12)


def test_single_pose_needs_no_axis():
    T = T_from_xyzabc(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    assert T.shape == (4, 4)
    np.testing.assert_allclose(xyzabc_from_T(T), [1.0, 2.0, 3.0, 0.1, 0.2, 0.3], atol=1e-14)


def test_scalars_and_columns_broadcast():
    assert T_from_xyzabc(np.zeros(5), 0.0, 0.0, 0.0, 0.0, np.ones((2, 1))).shape == (2, 5, 4, 4)


@pytest.mark.parametrize("b", [math.pi / 2, -math.pi / 2])
def test_a_is_zero_at_the_gimbal_and_the_rotation_is_kept(b):
    T = T_from_xyzabc(0.0, 0.0, 0.0, 0.7, b, -0.4)
    pose = xyzabc_from_T(T)
    assert pose[3] == 0.0
    assert pose[4] == pytest.approx(b, abs=1e-12)
    assert pose[5] == pytest.approx(-0.4 - math.copysign(0.7, b), abs=1e-12)
    np.testing.assert_allclose(T_from_xyzabc(*pose), T, atol=1e-12)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9, 1e-11, 1e-13, 1e-15])
def test_rotation_is_kept_close_to_the_gimbal(off):
    T = T_from_xyzabc(0.0, 0.0, 0.0, 0.7, math.pi / 2 - off, -0.4)
    np.testing.assert_allclose(T_from_xyzabc(*xyzabc_from_T(T)), T, atol=1e-12)


def test_the_nearest_rotation_is_scipys_and_never_a_mirror_image():
    rng = np.random.default_rng(4)
    here, there = rng.normal(size=(2, 20, 8, 3))
    there[10:] = here[10:] * [1.0, 1.0, -1.0]
    found = nearest_rotation(np.einsum("smi,smj->sij", there, here))
    for each, a, b in zip(found, here, there, strict=True):
        expected = Rotation.align_vectors(b, a)[0].as_matrix()
        np.testing.assert_allclose(each, expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(found), 1.0)
    np.testing.assert_allclose(nearest_rotation(2.0 * found[0]), found[0], atol=1e-14)
