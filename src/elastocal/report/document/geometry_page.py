"""The report of a calibrated geometry: one HTML file that runs no script."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.files import write_text
from elastocal.geometry import GeometryAccuracy, GeometryModel, LinkNumber
from elastocal.report.document import blocks
from elastocal.report.pages import render
from elastocal.report.plots import MANY_POSITIONS, error_maps, parameter_figure
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T
from elastocal.wording import counted, mm, point

REPORT_TITLE = "Geometry report"
"""How the title of every such page begins."""
_MOST_ROWS = 200
_DEGREES = float(np.degrees(1.0))
_AXES = {"x": "x of the base", "y": "y of the base", "z": "z of the base", "norm": "distance"}
_SHOWN = {
    "m": (1e3, "mm", 3),
    "rad": (1e3, "mrad", 3),
    "rad/(N*m)": (1e6, "µrad/(N·m)", 3),
    "m/N": (1e6, "µm/N", 3),
    "1": (1e6, "ppm", 0),
}
"""Factor, unit and digits in which numbers are shown."""
_LINKS = (
    "A link goes from its joint's axis to the next by Rz(theta + q) Tz(d) Tx(a) Rx(alpha) (Denavit"
    " and Hartenberg, distal frames). Where both axes are parallel as drawn, Ry(beta) follows and d"
    " stays as drawn (Hayati): it goes together with the d of other links. z is the joint's axis in"
    " the sense in which it turns; the first link begins in the first joint's frame. Numbers"
    " without an interval are as drawn, or go together with others."
)


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryFindings:
    """What a report of a geometry shows."""

    model: GeometryModel
    accuracy: GeometryAccuracy
    links: tuple[LinkNumber, ...]


def write_geometry_page(path: Path, found: GeometryFindings) -> Path:
    """Write the page, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    found : GeometryFindings
        What it shows.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    model = found.model
    sections = [
        (identifier, title, tuple(show(found)))
        for identifier, title, show in (
            ("result", "Before and after", _result),
            ("maps", "Where in the workspace", _maps),
            ("iso", "Pose accuracy and repeatability (ISO 9283)", _iso),
            ("errors", "Which errors are known, and how well", _errors),
            ("links", "Denavit-Hartenberg table", _links),
            ("blunders", "Positions left out", _blunders),
            ("frames", "Stations, markers, provenance", _frames),
        )
    ]
    page = render(
        "geometry.html",
        title=f"{REPORT_TITLE}: {model.robot.name}",
        subtitle=f"{counted(model.positions, 'position')} of markers, {model.provenance}. Errors"
        " are those at poses that were left out of the fit.",
        styles=("page.css",),
        scripts=(),
        data={},
        sections=sections,
        version=__version__,
    )
    write_text(path, page)
    return Path(path)


def _result(found: GeometryFindings) -> Iterator[blocks.Block]:
    model, accuracy = found.model, found.accuracy
    before, after = model.held_out.registration, model.held_out.chosen
    known = sum(each.known for each in model.parameters)
    yield blocks.Facts(
        (
            ("Nominal arm, mean error", mm(before.mean)),
            ("Calibrated, mean error", mm(after.mean)),
            ("Calibrated, 95 % of errors below", mm(after.p95)),
            ("Calibrated, largest error", mm(after.max)),
            ("Model", next(each.rung for each in model.ladder if each.chosen)),
            ("Errors of the arm known", f"{known} of {len(model.parameters)}"),
        )
    )
    yield blocks.Bullets(model.findings, "reasons")
    rows: list[blocks.Row] = []
    for each in accuracy.axes:
        for when, figures in (("before", each.registration), ("after", each.chosen)):
            bias = "" if each.axis == "norm" else f"{1e3 * figures.bias:+.3f}"
            values = (figures.mean, figures.rms, figures.p95, figures.max)
            rows.append((_AXES[each.axis], when, bias, *(f"{1e3 * v:.3f}" for v in values)))
    heads = ("Along", "", "Bias", "Mean size", "Root mean square", "95 % below", "Largest")
    yield blocks.Table("Errors by axis in mm, of poses left out", heads, tuple(rows), texts=2)
    yield blocks.Table(
        "Models at the same left-out poses, mm",
        ("Model", "Unknowns", "Mean", "95 % below", "Largest", ""),
        tuple(
            (
                each.rung,
                each.unknowns,
                *(f"{1e3 * value:.3f}" for value in vars(each.held_out).values()),
                "taken" if each.chosen else "",
            )
            for each in model.ladder
        ),
    )


