"""Stiffness of postures: the measure, the survey, the choice, and the cell's say in it."""

import numpy as np
import pytest

from elastocal.compensation import (
    PostureConstraint,
    PostureGrid,
    cell_constraints,
    choose_postures,
    directional_stiffness,
    read_stations,
    survey_postures,
)
from elastocal.compensation.posture_survey import joint_limit_constraint, principal_stiffness
from elastocal.errors import PathError
from elastocal.identification import CalibratedModel
from elastocal.robot import Robot
from elastocal.robot.inverse import inverse_for, joints_along_path
from elastocal.robot.inverse.numerical import NumericalInverse
from elastocal.sim.arm.measurement import START
from support.cells import rich_truth, robot
from support.paths import calibrated, dome_course, euler_columns, made_up, write_csv
from support.simulated import example_cell, places
from support.urdfs import KR_LIKE, opw_arm_urdf

SOLVER = inverse_for(robot())
COURSE = dome_course(7)
NORMAL = COURSE[:, :3, 2]
BEAM = {
    "name": "beam",
    "box": {"size": ["0.2 m", "6 m", "0.2 m"]},
    "pose": {"xyz": ["0.9 m", "0 m", "2 m"]},
}
"""Across the cell, where the elbow would be."""
NOWHERE = np.zeros((1, 0))
SPINS = np.radians(np.arange(0.0, 360.0, 30.0))
Q = np.array([[0.1, -1.2, 1.9, 0.4, 0.9, 0.3], [0.5, -0.9, 1.5, -0.4, -0.9, 1.3]])


@pytest.fixture(scope="module")
def surveyed():
    return survey_postures(calibrated(), SOLVER, COURSE, NORMAL, PostureGrid(SPINS, NOWHERE))


class TestDirectional:
    def test_it_is_force_over_deflection_along_the_force(self):
        u = np.array([0.6, 0.0, 0.8])
        model = calibrated()
        deflection = model.model.deflection(model.compliance, Q, 700.0 * u)
        found = directional_stiffness(model, Q, u)
        np.testing.assert_allclose(found.stiffness, 700.0 / (deflection @ u), rtol=1e-12)
        assert np.all((found.low < found.stiffness) & (found.stiffness < found.high))

    def test_the_arm_itself_is_as_stiff_to_a_few_percent(self):
        q = joints_along_path(SOLVER, COURSE, np.zeros((len(COURSE), 0)), np.array(START), str)
        moved = rich_truth().equilibrium(q, -1100.0 * NORMAL).deflection
        truth = 1100.0 / -np.sum(moved * NORMAL, axis=1)
        found = directional_stiffness(calibrated(), q, NORMAL).stiffness
        np.testing.assert_allclose(found, truth, rtol=0.03)

    def test_springs_that_cannot_be_told_apart_do_not_matter(self):
        own = calibrated()
        groups = own.observability.unobservable
        assert groups
        names = own.model.spring_names
        shift = np.zeros(len(names))
        for term in groups[0]:
            shift[names.index(term.spring)] = term.weight
        moved = own.compliance + 1e-6 * shift
        other = CalibratedModel(own.model, moved, own.draws, own.observability)
        u = np.array([0.0, 0.6, 0.8])
        np.testing.assert_allclose(
            directional_stiffness(other, Q, u).stiffness,
            directional_stiffness(own, Q, u).stiffness,
            rtol=1e-6,
        )

    def test_a_principal_axis_is_as_stiff_as_its_principal_stiffness(self):
        found = principal_stiffness(calibrated(), Q)
        assert np.all(np.diff(found.stiffness, axis=1) > 0.0)
        for number in range(3):
            k = directional_stiffness(calibrated(), Q, found.axes[:, :, number]).stiffness
            np.testing.assert_allclose(k, found.stiffness[:, number], rtol=1e-9)

    def test_no_direction_is_softer_than_the_first_or_stiffer_than_the_third(self):
        found = principal_stiffness(calibrated(), Q)
        rng = np.random.default_rng(0)
        for u in rng.normal(size=(20, 3)):
            k = directional_stiffness(calibrated(), Q, u / np.linalg.norm(u)).stiffness
            assert np.all(k >= found.stiffness[:, 0] * (1 - 1e-9))
            assert np.all(k <= found.stiffness[:, 2] * (1 + 1e-9))


