"""What ``elastocal stiffness`` is asked, and what it finds."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import load_cell
from elastocal.cli.coverage import covered
from elastocal.compensation.offline import (
    PathError,
)
from elastocal.compensation.stiffness import (
    PathPostures,
    PathStations,
    PostureChoice,
    PostureConstraint,
    PostureGrid,
    PostureSurvey,
    cell_constraints,
    choose_postures,
    read_stations,
    require_same_robot,
    survey_postures,
)
from elastocal.identification import CalibratedModel
from elastocal.robot import Robot
from elastocal.robot.inverse import inverse_for


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked."""

    path: Path
    direction: str
    spins: int
    stands: int
    stations: int
    cell: Path | None
    start: FloatArray | None


@dataclass(frozen=True, eq=False)
class Answer:
    """What was found."""

    question: Question
    stations: PathStations
    direction: FloatArray
    """Shape (station, 3), in base."""
    survey: PostureSurvey
    choice: PostureChoice
    covered: bool

    @property
    def along(self) -> str:
        """The direction in words."""
        text = self.question.direction
        return "the tool's axis (normal)" if text == "normal" else f"({text}) in base"

    @property
    def postures(self) -> list[PathPostures]:
        """Postures as programmed, and those chosen."""
        programmed = PathPostures("as programmed", self.stations.q, np.zeros(len(self.stations)))
        one = [] if self.choice.one is None else [self.choice.one]
        return [programmed, *one, self.choice.each]


def answer(
    calibrated: CalibratedModel, question: Question, report: Callable[[str, int, int], None]
) -> Answer:
    """Return the postures along the path and which to choose.

    Raises
    ------
    PathError
        If the path, the direction or the size of the survey is refused.
    RobotError
        If the cell has another robot.
    """
    robot = calibrated.model.robot
    solver = inverse_for(robot)
    constraints: tuple[PostureConstraint, ...] = ()
    external = grid_of_external(robot, question.stands)
    if question.cell is not None:
        cell = load_cell(question.cell)
        require_same_robot(robot, cell.robot)
        constraints, external = cell_constraints(cell), cell.external_positions
    stations = read_stations(question.path, solver, question.stations, question.start)
    towards = parse_direction(question.direction, stations)
    turns = np.linspace(0.0, 2.0 * np.pi, question.spins, endpoint=False)
    count = len(stations)
    found = survey_postures(
        calibrated,
        solver,
        stations.T_base_tcp,
        towards,
        PostureGrid(turns, external),
        constraints,
        lambda done: report("stations", done, count),
    )
    choice = choose_postures(found, solver)
    return Answer(question, stations, towards, found, choice, covered(calibrated))


def grid_of_external(robot: Robot, count: int) -> FloatArray:
    """Return evenly spread positions of the external axes, shape (stand, external axis).

    Raises
    ------
    PathError
        If an external axis has no limits to spread them over.
    """
    ends = zip(robot.limits.lower, robot.limits.upper, strict=True)
    axes = []
    for name, (low, high) in itertools.islice(
        zip(robot.joint_names, ends, strict=True), robot.external_axes
    ):
        if not (np.isfinite(low) and np.isfinite(high)):
            raise PathError(f"external axis {name} has no limits: give a --cell with its positions")
        axes.append(np.linspace(low, high, count))
    grid = list(itertools.product(*axes))
    return np.array(grid, dtype=float).reshape(len(grid), robot.external_axes)


def parse_direction(text: str, stations: PathStations) -> FloatArray:
    """Return unit vectors in base, shape (station, 3).

    Raises
    ------
    PathError
        If the text is neither ``normal`` nor three numbers.
    """
    if text == "normal":
        return stations.normal
    try:
        vector = np.array([float(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not 0.0 < length < np.inf:
        raise PathError(
            f"direction {text!r} must be 'normal' or three numbers, not all 0, e.g. '1,0,0'"
        )
    return np.tile(vector / length, (len(stations), 1))
