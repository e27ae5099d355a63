from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import SENSOR_CORRECTED
from elastocal.compensation.online import design
from elastocal.compensation.online.design import draws_factor
from elastocal.errors import CompensationError
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
