"""Pictures of results, as a notebook asks for them."""

from dataclasses import replace

import numpy as np
import pytest

from elastocal.compensation.offline import CorrectionFigures
from elastocal.compensation.offline.summary import LengthStatistics
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import ReportError
from elastocal.geometry import GeometryAccuracy
from elastocal.geometry.accuracy import AxisErrors, ErrorFigures
from elastocal.identification import CalibrateResult, calibrate, summary
from elastocal.report import error_maps
from elastocal.report.plots.results import plot_result
from support.cells import Cell, linear_truth, robot
from support.plans import plan


@pytest.fixture(scope="module")
def result():
    model = ElasticModel(robot(), layout(robot(), "bearing"))
    readings = Cell(linear_truth(), poses=8).readings()
    found = calibrate(model, readings, np.random.default_rng(0))
    return CalibrateResult.of(found.calibrated, summary(found))


def titles(figure):
    """Return what stands above a figure."""
    return [text.get_text() for text in figure.texts]


@pytest.mark.slow
def test_a_calibration_shows_every_spring(result):
    (axes,) = result.plot().axes
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == [parameter.name for parameter in result.calibrated.model.parameters]
    assert axes.get_xlabel().startswith("compliance in µrad/(N·m)")


def test_a_calibration_says_what_it_is_of_and_its_error_at_left_out_poses(result):
    title, about = titles(result.plot())
    figures = result.calibration
    assert title == f"{result.robot.name}: 18 springs"
    assert f"{figures.readings} readings at 8 poses" in about
    assert f"left-out poses {1e3 * figures.held_out.mean:.3f} mm mean" in about
    unknown = replace(result, calibration=None)
    assert titles(unknown.plot())[1] == "how it was calibrated is not known"


def test_a_result_without_a_picture_is_refused_by_its_kind():
    with pytest.raises(ReportError, match="there is no picture of a dict"):
        plot_result({})


def test_a_plan_shows_every_pose_from_above_and_from_the_side():
    figure = plan().plot()
    numbers = [str(pose.id) for pose in plan().poses]
    assert [[text.get_text() for text in axes.texts] for axes in figure.axes] == [numbers] * 2
    assert titles(figure)[1].startswith(f"chosen from {plan().pool.valid} candidates")


def test_readings_are_shaded_by_pose_and_load_case(result):
    measured = Cell(linear_truth(), poses=8).measure()
    (axes,) = measured.plot().axes
    assert axes.images[0].get_array().shape == (len(measured.load_cases), len(measured.poses))
    assert axes.get_title("left").endswith(f"mm: {int(measured.usable.sum())} usable readings")


def test_readings_are_a_table_in_a_notebook_in_which_no_name_is_markup():
    measured = Cell(linear_truth(), poses=8).measure()
    named = replace(measured, attributes={**measured.attributes, "robot_name": "<b>&"})
    html = named._repr_html_()
    assert ">&lt;b&gt;&amp;</td>" in html
    assert f">{int(measured.usable.sum())} usable of {measured.usable.size}, at 8 poses<" in html


def test_a_prediction_shows_each_component_by_row(result):
    readings = Cell(linear_truth(), poses=8).readings()
    found = result.calibrated.predict(readings.joint_position, readings.force)
    figure = found.plot()
    for number, axes in enumerate(figure.axes):
        np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e3 * found.deflection[:, number])
        measured, fit = (np.ptp(band.get_paths()[0].vertices[:, 1]) for band in axes.collections)
        assert measured > fit
    assert titles(figure)[0].endswith(f"{len(found.deflection)} rows")


def test_a_prediction_is_a_table_with_both_intervals(result):
    readings = Cell(linear_truth(), poses=8).readings()
    found = result.calibrated.predict(readings.joint_position, readings.force)
    html = found._repr_html_()
    assert f">{len(found.deflection)}, predicted<" in html
    assert "95 % interval of a measurement" in html
    unsure = replace(found, measured_low=np.full_like(found.low, np.nan))
    assert "not known, as the misfit" in repr(unsure)
    assert "95 % interval of the fit: ±" in repr(unsure)


def test_maps_of_a_geometry_say_how_many_positions_were_left_out_of_which_fit():
    before, after = (ErrorFigures(0.0, mean, mean, mean, 2 * mean) for mean in (1e-3, 5e-5))
    place, error = np.eye(3), np.full((3, 3), 1e-4)
    label = np.arange(3)
    axes = (AxisErrors("norm", before, after),)
    accuracy = GeometryAccuracy(label, label, place, error, error, axes, (), ())
    title, about = titles(error_maps(accuracy, "KR"))
    assert title == "KR"
    assert about == (
        "3 positions, each at a pose that was left out of its fit: 1.000 mm mean error before,"
        " 0.050 mm after (2.000 mm and 0.100 mm at most)"
    )
    assert not titles(error_maps(accuracy))


def test_a_correction_is_drawn_in_decades_from_mean_to_largest():
    lengths = [LengthStatistics(10.0**-k, 2.0 * 10.0**-k, "row 1") for k in (3, 6, 9, 3)]
    figure = plot_result(CorrectionFigures(5, *lengths, 0, "", 0))
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    assert titles(figure)[1].startswith("by the model that corrects; nothing was measured")
    assert [text.get_text() for text in axes.texts][:3] == [
        "1 / 2",
        "0.001 / 0.002",
        "<0.001 / <0.001",
    ]
