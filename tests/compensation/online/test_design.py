import re
from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import SENSOR_CORRECTED
from elastocal.compensation.online import Compensator, Reading, design
from elastocal.elastic import ElasticModel
from elastocal.errors import CompensationError
from elastocal.identification import draws_factor
from elastocal.robot import Robot
from support.compensated import arm, load


def test_the_factor_squared_is_the_draws_covariance():
    draws = np.random.default_rng(0).normal(size=(40, 5)) * [1.0, 2.0, 3.0, 0.0, 5.0]
    factor = draws_factor(draws)
    np.testing.assert_allclose(factor @ factor.T, np.cov(draws.T), atol=1e-12)
    assert factor.shape == (5, 4)


def test_draws_that_are_all_equal_make_no_interval():
    factor = draws_factor(np.ones((10, 3)))
    assert factor.shape == (3, 1)
    assert not factor.any()


@pytest.mark.parametrize("value", [np.nan, np.inf, 2.0])
def test_a_compliance_that_is_none_is_refused_by_spring(value):
    compliance = arm().compliance.copy()
    compliance[3] = value
    name = arm().model.spring_names[3]
    with pytest.raises(CompensationError, match=f"compliance of spring {name} is {value:g}"):
        design(replace(arm(), compliance=compliance))


def test_a_spring_that_moves_against_its_load_is_refused():
    compliance = arm().compliance.copy()
    compliance[3] = -1e-6
    name = arm().model.spring_names[3]
    with pytest.raises(CompensationError, match=f"compliance of spring {name} is -1e-06 rad"):
        design(replace(arm(), compliance=compliance))


def test_a_draw_that_is_none_is_refused_by_spring():
    draws = arm().draws.copy()
    draws[7, 2] = np.nan
    with pytest.raises(CompensationError, match=r"a draw of spring joint_3\.axial is nan"):
        design(replace(arm(), draws=draws))


def test_a_matrix_that_the_models_run_was_derived_without_is_refused():
    of_a_run = replace(arm(), provenance="elastocal run r1, simulated")
    with pytest.raises(CompensationError, match="the model is of a run without it"):
        design(of_a_run, None, load())
    corrected = replace(of_a_run, provenance=f"elastocal run r1, simulated, {SENSOR_CORRECTED}")
    assert design(corrected, None, load()).load.has_matrix


def test_the_largest_arm_that_is_allowed_is_corrected_by_numbers():
    urdf, moved = re.subn(r'(<origin\s+xyz=)"[^"]*"', r'\1"999 -999 999"', arm().model.robot.urdf)
    assert moved > 2
    model = ElasticModel(Robot.from_urdf(urdf, arm().model.robot.tip), arm().model.springs)
    n = len(arm().compliance)
    largest = replace(arm(), model=model, compliance=np.ones(n), draws=np.ones((50, n)))
    sensor = replace(load(), mass=1e6, centre=np.full(3, 0.3), response=np.full((6, 3), 1e6))
    compensator = Compensator(design(largest, None, sensor))
    state = compensator.start()
    for time in (0.004, 0.008, 0.012):
        reading = Reading(time, [1.0] * len(model.robot.joint_names), [9e4] * 3, [9e4] * 3)
        state, told = compensator.step(state, reading)
    assert np.all(np.isfinite([*told.correction, *told.deflection, told.half_width]))
    assert 0.0 < np.linalg.norm(told.correction) <= 3e-3
