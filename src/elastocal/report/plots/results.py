"""Pictures of results: what `plot` of a workflow's result shows."""

from functools import singledispatch

import matplotlib
from matplotlib.figure import Figure

from elastocal.errors import ReportError
from elastocal.identification import CalibrateResult
from elastocal.identification.recertification import CompareResult
from elastocal.report.plots import style
from elastocal.report.plots.calibration_figures import spring_bars, spring_figure
from elastocal.report.plots.recertification_figure import recertification_figure


def plot_result(result: object) -> Figure:
    """Return the figure of a result: compliances of a calibration, changes of a comparison.

    Raises
    ------
    ReportError
        If there is no picture of this kind of result.
    """
    with matplotlib.rc_context(style.print_settings()):
        return _draw(result)


@singledispatch
def _draw(result: object) -> Figure:
    raise ReportError(f"there is no picture of a {type(result).__name__}")


@_draw.register
def _calibration(result: CalibrateResult) -> Figure:
    return spring_figure(spring_bars(result.calibrated))


@_draw.register
def _comparison(result: CompareResult) -> Figure:
    return recertification_figure(result.summary)
