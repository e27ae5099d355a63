"""What every process keeps."""

import numpy as np
import pytest

from elastocal.compensation.process import PROCESSES
from elastocal.planning import cell_surface
from support.simulated import example_cell


@pytest.fixture(scope="module", params=PROCESSES)
def made(request):
    """Return a process, its surface and three courses of it."""
    process = PROCESSES[request.param](count=3)
    surface = cell_surface(example_cell(request.param))
    return process, surface, process.courses(surface, np.random.default_rng(7))


class TestEveryProcess:
    def test_there_are_as_many_courses_as_asked_for(self, made):
        assert len(made[2]) == 3
        assert len({course.name for course in made[2]}) == 3

    def test_rows_belong_together(self, made):
        for course in made[2]:
            rows = len(course.T_base_tcp)
            assert rows > 10
            assert course.force.shape == course.direction.shape == (rows, 3)

    def test_poses_are_rigid_and_directions_of_unit_length(self, made):
        for course in made[2]:
            R = course.T_base_tcp[:, :3, :3]
            np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2) - np.eye(3), 0.0, atol=1e-9)
            np.testing.assert_allclose(np.linalg.det(R), 1.0)
            # A path is a polyline: between its corners a normal is a little short.
            lengths = np.linalg.norm(course.direction, axis=1)
            np.testing.assert_allclose(lengths, 1.0, rtol=1e-5)

    def test_a_course_begins_and_ends_without_force(self, made):
        for course in made[2]:
            np.testing.assert_allclose(course.force[[0, -1]], 0.0, atol=1e-6)
            assert np.linalg.norm(course.force, axis=1).max() > 100.0

    def test_the_same_seed_makes_the_same_courses_and_another_makes_others(self, made):
        process, surface, courses = made
        same = process.courses(surface, np.random.default_rng(7))
        other = process.courses(surface, np.random.default_rng(8))
        for a, b, c in zip(courses, same, other, strict=True):
            np.testing.assert_array_equal(a.force, b.force)
            assert np.abs(a.force - c.force).max() > 1.0

    def test_its_compensator_corrects_in_base_with_filters_that_can_be_made(self, made):
        settings = made[0].compensator
        assert settings.frame == "base"
        assert settings.chain.delay() < settings.hold
