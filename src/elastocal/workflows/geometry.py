"""``geometry``: from absolute positions of markers to the geometry of the arm."""

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.blocks import Block
from elastocal.errors import GeometryError, present
from elastocal.files import write_text
from elastocal.findings import Finding
from elastocal.geometry import (
    AngleCheck,
    DistanceFigures,
    GeometryAccuracy,
    GeometryModel,
    GeometryProblem,
    LinkNumber,
    accuracy_figures,
    errors_at,
    geometry_model,
    link_table,
    plausible_ladder,
    read_position_map,
    read_positions,
    require_as_many,
    show_geometry,
)
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import write_json
from elastocal.report import drawn, error_maps, language_of
from elastocal.report.document import REPORT_TITLE, GeometryFindings, write_geometry_page
from elastocal.results import Result, brief_repr
from elastocal.robot import BUILT_MARK, Robot
from elastocal.tables import write_table
from elastocal.units import in_unit, parse_point
from elastocal.wording import counted, mm
from elastocal.workflows._inputs import find_robot
from elastocal.workflows._workflow import workflow

_PAGE = '<meta name="generator" content="elastocal geometry">'
"""Mark in the report, in every language."""
_TABLE = ("joint", "number", "unit", "nominal", "calibrated", "difference", "low", "high")


@brief_repr
@dataclass(frozen=True)
class GeometrySettings:
    """Settings of a geometric calibration: positions and robot."""

    positions: Annotated[str | PathLike[str], Option(argument=True)]
    """CSV of joints and markers."""
    robot: Annotated[str | Robot | None, Option(choices="robot", required=True)] = None
    """URDF file or catalogue name. In Python also a `Robot`."""
    tcp: str | None = None
    """Link that carries the markers."""
    map: Annotated[Path | None, Option(metavar="MAP.yaml")] = None
    """Names and units of the columns, where they are not those of elastocal; also of ``test``."""
    out: Annotated[Path | None, Option(required=True, ends=(".json",))] = None
    """Model file to write, ``.json``; none: the model is only returned."""
    urdf: Annotated[Path | None, Option(ends=(".urdf", ".xml"))] = None
    """Calibrated URDF to write: places and zeros of joints, fitted without what it cannot hold."""
    report_file: Annotated[Path | None, Option("--report", ends=(".html", ".htm"))] = None
    """Report to write, ``.html``."""
    table: Annotated[Path | None, Option(ends=(".csv",))] = None
    """Table of links as drawn and as built to write, ``.csv``, of the arm of ``--urdf``."""
    markers: Annotated[tuple[str, ...], Option("--marker")] = ()
    """Position of each marker on the tool, ``"x, y, z"`` in the tcp with units, where known: an
    error of the tcp is then estimated, too."""
    test: Path | None = None
    """Another table of positions, to judge the model by: frames and markers of a station or
    campaign that the first table does not have are fitted to it, and nothing else."""
    draws: Annotated[int, Option(least=40, most=100_000)] = 1000
    """Draws of noise and prior, for the intervals."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of the draws."""
    force: bool = False
    """Replace a file that this command did not write."""
    language: Annotated[str, Option(choices="page language")] = "en"
    """Language of the report."""


@dataclass(frozen=True, eq=False, repr=False)
class GeometryResult(Result):
    """A calibrated geometry."""

    model: GeometryModel
    accuracy: GeometryAccuracy
    """Errors of every position before and after, at poses that were left out."""
    test: DistanceFigures | None = None
    """Errors at the positions of the other table."""
    test_findings: tuple[Finding, ...] = ()
    """Warnings about that table."""

    @property
    def expressed(self) -> DistanceFigures:
        """Errors at left-out poses of what the URDF and the table of links express."""
        return present(self.model.chain, "chain").held_out

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        model = self.model
        before, after = model.held_out.registration, model.held_out.chosen
        known, urdf = sum(each.known for each in model.parameters), self.expressed
        return (
            ("positions", f"{model.positions}, {counted(len(model.blunders), 'blunder')} left out"),
            ("nominal arm", _phrase(before.mean, before.p95, before.max)),
            ("calibrated", _phrase(after.mean, after.p95, after.max)),
            ("model", next(each.rung for each in model.ladder if each.chosen)),
            ("as a URDF", _phrase(urdf.mean, urdf.p95, urdf.max)),
            *(
                (("other table", _phrase(self.test.mean, self.test.p95, self.test.max, "")),)
                if self.test
                else ()
            ),
            ("errors of the arm", f"{known} known of {len(model.parameters)} fitted"),
            *(("warning", each) for each in (*model.findings, *self.test_findings)),
        )

    def show(self) -> Iterator[Block]:
        """Yield the tables of a calibrated geometry, and its warnings."""
        return show_geometry(self.model, self.accuracy, self.test, self.test_findings)

    def plot(self) -> Any:
        """Return maps of the errors before and after, as a Matplotlib figure."""
        title = f"{self.model.robot.name}: error of positions before and after calibration"
        return drawn(error_maps, self.accuracy, title)


