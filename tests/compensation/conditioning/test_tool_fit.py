import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import ToolModel, static_postures
from elastocal.compensation.conditioning.tool_fit import (
    TOOL_UNKNOWNS,
    fit_tool,
    tool_derivatives,
    tool_residual,
    tool_wrenches,
)
from elastocal.errors import CompensationError
from support.static_postures import PlantedTool, turned

TOOL = PlantedTool()
FREE = ToolModel(rotation=True)


def errors(fit, tool=TOOL):
    """Return the errors of a fit in the order of `TOOL_UNKNOWNS`."""
    rotation = Rotation.from_matrix(fit.R_flange_sensor.T @ tool.R_flange_sensor).as_rotvec()
    return np.array(
        [
            fit.mass - tool.mass,
            *rotation,
            *(fit.force_bias - tool.force_bias),
            *(fit.centre - tool.centre),
            *(fit.moment_bias - tool.moment_bias),
        ]
    )


def test_without_noise_the_planted_tool_is_found_exactly():
    rng = np.random.default_rng(0)
    fit = fit_tool(TOOL.raw(turned(6, rng), rng, noise=0.0), None, FREE)
    np.testing.assert_allclose(errors(fit), 0.0, atol=1e-9)
    assert fit.undetermined == ()


@pytest.mark.slow
@pytest.mark.parametrize("count", [6, 15])
def test_intervals_cover_planted_values_about_as_often_as_they_say(count):
    rng = np.random.default_rng(1)
    covered = []
    for _ in range(80):
        fit = fit_tool(TOOL.raw(turned(count, rng), rng), None, FREE)
        widths = np.array([fit.half_width[name] for name in TOOL_UNKNOWNS])
        covered.append(np.abs(errors(fit)) <= widths)
    assert 0.92 <= np.mean(covered) <= 0.98
    assert np.mean(covered, axis=0).min() >= 0.87


def test_scatter_is_that_of_the_noise():
    rng = np.random.default_rng(2)
    fit = fit_tool(TOOL.raw(turned(200, rng), rng), None, FREE)
    assert fit.force_scatter == pytest.approx(0.5, rel=0.1)
    assert fit.moment_scatter == pytest.approx(0.05, rel=0.1)


def test_equal_postures_determine_nothing():
    rng = np.random.default_rng(3)
    fit = fit_tool(TOOL.raw(np.repeat(turned(1, rng), 6, axis=0), rng), None, FREE)
    assert fit.undetermined == TOOL_UNKNOWNS
    assert all(np.isnan(width) for width in fit.half_width.values())


def test_too_similar_postures_name_what_they_do_not_determine():
    rng = np.random.default_rng(4)
    fit = fit_tool(TOOL.raw(turned(5, rng, angle=0.01), rng), TOOL.R_flange_sensor, FREE)
    assert {"force bias y", "sensor rotation about x", "moment bias x"} <= set(fit.undetermined)
    assert np.isnan(fit.half_width["force bias y"])


def test_a_turn_about_the_vertical_alone_leaves_mass_and_bias_along_it_open():
    rng = np.random.default_rng(5)
    spin = Rotation.from_euler("z", rng.uniform(0, 6, (8, 1))).as_matrix()
    fit = fit_tool(TOOL.raw(spin, rng), TOOL.R_flange_sensor)
    assert "mass" in fit.undetermined


def test_a_known_rotation_leaves_less_open():
    rng = np.random.default_rng(4)
    postures = TOOL.raw(turned(5, rng, angle=0.01), rng)
    free = fit_tool(postures, TOOL.R_flange_sensor, FREE)
    known = fit_tool(postures, TOOL.R_flange_sensor)
    np.testing.assert_array_equal(known.R_flange_sensor, TOOL.R_flange_sensor)
    assert known.half_width["sensor rotation about z"] == 0.0
    assert set(known.undetermined) < set(free.undetermined)


def test_a_gravity_that_points_elsewhere_is_no_matter():
    rng = np.random.default_rng(7)
    postures = TOOL.raw(turned(8, rng), rng, noise=0.0)
    tilt = Rotation.from_euler("xyz", [0.4, 1.0, 0.2]).as_matrix()
    tilted = static_postures(
        tilt @ postures.R_base_flange, postures.force, postures.moment, tilt @ postures.gravity
    )
    np.testing.assert_allclose(errors(fit_tool(tilted, None, FREE)), 0.0, atol=1e-9)


def test_residuals_are_what_the_fit_leaves():
    rng = np.random.default_rng(8)
    postures = TOOL.raw(turned(8, rng), rng)
    force, moment = tool_residual(postures, fit_tool(postures, None, FREE))
    assert np.sqrt((force**2).mean()) < 0.7
    assert np.sqrt((moment**2).mean()) < 0.07


def test_derivatives_are_those_of_the_wrenches():
    rng = np.random.default_rng(9)
    postures, values = TOOL.raw(turned(3, rng), rng), rng.normal(size=13)
    values[1:4] = 0.0
    J = tool_derivatives(postures, values, TOOL.R_flange_sensor)
    for k in range(13):
        ends = []
        for sign in (1.0, -1.0):
            moved, R = values.copy(), TOOL.R_flange_sensor
            if k in (1, 2, 3):
                R = R @ Rotation.from_rotvec(sign * 1e-6 * np.eye(3)[k - 1]).as_matrix()
            else:
                moved[k] += sign * 1e-6
            ends.append(tool_wrenches(postures, moved, R))
        np.testing.assert_allclose(J[:, :, k], (ends[0] - ends[1]) / 2e-6, atol=1e-6)


def test_two_postures_are_refused():
    with pytest.raises(CompensationError, match=r"2 postures: .* needs at least 3"):
        static_postures(np.array([np.eye(3)] * 2), np.zeros((2, 3)), np.zeros((2, 3)))


def test_a_wrench_that_is_not_finite_is_refused():
    with pytest.raises(CompensationError, match="moment of the postures holds"):
        static_postures(np.array([np.eye(3)] * 3), np.zeros((3, 3)), np.full((3, 3), np.nan))
