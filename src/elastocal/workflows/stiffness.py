"""``stiffness``: which posture is stiffest along a path (paper section 4.3.1)."""

import itertools
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from elastocal import compensation
from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Facts, Table
from elastocal.cell import load_cell
from elastocal.compensation import PathPostures, PathStations, PostureChoice, PostureSurvey
from elastocal.errors import PathError
from elastocal.files import filling
from elastocal.identification import CalibratedModel, ModelSource, model_name
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record, write_json
from elastocal.report import Curve, drawn, stiffness_figure, write_stiffness_figure
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.robot.inverse import inverse_for, posture_jumps
from elastocal.units import in_unit, parse_number, quantity
from elastocal.wording import phrase, phrases
from elastocal.workflows._inputs import NewTool, coverage_notes, parse_posture, require_same_robot
from elastocal.workflows._workflow import workflow

_SUMMARY = "stiffness.json"
"""Name of the file by which the folder is known."""
_FILES = ("postures.csv", "choice.csv", "stiffness.svg", _SUMMARY)


@dataclass(frozen=True)
class StiffnessSettings(NewTool):
    """Settings of a survey of stiffness: the model, the path, and the free choices."""

    model: Annotated[ModelSource, Option(argument=True)]
    """Model file of `calibrate`; in Python also what it returned."""
    path: Annotated[Path, Option(argument=True)]
    """CSV as for `compensate`; forces are not needed."""
    out: Annotated[
        Path | None, Option(required=True, metavar="DIR", help="Folder to write into.")
    ] = None
    """Folder to write tables and figures into; none: they are only returned."""
    direction: str = "normal"
    """``normal`` (axis of the tool) or a vector in base, ``"1,0,0"``."""
    spins: Annotated[int, Option(least=1, most=3600)] = 36
    """Turns about the tool's axis to try."""
    external_positions: Annotated[int, Option("--stands", least=1, most=1000)] = 9
    """Positions of each external axis to try; with a cell, its own are taken."""
    stations: Annotated[int, Option(least=1, most=100_000)] = 60
    """Rows of the path to look at."""
    cell: Path | None = None
    """Cell file, for its margins, tooling and fixtures."""
    start: str | None = None
    """Posture before the first row, a quantity a joint from base to tip, such as
    ``0 deg, -90 deg, 90 deg, 0 deg, 45 deg, 0 deg``."""
    force: bool = False
    """Replace files that are there."""


@record()
class ExternalAxis:
    """An axis that carries the arm, and the unit of its positions."""

    name: str
    unit: str


@brief_repr
@record()
class PostureCounts:
    """Numbers of postures."""

    tried: int
    allowed: int
    refused: dict[str, int]
    """Number of postures refused, by the check."""


@record()
class ChosenStiffness:
    """One choice of postures along the path."""

    name: str
    stations: int
    """Stations at which there is a posture."""
    softest: float
    """Stiffness of the softest station, in N/m; 0 without a posture."""
    mean: float
    """In N/m."""
    spin: float | None
    """In rad; None where it varies."""
    stand: float | None
    """Position of the first external axis, in rad or m; none where it varies."""
    posture_jumps: int
    """Stations at which a joint turns by more than 90 deg from the one before."""

    def cells(self, rail: tuple[ExternalAxis, ...]) -> tuple[str, ...]:
        """Return softest, mean, spin and position of the external axis as a table shows them."""
        if not self.stations:
            return (phrase("none"),) * (3 + len(rail))
        various = phrase("various")
        return (
            *(f"{in_unit(value, 'N/µm'):.3g}" for value in (self.softest, self.mean)),
            various if self.spin is None else quantity(self.spin, "deg", ".0f"),
            *(various if self.stand is None else f"{self.stand:.3g} {each.unit}" for each in rail),
        )


@brief_repr
@record("elastocal.stiffness/1")
class StiffnessSummary:
    """The contents of ``stiffness.json``."""

    direction: str
    stations: int
    external_axes: tuple[ExternalAxis, ...]
    postures: PostureCounts
    choices: tuple[ChosenStiffness, ...]
    files: tuple[str, ...]
    tool: str = ""
    """The tool that the model is for, in words; empty in files before it was written."""


