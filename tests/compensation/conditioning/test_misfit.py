"""Postures that no tool explains are refused with the reason, and sound ones are not."""

import numpy as np
import pytest

from elastocal.compensation.conditioning import ToolModel, refuse_mistakes
from elastocal.compensation.conditioning.tool_fit import fit_tool
from elastocal.errors import CompensationError
from support.static_postures import PlantedTool, turned

TOOL = PlantedTool()


def raw(count=10, tool=TOOL, noise=1.0):
    rng = np.random.default_rng(0)
    return tool.raw(turned(count, rng), rng, noise)


def check(postures, nominal=None, known=False, **given):
    refuse_mistakes(
        postures, fit_tool(postures, nominal, ToolModel(rotation=not known)), nominal, **given
    )


@pytest.mark.parametrize("what", ["force", "moment"])
def test_a_spoilt_posture_is_named(what):
    postures = raw()
    values = getattr(postures, what).copy()
    values[4] += 500.0 if what == "force" else 60.0
    with pytest.raises(CompensationError, match="posture 5 does not fit the others"):
        check(postures.read_as(**{what: values}))


def test_two_spoilt_postures_are_a_misfit():
    postures = raw()
    force = postures.force.copy()
    force[2] += 300.0
    force[7] -= 300.0
    with pytest.raises(CompensationError, match=r"the postures do not fit one tool: .* N are left"):
        check(postures.read_as(force=force), TOOL.R_flange_sensor, known=True)


def test_a_rotation_that_is_not_as_mounted_is_named_with_its_angle():
    with pytest.raises(CompensationError, match=r"it sits 30\.\d deg from there; correct it"):
        check(raw(), np.eye(3), known=True)


def test_the_mounted_rotation_passes_when_it_is_right():
    check(raw(), TOOL.R_flange_sensor, known=True)


def test_forces_in_another_unit_are_a_mass_that_no_robot_carries():
    postures = raw()
    with pytest.raises(CompensationError, match="more than a robot carries"):
        check(postures.read_as(1e3 * postures.force, 1e3 * postures.moment))


@pytest.mark.parametrize("seed", range(10))
def test_a_light_tool_on_a_noisy_sensor_passes(seed):
    rng = np.random.default_rng(seed)
    tool = PlantedTool(mass=rng.uniform(0.2, 3.0))
    check(tool.raw(turned(10, rng), rng, noise=4.0), TOOL.R_flange_sensor)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_sensor_that_carries_nothing_is_no_mistake(noise):
    check(raw(tool=PlantedTool(mass=0.0), noise=noise))


@pytest.mark.parametrize("seed", range(5))
def test_cross_talk_of_two_percent_passes(seed):
    rng = np.random.default_rng(seed)
    postures = TOOL.raw(turned(10, rng), rng)
    mixed = np.hstack([postures.force, postures.moment])
    mixed[:, :3] += 0.02 * postures.force[:, [1, 2, 0]]
    check(postures.read_as(mixed[:, :3], mixed[:, 3:]))


def test_moments_of_the_other_sign_are_named_where_the_centre_is_known():
    postures = raw()
    with pytest.raises(CompensationError, match="sign of the moments is turned"):
        check(postures.read_as(moment=-postures.moment), expected_centre=TOOL.centre)
