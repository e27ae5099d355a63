"""The report of a calibrated geometry: one HTML file that runs no script."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from elastocal import blocks
from elastocal.arrays import FloatArray
from elastocal.geometry import (
    GeometryAccuracy,
    GeometryModel,
    LinkNumber,
    PoseAccuracy,
    arm_error_table,
    axis_table,
    function_table,
    repeatability_facts,
    rung_table,
)
from elastocal.report.document.sections_page import write_page
from elastocal.report.language import ENGLISH, Language
from elastocal.report.plots import MANY_POSITIONS, error_maps, function_figure, parameter_figure
from elastocal.results import brief_repr
from elastocal.robot import xyzabc_from_T
from elastocal.units import in_unit
from elastocal.wording import counted, mm, phrase, phrases, point

REPORT_TITLE = "Geometry report"
"""Start of the title of every such page in English."""
_MOST_ROWS = 200
_LINKS = phrase(
    "A link goes from its joint's axis to the next by Rz(theta + q) Tz(d) Tx(a) Rx(alpha) (Denavit"
    " and Hartenberg, distal frames). Where both axes are parallel as drawn, Ry(beta) follows and d"
    " stays as drawn (Hayati): it goes together with the d of other links. z is the joint's axis in"
    " the sense in which it turns; the first link begins in the first joint's frame. Numbers"
    " without an interval are as drawn, or go together with others."
)


@brief_repr
@dataclass(frozen=True, eq=False)
class GeometryFindings:
    """Contents of a report of a geometry."""

    model: GeometryModel
    accuracy: GeometryAccuracy
    links: tuple[LinkNumber, ...]


def write_geometry_page(path: Path, found: GeometryFindings, language: Language = ENGLISH) -> Path:
    """Write the page, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    found : GeometryFindings
        What it shows.
    language : Language
        Language of its words.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    model = found.model
    sections = [
        (identifier, title, show(found))
        for identifier, title, show in (
            ("result", phrase("Before and after"), _result),
            ("maps", phrase("Where in the workspace"), _maps),
            ("iso", phrase("Pose accuracy and repeatability (ISO 9283)"), _iso),
            ("errors", phrase("Which errors are known, and how well"), _errors),
            *(
                [("functions", phrase("Functions of the joints"), _functions)]
                if model.functions
                else []
            ),
            ("links", phrase("Denavit-Hartenberg table"), _links),
            ("blunders", phrase("Positions left out"), _blunders),
            ("frames", phrase("Stations, markers, provenance"), _frames),
        )
    ]
    return write_page(
        path,
        phrase("Geometry report: {robot}", robot=model.robot.name),
        sections,
        language,
        phrase(
            "{positions} of markers, {provenance}. Errors are those at poses that were left out of"
            " the fit.",
            positions=counted(model.positions, "position"),
            provenance=model.provenance,
        ),
        "elastocal geometry",
    )


def _result(found: GeometryFindings) -> Iterator[blocks.Block]:
    model, accuracy = found.model, found.accuracy
    before, after = model.held_out.registration, model.held_out.chosen
    known = sum(each.known for each in model.parameters)
    yield blocks.Facts(
        (
            (phrase("Nominal arm, mean error"), mm(before.mean)),
            (phrase("Calibrated, mean error"), mm(after.mean)),
            (phrase("Calibrated, 95 % of errors below"), mm(after.p95)),
            (phrase("Calibrated, largest error"), mm(after.max)),
            (phrase("Model"), next(each.rung for each in model.ladder if each.chosen)),
            (
                phrase("Errors of the arm known"),
                phrase("{known} of {all}", known=known, all=len(model.parameters)),
            ),
        )
    )
    yield blocks.Bullets(model.findings, "reasons")
    yield axis_table(accuracy)
    yield rung_table(model)


def _maps(found: GeometryFindings) -> Iterator[blocks.Block]:
    accuracy = found.accuracy
    many = len(accuracy.row) > MANY_POSITIONS
    count = counted(len(accuracy.row), "position")
    before, after = (each.mean for each in vars(found.model.held_out).values())
    yield blocks.Picture(
        partial(error_maps, accuracy),
        phrase(
            "Positions in the base of the robot, coloured by their error: {before} mean before,"
            " {after} after",
            before=mm(before),
            after=mm(after),
        ),
        phrase(
            "{which} that were fitted, each at poses left out and where its marker was measured, in"
            " the base of the robot. Before and after have one scale, which ends where 98 % of the"
            " errors before lie below; enlarged is what is left, on a scale of its own.",
            which=phrase("Means over cells of the map, of all {positions}", positions=count)
            if many
            else phrase("All {positions}", positions=count),
        ),
    )