@dataclass(frozen=True, eq=False, repr=False)
class StiffnessResult(Result):
    """All postures along a path, and which to choose."""

    summary: StiffnessSummary
    stations: PathStations
    direction: FloatArray
    """Unit vectors in base, shape (station, 3)."""
    survey: PostureSurvey
    choice: PostureChoice
    notes: tuple[str, ...]
    """Notes for the user."""
    robot: str
    curves: tuple[Curve, ...]
    """Stiffness of each choice along the path."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        counts = self.summary.postures
        return (
            ("tool", self.summary.tool),
            ("stiffness along", self.along),
            ("postures", f"{counts.allowed} of {counts.tried} are allowed"),
            *(
                (each.name, f"{quantity(each.softest, 'N/µm', '.3g')} where softest")
                for each in self.summary.choices
            ),
        )

    def show(self) -> Iterator[Block]:
        """Yield the choices as a table, and further facts."""
        counts, rail = self.summary.postures, self.summary.external_axes[:1]
        # Of several external axes the figure shows the first; choice.csv has all.
        yield Table(
            phrase("Stiffness along {direction} in N/µm", direction=self.along),
            (
                *phrases("Posture", "Softest", "Mean", "Spin"),
                *(axis.name for axis in rail),
                phrase("Stations"),
            ),
            tuple((each.name, *each.cells(rail), each.stations) for each in self.summary.choices),
        )
        refused = ", ".join(
            f"{number} by {what}" for what, number in counts.refused.items() if number
        )
        yield Facts(
            (
                (
                    "postures",
                    f"{counts.allowed} of {counts.tried} postures are allowed"
                    + (f"; refused: {refused}" if refused else ""),
                ),
                ("tool", self.summary.tool),
                *(("note", text) for text in self.notes),
            )
        )

    def plot(self) -> Any:
        """Return the map of all postures and the curves of the choices, as a Matplotlib figure."""
        return drawn(stiffness_figure, self.title, self.stations, self.survey, self.curves)

    @property
    def title(self) -> str:
        """Title of its figure."""
        return f"{self.robot}: stiffness along {self.along}"

    @property
    def along(self) -> str:
        """The direction in words."""
        text = self.summary.direction
        return "the tool's axis (normal)" if text == "normal" else f"({text}) in base"


@workflow(StiffnessSettings)
def stiffness(settings: StiffnessSettings, progress: Progress) -> StiffnessResult:
    """Map the stiffness over spin, rail and path; choose the stiffest posture.

    Raises
    ------
    PathError
        If the path, the direction or the size of the survey is refused.
    RobotError, UnitError
        If the cell has another robot, or ``start`` does not fit.
    FileAccessError
        If a file cannot be read or written, or the folder holds files and ``force`` is not given.

    Examples
    --------
    >>> import elastocal as ec
    >>> run = ec.datasets.afp_run("afp", poses=4)
    >>> model = ec.calibrate(run, springs="actuated", draws=40)
    >>> found = ec.stiffness(model, "afp/process.csv", out="stiffness", stations=5)
    >>> dict(found.facts())["stiffness along"]
    "the tool's axis (normal)"
    """
    calibrated = settings.read_model(settings.model)
    start = parse_posture(calibrated.model.robot, settings.start)
    out = settings.out
    with nullcontext() if out is None else filling(out, _SUMMARY, settings.force) as folder:
        return _surveyed(calibrated, settings, start, folder, progress)


def _surveyed(
    calibrated: CalibratedModel,
    settings: StiffnessSettings,
    start: FloatArray | None,
    folder: Path | None,
    progress: Progress,
) -> StiffnessResult:
    robot = calibrated.model.robot
    solver = inverse_for(robot)
    grid, constraints = _grid(robot, settings)
    stations = compensation.read_stations(settings.path, solver, settings.stations, start)
    count = len(stations)
    direction = _parse_direction(settings.direction, stations)
    survey = compensation.survey_postures(
        calibrated,
        solver,
        stations.T_base_tcp,
        direction,
        grid,
        constraints,
        lambda done: progress("stations", done, count),
    )
    choice = compensation.choose_postures(survey, solver)
    programmed = PathPostures("as programmed", stations.q, np.zeros(count))
    choices = [each for each in (programmed, choice.one, choice.each) if each is not None]
    curves = tuple(_curve(calibrated, direction, postures) for postures in choices)
    axes = zip(robot.joint_names, robot.revolute, strict=True)
    summary = StiffnessSummary(
        direction=settings.direction,
        stations=count,
        external_axes=tuple(ExternalAxis(name, "rad" if turns else "m") for name, turns in axes)[
            : robot.external_axes
        ],
        postures=PostureCounts(
            survey.stiffness.size, int(np.sum(~np.isnan(survey.stiffness))), survey.refused
        ),
        choices=tuple(map(partial(_chosen, robot), curves, choices)),
        files=_FILES if folder is not None else (),
        tool=calibrated.tool_name,
    )
    notes = (*_notes(summary, choice), *_friction(calibrated), *coverage_notes(calibrated))
    result = StiffnessResult(
        summary, stations, direction, survey, choice, notes, robot.name, curves
    )
    if folder is not None:
        compensation.write_survey(folder / _FILES[0], robot, stations, survey)
        compensation.write_choice(folder / _FILES[1], calibrated, stations, direction, choices)
        write_stiffness_figure(folder / _FILES[2], result.title, stations, survey, curves)
        write_json(folder / _SUMMARY, summary)
    return result


def _grid(
    robot: Robot, settings: StiffnessSettings
) -> tuple[compensation.PostureGrid, tuple[compensation.PostureConstraint, ...]]:
    """Return the grid of postures at every station, and the constraints on them."""
    spins = np.linspace(0.0, 2.0 * np.pi, settings.spins, endpoint=False)
    external = _external_grid(robot, settings.external_positions)
    if settings.cell is None:
        return compensation.PostureGrid(spins, external), ()
    cell = load_cell(settings.cell)
    require_same_robot(robot, cell.robot, (model_name(settings.model), cell.name))
    return compensation.PostureGrid(spins, cell.external_positions), compensation.cell_constraints(
        cell
    )


def _external_grid(robot: Robot, count: int) -> FloatArray:
    """Return evenly spread positions of the external axes, shape (position, external axis)."""
    axes = []
    ends = zip(robot.joint_names, robot.limits.lower, robot.limits.upper, strict=True)
    for name, low, high in itertools.islice(ends, robot.external_axes):
        if not (np.isfinite(low) and np.isfinite(high)):
            raise PathError(f"external axis {name} has no limits: give a --cell with its positions")
        axes.append(np.linspace(low, high, count))
    grid = list(itertools.product(*axes))
    return np.array(grid, dtype=float).reshape(len(grid), robot.external_axes)


def _parse_direction(text: str, stations: PathStations) -> FloatArray:
    """Return unit vectors in base, shape (station, 3)."""
    if text == "normal":
        return stations.normal
    try:
        vector = np.array([parse_number(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not 0.0 < length < np.inf:
        raise PathError(
            f"direction {text!r} must be 'normal' or three numbers, not all 0, e.g. '1,0,0'"
        )
    return np.tile(vector / length, (len(stations), 1))


def _curve(calibrated: CalibratedModel, direction: FloatArray, postures: PathPostures) -> Curve:
    there = np.flatnonzero(np.isfinite(postures.q).all(axis=1))
    k = compensation.directional_stiffness(calibrated, postures.q[there], direction[there])
    stiffness, low, high = (np.full(len(postures.q), np.nan) for _ in range(3))
    stiffness[there], low[there], high[there] = k.stiffness, k.low, k.high
    railed = calibrated.model.robot.external_axes > 0
    rail = postures.q[:, 0] if railed else np.full(len(postures.q), np.nan)
    return Curve(postures.name, stiffness, low, high, postures.spin, rail)


def _chosen(robot: Robot, curve: Curve, postures: PathPostures) -> ChosenStiffness:
    k = curve.stiffness[np.isfinite(curve.stiffness)]
    q = postures.q[np.isfinite(postures.q).all(axis=1)]

    def only(values: FloatArray) -> float | None:
        found = np.unique(values[np.isfinite(values)])
        return float(found[0]) if len(found) == 1 else None

    return ChosenStiffness(
        name=curve.name,
        stations=len(k),
        softest=float(k.min()) if len(k) else 0.0,
        mean=float(k.mean()) if len(k) else 0.0,
        spin=only(curve.spin),
        stand=only(curve.rail),
        posture_jumps=len(posture_jumps(robot, q, q[0])) if len(q) else 0,
    )


def _friction(calibrated: CalibratedModel) -> tuple[str, ...]:
    """Return at which loads the stiffness holds, where a model has friction."""
    friction = calibrated.model.friction
    if not len(friction):
        return ()
    return (
        "the stiffness is that with all friction in the gears sliding: it holds for changes of load"
        f" of well over {friction.limit.max():.0f} N·m in a joint; to smaller ones, such as"
        " vibrations, the arm is stiffer",
    )


def _notes(summary: StiffnessSummary, choice: PostureChoice) -> list[str]:
    notes = []
    for each in summary.choices:
        if each.spin is not None and each.posture_jumps:
            count = each.posture_jumps
            where = "1 station" if count == 1 else f"{count} stations"
            notes.append(f"{each.name}: at {where} a joint turns by more than 90 deg")
    if choice.one is None:
        notes.append("no single posture is allowed at every station")
    return notes