def _maps(found: GeometryFindings) -> Iterator[blocks.Block]:
    accuracy = found.accuracy
    many = len(accuracy.row) > MANY_POSITIONS
    before, after = (each.mean for each in vars(found.model.held_out).values())
    yield blocks.Picture(
        partial(error_maps, accuracy),
        f"Positions in the base of the robot, coloured by their error: {mm(before)} mean before,"
        f" {mm(after)} after",
        ("Means over cells of the map, of all" if many else "All")
        + " positions that were fitted, where their marker was measured, in the base of the robot."
        " Before and after have one scale, which ends where 98 % of the errors before lie below;"
        " enlarged is what is left, on a scale of its own.",
    )


def _iso(found: GeometryFindings) -> Iterator[blocks.Block]:
    poses = found.accuracy.poses
    if not poses:
        norm = found.accuracy.axes[-1]
        yield blocks.Paragraph(
            "No repeated visits: no pose was visited twice by one station under one load, so"
            " repeatability (RP) is not known. Pose accuracy (AP) of single visits is the distance"
            f" above: {mm(norm.registration.mean)} mean and {mm(norm.registration.max)} at most"
            f" before, {mm(norm.chosen.mean)} and {mm(norm.chosen.max)} after."
        )
        return
    worst = max(poses, key=lambda each: each.repeatability)
    yield blocks.Facts(
        (
            ("AP before, mean", mm(sum(each.registration for each in poses) / len(poses))),
            ("AP before, largest", mm(max(each.registration for each in poses))),
            ("AP after, mean", mm(sum(each.chosen for each in poses) / len(poses))),
            ("AP after, largest", mm(max(each.chosen for each in poses))),
            ("RP, mean", mm(sum(each.repeatability for each in poses) / len(poses))),
            ("RP, largest", mm(worst.repeatability)),
        )
    )
    fewest = min(each.visits for each in poses)
    yield blocks.Paragraph(
        "After ISO 9283:1998, 7.2, from the visits of one commanded pose under one load: AP is the"
        " distance of their barycentre from where the pose was expected, RP the mean distance from"
        " the barycentre plus three standard deviations."
        f" {counted(len(poses), 'pose')} with at least {counted(fewest, 'visit')}; the standard"
        " asks for 30 visits of five poses at stated speed and load, which the table does not say."
        " Where joints are those measured at the time, and not commanded, the scatter of the drives"
        " is not in RP.", "sub",
    )  # fmt: skip
    rows: tuple[blocks.Row, ...] = tuple(
        (
            f"row {each.row}",
            each.station,
            each.marker,
            each.visits,
            *(f"{1e3 * v:.3f}" for v in (each.registration, each.chosen, each.repeatability)),
        )
        for each in sorted(poses, key=lambda each: -each.repeatability)[:_MOST_ROWS]
    )
    heads = ("Pose first at", "Station", "Marker", "Visits", "AP before", "AP after", "RP")
    table = blocks.Table("By pose in mm, the least repeatable first", heads, rows, texts=2)
    yield blocks.Details(f"All poses ({len(rows)})", (table,), "long")


def _errors(found: GeometryFindings) -> Iterator[blocks.Block]:
    model = found.model
    if not model.parameters:
        yield blocks.Paragraph("The nominal arm was kept: the positions speak for no error of it.")
        return
    yield blocks.Picture(
        partial(parameter_figure, model.parameters),
        f"{counted(len(model.parameters), 'error')} of the arm with 95 % intervals",
        "Filled: known, its 95 % interval is narrower than what one would guess without measuring"
        " (1 mm, 1 mrad). Hollow: not known. Intervals: blocks of poses drawn with replacement.",
    )
    rows = tuple(
        (each.name, "known" if each.known else "not known", *_number(each.value, each.unit),
         _span(each.low, each.high, each.unit))
        for each in model.parameters
    )  # fmt: skip
    heads = ("Error", "", "Value", "Unit", "95 % interval")
    table = blocks.Table("Errors of the arm", heads, rows, texts=2)
    yield blocks.Details(f"All errors in numbers ({len(rows)})", (table,))
    fixed = tuple((each.name, each.why) for each in model.fixed)
    if fixed:
        yield blocks.Paragraph(
            f"{counted(len(fixed), 'error')} cannot be told from others by these positions: they"
            " count as 0, and what they do is in the others. Predictions do not need them."
        )
        table = blocks.Table("Errors that are not told apart", ("Error", "Why"), fixed, texts=2)
        yield blocks.Details(f"What they go together with ({len(fixed)})", (table,))