def _iso(found: GeometryFindings) -> Iterator[blocks.Block]:
    poses = found.accuracy.poses
    if not poses:
        norm = found.accuracy.axes[-1]
        yield blocks.Paragraph(
            phrase(
                "No repeated visits: no pose was visited twice by one station under one load, so"
                " repeatability (RP) is not known. Pose accuracy (AP) of single visits is the"
                " distance above: {mean} mean and {max} at most before, {mean_after} and"
                " {max_after} after.",
                mean=mm(norm.registration.mean),
                max=mm(norm.registration.max),
                mean_after=mm(norm.chosen.mean),
                max_after=mm(norm.chosen.max),
            )
        )
        return
    yield repeatability_facts(poses)
    fewest = min(each.visits for each in poses)
    yield blocks.Paragraph(
        phrase(
            "After ISO 9283:1998, 7.2, from the visits of one commanded pose under one load: AP is"
            " the distance of their barycentre from where the pose was expected, RP the mean"
            " distance from the barycentre plus three standard deviations. {poses} with at least"
            " {fewest}; the standard asks for 30 visits of five poses at stated speed and load,"
            " which the table does not say. Where joints are those measured at the time, and not"
            " commanded, the scatter of the drives is not in RP.",
            poses=counted(len(poses), "pose"),
            fewest=counted(fewest, "visit"),
        ),
        "sub",
    )
    yield _poses_table(poses)


def _poses_table(poses: Sequence[PoseAccuracy]) -> blocks.Block:
    rows: tuple[blocks.Row, ...] = tuple(
        (
            phrase("row {row}", row=each.row),
            each.station,
            each.marker,
            each.visits,
            *(
                f"{in_unit(v, 'mm'):.3f}"
                for v in (each.registration, each.chosen, each.repeatability)
            ),
        )
        for each in sorted(poses, key=lambda each: -each.repeatability)[:_MOST_ROWS]
    )
    heads = (
        *phrases("Pose first at", "Station", "Marker", "Visits", "AP before", "AP after"),
        "RP",
    )
    table = blocks.Table(phrase("By pose in mm, the least repeatable first"), heads, rows, texts=2)
    return blocks.Details(phrase("All poses ({count})", count=len(rows)), (table,), "long")


def _errors(found: GeometryFindings) -> Iterator[blocks.Block]:
    model = found.model
    if not model.parameters:
        yield blocks.Paragraph(
            phrase("The nominal arm was kept: the positions speak for no error of it.")
        )
        return
    yield blocks.Picture(
        partial(parameter_figure, model.parameters),
        phrase(
            "{parameters} of the arm with 95 % intervals",
            parameters=counted(len(model.parameters), "error"),
        ),
        phrase(
            "Filled: known, its 95 % interval is narrower than what one would guess without"
            " measuring (1 mm, 1 mrad). Hollow: not known. Intervals: blocks of poses drawn with"
            " replacement."
        ),
    )
    table = arm_error_table(model)
    count = len(table.rows)
    yield blocks.Details(phrase("All errors in numbers ({rows})", rows=count), (table,))
    fixed = tuple((each.name, each.why) for each in model.fixed)
    if fixed:
        yield blocks.Paragraph(
            phrase(
                "{fixed} cannot be told from others by these positions: they count as 0, and what"
                " they do is in the others. Predictions do not need them.",
                fixed=counted(len(fixed), "error"),
            )
        )
        table = blocks.Table(
            phrase("Errors that are not told apart"), phrases("Error", "Why"), fixed, texts=2
        )
        yield blocks.Details(
            phrase("What they go together with ({fixed})", fixed=len(fixed)), (table,)
        )