class TestSurvey:
    def test_every_posture_reaches_the_spun_pose(self, surveyed):
        station, spin = 3, 4
        angle = SPINS[spin]
        x, y = COURSE[station, :3, 0], COURSE[station, :3, 1]
        for q in surveyed.q[station, spin, 0]:
            T = robot().forward(q)
            np.testing.assert_allclose(T[:3, 3], COURSE[station, :3, 3], atol=1e-9)
            expected = np.cos(angle) * x + np.sin(angle) * y
            np.testing.assert_allclose(T[:3, 0], expected, atol=1e-9)
            np.testing.assert_allclose(T[:3, 2], NORMAL[station], atol=1e-9)

    def test_its_stiffness_is_that_of_the_posture(self, surveyed):
        q = surveyed.q[2, 5, 0]
        k = directional_stiffness(calibrated(), q, NORMAL[2]).stiffness
        np.testing.assert_allclose(surveyed.stiffness[2, 5, 0], k, rtol=1e-12)
        assert surveyed.best_by_spin[2, 5] == k.max()

    def test_a_permit_takes_postures_out_and_is_counted(self, surveyed):
        constraint = PostureConstraint("elbow up", lambda q: q[:, 2] > 0.0)
        found = survey_postures(
            calibrated(), SOLVER, COURSE, NORMAL, PostureGrid(SPINS, NOWHERE), (constraint,)
        )
        out = np.isnan(found.stiffness) & ~np.isnan(surveyed.stiffness)
        assert found.refused["elbow up"] == out.sum() > 0
        assert np.all(surveyed.q[out][:, 2] <= 0.0)
        margin = joint_limit_constraint(robot(), np.full(6, 0.2))
        near = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 3.0], [0.0, 0.0, 0.0, 0.0, 0.0, 2.9]])
        assert margin.allows(near).tolist() == [False, True]

    def test_a_survey_too_large_is_refused(self):
        with pytest.raises(PathError, match="postures: at most"):
            survey_postures(
                calibrated(), SOLVER, COURSE, NORMAL, PostureGrid(np.zeros(10**6), NOWHERE)
            )

    def test_a_rail_is_part_of_the_choice(self):
        arm = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, rail=(-2.0, 2.0)), "tcp")
        T = arm.forward(np.array([[0.2, 0.1, 0.6, 0.9, 0.2, 0.8, 0.0]]))
        stands = np.linspace(-2.0, 2.0, 5)[:, None]
        found = survey_postures(
            made_up(arm), inverse_for(arm), T, T[:, :3, 2], PostureGrid(SPINS, stands)
        )
        reached = ~np.isnan(found.best_by_external[0])
        assert reached.any()
        for stand in np.flatnonzero(reached):
            rails = found.q[0, :, stand, :, 0]
            np.testing.assert_array_equal(rails[np.isfinite(rails)], stands[stand, 0])


class TestChoice:
    def test_one_posture_is_the_stiffest_where_it_is_softest(self, surveyed):
        found = choose_postures(surveyed, SOLVER).one
        k = directional_stiffness(calibrated(), found.q, NORMAL).stiffness
        softest = np.where(np.isnan(surveyed.stiffness), -np.inf, surveyed.stiffness).min(axis=0)
        assert k.min() == pytest.approx(softest.max(), rel=1e-12)
        assert len(set(found.spin)) == 1

    def test_at_each_station_none_is_stiffer(self, surveyed):
        found = choose_postures(surveyed, SOLVER)
        k = directional_stiffness(calibrated(), found.each.q, NORMAL).stiffness
        np.testing.assert_allclose(k, np.nanmax(surveyed.best_by_spin, axis=1), rtol=1e-12)
        assert np.all(
            k >= directional_stiffness(calibrated(), found.one.q, NORMAL).stiffness * (1 - 1e-12)
        )

    def test_where_no_posture_holds_along_the_path_there_is_none(self):
        far = COURSE.copy()
        far[2, :3, 3] *= 3.0
        found = survey_postures(calibrated(), SOLVER, far, NORMAL, PostureGrid(SPINS, NOWHERE))
        choice = choose_postures(found, SOLVER)
        assert choice.one is None
        assert np.isnan(choice.each.q[2]).all()
        assert np.isfinite(choice.each.q[[0, 1, 3]]).all()

    def test_branches_of_the_numerical_solver_are_not_taken_to_go_on(self):
        solver = NumericalInverse(robot(), seed=0, reason="for a test")
        found = survey_postures(
            calibrated(), solver, COURSE[:2], NORMAL[:2], PostureGrid(SPINS[:1], NOWHERE)
        )
        choice = choose_postures(found, solver)
        np.testing.assert_array_equal(choice.one.q, choice.each.q)


class TestStations:
    def test_they_are_spread_evenly_and_named_by_line(self, tmp_path):
        path = write_csv(tmp_path / "p.csv", euler_columns(dome_course(101)))
        found = read_stations(path, SOLVER, 5, np.array(START))
        assert found.lines == (2, 27, 52, 77, 102)
        np.testing.assert_allclose(robot().forward(found.q), found.T_base_tcp, atol=1e-9)
        assert found.arc_length[0] == 0.0
        assert 0.8 < found.arc_length[-1] < 0.85
        assert len(read_stations(path, SOLVER, 1000, np.array(START))) == 101

    def test_no_station_is_refused(self, tmp_path):
        path = write_csv(tmp_path / "p.csv", euler_columns(COURSE))
        with pytest.raises(PathError, match="0 stations"):
            read_stations(path, SOLVER, 0, None)


class TestCell:
    def test_postures_that_touch_a_fixture_are_refused(self):
        cell = example_cell("afp", fixtures=[BEAM])
        constraints = {constraint.name: constraint for constraint in cell_constraints(cell)}
        assert set(constraints) == {"joint margin", "singularity", "collision"}
        q = np.array([place.q for place in places("afp", 2)])
        solver = inverse_for(cell.robot)
        T = cell.robot.forward(q)
        grid = PostureGrid(np.radians([0.0, 120.0, 240.0]), cell.external_positions[::6])
        found = survey_postures(
            made_up(cell.robot), solver, T, T[:, :3, 2], grid, tuple(constraints.values())
        )
        assert found.refused["collision"] > 0
        assert np.isfinite(found.best_by_spin).any()
        inside = found.q[~np.isnan(found.stiffness)]
        assert constraints["collision"].allows(inside).all()
