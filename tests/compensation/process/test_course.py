import numpy as np

from elastocal.compensation.process.course import evenly_spaced, tool_frames, unit_tangents


def test_rows_are_as_far_apart_as_the_speed_says():
    corners = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.4, 0.0]])
    rows = evenly_spaced(corners, speed=0.1, step=0.05)
    assert len(rows) == 140
    np.testing.assert_allclose(np.linalg.norm(np.diff(rows[:60], axis=0), axis=1), 0.005)


def test_what_stands_beside_the_points_is_interpolated_with_them():
    rows = evenly_spaced(np.array([[0.0, 0, 0, 1.0], [1.0, 0, 0, 3.0]]), speed=0.5, step=0.5)
    np.testing.assert_allclose(rows[:, 3], 1.0 + 2.0 * rows[:, 0])


def test_frames_are_rotations_with_z_as_given():
    rng = np.random.default_rng(0)
    z = rng.standard_normal((5, 3))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    T = tool_frames(np.zeros((5, 3)), np.tile([1.0, 0.0, 0.0], (5, 1)), z)
    R = T[:, :3, :3]
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.tile(np.eye(3), (5, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0)
    np.testing.assert_allclose(R[:, :, 2], z)


def test_travel_follows_the_path():
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    np.testing.assert_allclose(unit_tangents(points), np.tile([1.0, 0, 0], (3, 1)))