@workflow(
    GeometrySettings,
    outputs=("out", "urdf", "report_file", "table"),
    marks=("elastocal.geometry/", BUILT_MARK, f"<title>{REPORT_TITLE}", _PAGE, ",".join(_TABLE)),
)
def geometry(settings: GeometrySettings, progress: Progress) -> GeometryResult:
    """Find the geometric errors of an arm, and what it yields under its weight and payloads.

    Raises
    ------
    GeometryError
        If the positions cannot be read, or no geometry can be found from them.
    RobotError
        If there is no such robot or link.
    FileAccessError
        If a file cannot be read or written, or its name says another kind.
    ReportError
        If the report knows no such language.

    Examples
    --------
    A UR20 whose second joint turns 0.2 deg farther than its controller says.

    >>> import numpy as np
    >>> import elastocal as ec
    >>> robot = ec.robot.catalogue.load("UR20")
    >>> q = np.random.default_rng(0).uniform(-1.5, 1.5, (30, 6))
    >>> T_base_tcp = robot.forward(q + np.radians([0.0, 0.2, 0.0, 0.0, 0.0, 0.0]))
    >>> seen = 1e3 * (T_base_tcp[:, :3, 3] + 0.1 * T_base_tcp[:, :3, 2])
    >>> heads = [f"{name}[rad]" for name in robot.joint_names]
    >>> heads = ",".join([*heads, "marker_x[mm]", "marker_y[mm]", "marker_z[mm]"])
    >>> np.savetxt("seen.csv", np.hstack([q, seen]), delimiter=",", header=heads, comments="")
    >>> found = ec.geometry("seen.csv", robot="UR20", draws=40)
    >>> round(float(np.degrees(found.model.parameters[0].value)), 3)
    0.2
    """
    language = language_of(settings.language)
    path = Path(settings.positions)
    robot = find_robot(settings.robot, settings.tcp, None)
    columns = None if settings.map is None else read_position_map(settings.map)
    problem = GeometryProblem(robot, read_positions(path, robot, columns))
    other = None if settings.test is None else read_positions(settings.test, robot, columns)
    markers = _known_markers(settings, problem.data.markers.shape[1])
    found = plausible_ladder(
        problem, settings.draws, np.random.default_rng(settings.seed), progress
    )
    model = geometry_model(problem, found, f"elastocal geometry {path.name}", markers)
    if settings.urdf is not None or settings.table is not None:
        _require_expressible(model)
    if settings.out is not None:
        write_json(settings.out, model)
    if settings.urdf is not None:
        write_text(settings.urdf, model.calibrated_urdf())
    accuracy, test = accuracy_figures(problem, found), None
    angles = AngleCheck(model.functions, robot.joint_names)
    if other is not None:
        test = DistanceFigures.of(errors_at(model, problem.data, other))
        angles.add(other.q)
    if settings.report_file is not None or settings.table is not None:
        links = link_table(problem, found)
        if settings.table is not None:
            write_table(settings.table, _TABLE, map(_cells, links))
        if settings.report_file is not None:
            write_geometry_page(
                settings.report_file, GeometryFindings(model, accuracy, links), language
            )
    return GeometryResult(model, accuracy, test, angles.findings())


def _known_markers(settings: GeometrySettings, measured: int) -> FloatArray | None:
    """Return where markers are known to be on the tool, shape (marker, 3), in m."""
    if not settings.markers:
        return None
    known = np.array([parse_point(each) for each in settings.markers])
    require_as_many(known, measured)
    return known


def _require_expressible(model: GeometryModel) -> None:
    """Refuse outputs that would leave out all that was found."""
    chain, before = present(model.chain, "chain"), model.held_out.registration
    chosen = next(each.rung for each in model.ladder if each.chosen)
    if chain.rung == "registration" != chosen:
        raise GeometryError(
            f"--urdf and --table express places and zeros of joints, which are no better than the"
            f" nominal arm here ({mm(before.mean)} mean at poses left out): what was found is"
            f" {chosen}, {mm(model.held_out.chosen.mean)}; use the model file"
        )


def _cells(row: LinkNumber) -> tuple[object, ...]:
    """Return a row of the table, in mm and degrees."""
    unit = "mm" if row.unit == "m" else "deg"
    values = (row.nominal, row.calibrated, row.calibrated - row.nominal, row.low, row.high)
    shown = ("" if value is None else round(in_unit(value, unit), 9) + 0.0 for value in values)
    return (row.joint, row.number, unit, *shown)


def _phrase(mean: float, p95: float, largest: float, where: str = ", at poses left out") -> str:
    return f"{mm(mean)} mean, {mm(p95)} at 95 %, {mm(largest)} at most{where}"