def _links(found: GeometryFindings) -> Iterator[blocks.Block]:
    yield blocks.Paragraph(_LINKS, "sub")
    rows: list[blocks.Row] = []
    for each in found.links:
        scale, unit, digits = _drawn_unit(each)
        nominal, calibrated = scale * each.nominal, scale * each.calibrated
        ends = (
            ""
            if each.low is None or each.high is None
            else f"{scale * each.low - nominal:+.{digits}f} to"
            f" {scale * each.high - nominal:+.{digits}f}"
        )
        shown = [f"{round(v, digits) + 0.0:.{digits}f}" for v in (nominal, calibrated)]
        change = f"{calibrated - nominal:+.{digits}f}" if ends else ""
        rows.append((each.joint, each.number, unit, *shown, change, ends))
    heads = ("Link of", "Number", "Unit", "Nominal", "Calibrated", "Change", "95 % of the change")
    yield blocks.Table("Links as drawn and as built", heads, tuple(rows), texts=3)


def _drawn_unit(row: LinkNumber) -> tuple[float, str, int]:
    return (1e3, "mm", 3) if row.unit == "m" else (_DEGREES, "°", 4)


def _blunders(found: GeometryFindings) -> Iterator[blocks.Block]:
    blunders = found.accuracy.blunders
    if not blunders:
        yield blocks.Paragraph("None: no position is farther off than its neighbours allow.")
        return
    named = sorted(blunders, key=lambda each: each.row)
    rows = tuple(
        (f"row {each.row}", each.station, each.marker, f"{1e3 * each.distance:.2f}")
        for each in named[:_MOST_ROWS]
    )
    yield blocks.Paragraph(
        f"{counted(len(blunders), 'position')} of {found.model.positions} more than seven standard"
        " deviations from where the calibrated arm has them. Rows are counted from 0."
    )
    heads = ("Row", "Station", "Marker", "Distance in mm")
    more = f", the first {_MOST_ROWS}" if len(blunders) > _MOST_ROWS else ""
    yield blocks.Table(f"Blunders{more}", heads, rows, texts=2)


def _frames(found: GeometryFindings) -> Iterator[blocks.Block]:
    model = found.model
    heads = ("Frame", "x", "y", "z", "A", "B", "C")
    stations = tuple((name, *_pose(T)) for name, T in model.stations.items())
    title = "Base in the frame of each station, mm and ° (Z-Y'-X'')"
    yield blocks.Table(title, heads, stations)
    rows = tuple((f"marker {n}", point(each)) for n, each in enumerate(model.markers.tolist(), 1))
    yield blocks.Table("Markers in the tcp, mm", ("Marker", "x, y, z"), rows)
    if model.T_tcp_built is not None:
        built = (("tcp as built", *_pose(model.T_tcp_built)),)
        yield blocks.Table("Tcp as built in the tcp as described, mm and °", heads, built)
    yield blocks.Facts(
        (("Robot", model.robot.name), ("Tcp", model.tcp), ("Made from", model.provenance))
    )


def _pose(T: FloatArray) -> tuple[str, ...]:
    x, y, z, a, b, c = xyzabc_from_T(T).tolist()
    lengths = (f"{1e3 * value + 0.0:.3f}" for value in (x, y, z))
    return (*lengths, *(f"{_DEGREES * value + 0.0:.4f}" for value in (a, b, c)))


def _number(value: float, unit: str) -> tuple[str, str]:
    scale, shown, digits = _SHOWN[unit]
    return f"{scale * value:+.{digits}f}", shown


def _span(low: float, high: float, unit: str) -> str:
    scale, _, digits = _SHOWN[unit]
    return f"{scale * low:+.{digits}f} to {scale * high:+.{digits}f}"
