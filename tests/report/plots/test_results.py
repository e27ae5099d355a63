"""Pictures of results, as a notebook asks for them."""

import numpy as np
import pytest

from elastocal.compensation.offline import CorrectionFigures, LengthStatistics
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import ReportError
from elastocal.identification import CalibrateResult, calibrate
from elastocal.report import plot_result
from support.cells import Cell, linear_truth, robot
from support.plans import plan


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


def test_a_plan_shows_every_pose_from_above_and_from_the_side():
    figure = plan().plot()
    numbers = [str(pose.id) for pose in plan().poses]
    assert [[text.get_text() for text in axes.texts] for axes in figure.axes] == [numbers] * 2


def test_readings_are_shaded_by_pose_and_load_case(result):
    measured = Cell(linear_truth(), poses=8).measure()
    (axes,) = plot_result(measured).axes
    assert axes.images[0].get_array().shape == (len(measured.load_cases), len(measured.poses))


def test_a_prediction_shows_each_component_by_row(result):
    readings = Cell(linear_truth(), poses=8).readings()
    found = result.calibrated.predict(readings.joint_position, readings.force)
    figure = plot_result(found)
    for number, axes in enumerate(figure.axes):
        np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e3 * found.deflection[:, number])


def test_a_correction_is_drawn_in_decades_from_mean_to_largest():
    lengths = [LengthStatistics(10.0**-k, 2.0 * 10.0**-k, "row 1") for k in (3, 6, 9, 3)]
    (axes,) = plot_result(CorrectionFigures(5, *lengths, 0, "", 0)).axes
    assert axes.get_xscale() == "log"
    assert [text.get_text() for text in axes.texts][:3] == [
        "1 / 2",
        "0.001 / 0.002",
        "1e-06 / 2e-06",
    ]
