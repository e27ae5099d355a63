"""Courses on the example dome, rings in the example block, and the postures for them."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.process import FibrePlacement, Roughing
from elastocal.compensation.process.course import engaged, swing
from elastocal.compensation.process.postures import _Trial, with_postures
from elastocal.errors import CompensationError
from elastocal.planning import cell_surface
from elastocal.robot import Robot, wrist_angle
from elastocal.robot.inverse import inverse_for
from support.by_day import some_by_day
from support.simulated import example_cell
from support.urdfs import KR_LIKE, opw_arm_urdf


@pytest.fixture(scope="module")
def courses():
    surface = cell_surface(example_cell("afp"))
    return surface, FibrePlacement().courses(surface, np.random.default_rng(1))


@pytest.fixture(scope="module")
def rings():
    surface = cell_surface(example_cell("machining"))
    return surface, Roughing().courses(surface, np.random.default_rng(1))


def test_courses_lie_on_the_mesh_with_the_tool_into_it(courses):
    surface, made = courses
    for course in made:
        middle = len(course.force) // 2
        point, z = course.T_base_tcp[middle, :3, 3], course.T_base_tcp[middle, :3, 2]
        hit, _, face = surface.rays.ray.intersects_location(
            (point - 0.1 * z)[None], z[None], multiple_hits=False
        )
        np.testing.assert_allclose(hit[0], point, atol=2e-4)
        assert surface.face_normals[face[0]] @ z < -0.999


def test_forces_of_placement_stay_within_the_load_cases(courses):
    for course in courses[1]:
        tcp = np.einsum("rji,rj->ri", course.T_base_tcp[:, :3, :3], course.force)
        assert np.abs(tcp[:, :2]).max() <= 280.0
        assert 1000.0 < -tcp[:, 2].min() < 1200.0
        np.testing.assert_allclose(tcp[[0, -1]], 0.0, atol=1e-9)


def test_lateral_is_square_to_travel_and_to_the_tool(courses):
    for course in courses[1]:
        forward = np.gradient(course.T_base_tcp[:, :3, 3], axis=0)
        forward /= np.linalg.norm(forward, axis=1, keepdims=True)
        assert np.abs(np.sum(course.direction * forward, axis=1)).max() < 0.02
        z = course.T_base_tcp[:, :3, 2]
        assert np.abs(np.sum(course.direction * z, axis=1)).max() < 1e-12


def test_a_surface_without_room_for_a_course_is_refused(courses):
    with pytest.raises(CompensationError, match="too small for course 1"):
        FibrePlacement(border=0.7).courses(courses[0], np.random.default_rng(1))


def test_rings_lie_on_the_dome_below_the_top_of_the_block(rings):
    surface, made = rings
    top = surface.mesh.vertices[:, 2].max()
    heights = [ring.T_base_tcp[:, 2, 3] for ring in made]
    assert all(np.ptp(height) < 1e-9 for height in heights)
    assert all(a[0] > b[0] for a, b in zip([[top], *heights], heights, strict=False))
    assert heights[-1][0] == pytest.approx(top - 0.06)


def test_the_speed_on_a_ring_is_seventy_millimetres_a_second(rings):
    for ring in rings[1]:
        steps = np.linalg.norm(np.diff(ring.T_base_tcp[:, :3, 3], axis=0), axis=1)
        np.testing.assert_allclose(steps / ring.step, 0.07, rtol=1e-3)


def test_cutting_forces_push_away_from_the_part_and_stay_within_the_load_cases(rings):
    for ring in rings[1]:
        assert np.sum(ring.force * ring.direction, axis=1).min() >= -1e-9
        tcp = np.einsum("rji,rj->ri", ring.T_base_tcp[:, :3, :3], ring.force)
        assert np.linalg.norm(tcp[:, :2], axis=1).max() < 707.0


def test_the_same_seed_makes_the_same_forces():
    time = np.linspace(0.0, 10.0, 400)
    same = [swing(time, np.random.default_rng(seed)) for seed in (3, 3, 4)]
    np.testing.assert_array_equal(same[0], same[1])
    assert np.abs(same[0] - same[2]).max() > 0.1
    assert np.abs(same[0]).max() <= 1.0


def test_a_force_begins_and_ends_at_nothing():
    share = engaged(np.linspace(0.0, 2.0, 201), 0.5)
    assert share[0] == share[-1] == 0.0
    np.testing.assert_allclose(share[50:151], 1.0)
    assert share[25] == pytest.approx(0.5)


@pytest.mark.parametrize("like", some_by_day(["machining", "afp"]))
def test_joints_reach_the_courses_but_for_one_turn_of_the_tool(like, courses, rings):
    cell, made = example_cell(like), (courses if like == "afp" else rings)[1][:2]
    with_joints = with_postures(cell, made)
    spins = []
    for course in with_joints:
        T = cell.robot.forward(course.q[::20])
        there = course.T_base_tcp[::20]
        np.testing.assert_allclose(T[:, :3, 3], there[:, :3, 3], atol=1e-8)
        np.testing.assert_allclose(T[:, :3, 2], there[:, :3, 2], atol=1e-8)
        spins.append(np.einsum("ri,ri->r", T[:, :3, 0], there[:, :3, 0]))
        assert np.abs(np.diff(course.q, axis=0)).max() < 0.05
    np.testing.assert_allclose(np.concatenate(spins), spins[0][0], atol=1e-7)


def test_courses_out_of_reach_are_refused_by_name(courses):
    far = courses[1][0]
    T = far.T_base_tcp.copy()
    T[:, 0, 3] += 9.0
    away = type(far)("course 1", far.step, T, far.force, far.direction)
    with pytest.raises(CompensationError, match="cannot follow course 1"):
        with_postures(example_cell("afp"), (away,))


def test_a_posture_is_judged_by_the_wrist_angle_and_not_by_joint_five(courses, monkeypatch):
    """The zero of joint 5 need not be where the wrist is straight."""
    offset = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, offsets=(0, 0, 0, 0, 0.5, 0)), "tcp")
    cell = replace(example_cell("machining"), robot=offset)
    straight = np.tile([0.1, -1.2, 1.4, 0.2, -0.5, 0.3], (3, 1))
    assert wrist_angle(offset, straight).max() < 1e-9
    monkeypatch.setattr(_Trial, "joints", lambda *_: straight)
    margin = _Trial(inverse_for(offset), cell).margin(courses[1][0], 0.0, np.zeros(0))
    assert margin == pytest.approx(-cell.file.limits.wrist_angle)