def _functions(found: GeometryFindings) -> Iterator[blocks.Block]:
    functions = found.model.functions
    yield blocks.Picture(
        partial(function_figure, functions),
        phrase(
            "Error of {joints} as a function of the angle, with 95 % bands",
            joints=counted(len(functions), "joint"),
        ),
        phrase(
            "How much farther a joint turns than its controller says, beyond what scale, once and"
            " twice a turn explain; over the measured range. Grey: the band is wider than what one"
            " would guess without measuring. Taken because it predicts regions of joint space that"
            " were left out, as errors of gears and encoders do."
        ),
    )
    yield function_table(found.model)


def _links(found: GeometryFindings) -> Iterator[blocks.Block]:
    yield blocks.Paragraph(_LINKS, "sub")
    rows: list[blocks.Row] = []
    for each in found.links:
        scale, unit, digits = _drawn_unit(each)
        nominal, calibrated = scale * each.nominal, scale * each.calibrated
        ends = (
            ""
            if each.low is None or each.high is None
            else phrase(
                "{low} to {high}",
                low=f"{scale * each.low - nominal:+.{digits}f}",
                high=f"{scale * each.high - nominal:+.{digits}f}",
            )
        )
        shown = [f"{round(v, digits) + 0.0:.{digits}f}" for v in (nominal, calibrated)]
        change = f"{calibrated - nominal:+.{digits}f}" if ends else ""
        rows.append((each.joint, each.number, unit, *shown, change, ends))
    heads = phrases("Link of", "Number", "Unit", "Nominal", "Calibrated", "Change",
                    "95 % of the change")  # fmt: skip
    yield blocks.Table(phrase("Links as drawn and as built"), heads, tuple(rows), texts=3)


def _drawn_unit(row: LinkNumber) -> tuple[float, str, int]:
    unit, digits = ("mm", 3) if row.unit == "m" else ("°", 4)
    return in_unit(1.0, unit), unit, digits


def _blunders(found: GeometryFindings) -> Iterator[blocks.Block]:
    blunders = found.accuracy.blunders
    if not blunders:
        yield blocks.Paragraph(
            phrase("None: no position is farther off than its neighbours allow.")
        )
        return
    named = sorted(blunders, key=lambda each: each.row)
    rows = tuple(
        (
            phrase("row {row}", row=each.row),
            each.station,
            each.marker,
            f"{in_unit(each.distance, 'mm'):.2f}",
        )
        for each in named[:_MOST_ROWS]
    )
    yield blocks.Paragraph(
        phrase(
            "{blunders} of {positions} more than seven standard deviations from where the"
            " calibrated arm has them. Rows are counted from 0.",
            blunders=counted(len(blunders), "position"),
            positions=found.model.positions,
        )
    )
    heads = phrases("Row", "Station", "Marker", "Distance in mm")
    caption = (
        phrase("Blunders, the first {count}", count=_MOST_ROWS)
        if len(blunders) > _MOST_ROWS
        else phrase("Blunders")
    )
    yield blocks.Table(caption, heads, rows, texts=2)


def _frames(found: GeometryFindings) -> Iterator[blocks.Block]:
    model = found.model
    heads = (phrase("Frame"), "x", "y", "z", "A", "B", "C")
    stations = tuple((name, *_pose(T)) for name, T in model.stations.items())
    title = phrase("Base in the frame of each station, mm and ° (Z-Y'-X'')")
    yield blocks.Table(title, heads, stations)
    rows = tuple(
        (phrase("marker {number}", number=n), point(each))
        for n, each in enumerate(model.markers.tolist(), 1)
    )
    yield blocks.Table(phrase("Markers in the tcp, mm"), (phrase("Marker"), "x, y, z"), rows)
    if model.T_tcp_built is not None:
        built = ((phrase("tcp as built"), *_pose(model.T_tcp_built)),)
        yield blocks.Table(phrase("Tcp as built in the tcp as described, mm and °"), heads, built)
    yield blocks.Facts(
        (
            (phrase("Robot"), model.robot.name),
            (phrase("Tcp"), model.tcp),
            (phrase("Made from"), model.provenance),
        )
    )


def _pose(T: FloatArray) -> tuple[str, ...]:
    x, y, z, a, b, c = xyzabc_from_T(T).tolist()
    lengths = (f"{in_unit(value, 'mm') + 0.0:.3f}" for value in (x, y, z))
    return (*lengths, *(f"{in_unit(value, '°') + 0.0:.4f}" for value in (a, b, c)))
