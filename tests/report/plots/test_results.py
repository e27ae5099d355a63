"""Pictures of results, as a notebook asks for them."""

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, layout
from elastocal.errors import ReportError
from elastocal.identification import CalibrateResult, calibrate
from elastocal.report import plot_result
from support.cells import Cell, linear_truth, robot


@pytest.fixture(scope="module")
def result():
    model = ElasticModel(robot(), layout(robot(), "bearing"))
    readings = Cell(linear_truth(), poses=8).readings()
    return CalibrateResult.of(calibrate(model, readings, np.random.default_rng(0)).calibrated)


def test_a_calibration_shows_every_spring(result):
    (axes,) = result.plot().axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == [parameter.name for parameter in result.calibrated.model.parameters]
    assert axes.get_xlabel().startswith("compliance in µrad/(N·m)")


def test_a_result_without_a_picture_is_refused_by_its_kind():
    with pytest.raises(ReportError, match="there is no picture of a dict"):
        plot_result({})
