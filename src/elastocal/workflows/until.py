"""``run --until``: the error to expect on production after each pose, and when it is small enough.

After each committed pose its streams are averaged, the dataset of all poses so far is made as
`derive` makes it, and its calibration is judged along the cell's production. The run has enough
when the upper end of the error's interval is within the accuracy that is wanted and the poses cover
production. The interval holds at all looks together; see
`elastocal.identification.level_of_a_look`.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from elastocal import procedure
from elastocal.arrays import FloatArray
from elastocal.blocks import Block, Paragraph, Table
from elastocal.cell import Cell
from elastocal.dataset import Dataset
from elastocal.errors import ElastocalError, ProcedureError, present
from elastocal.identification import (
    FEWEST,
    FitSettings,
    ProductionError,
    ProductionRows,
    level_of_a_look,
    production_error,
)
from elastocal.planning import (
    PlanResult,
    PoolData,
    best_additions,
    plan_coverage,
    postures_of,
)
from elastocal.procedure import PoseLog, PoseReadings, RunFolder
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import mm
from elastocal.workflows._inputs import find_robot

ROUND = 4
"""Poses of each round of visits after the first one of `FEWEST`."""
_FURTHER = (1, 2, 4, 8, 16)
"""Numbers of further poses whose gain is stated."""
_PLACES = 4
"""Places of further poses that are stated."""
NO_PRODUCTION = (
    "the error is expected where production runs, and cell {name!r} names no process: give"
    " process.file in the cell file"
)

Point = tuple[float, float, float]


@brief_repr
@record()
class ReachedAccuracy:
    """The error to expect on production after each pose of a run, and what more would bring."""

    wanted: float
    """Wanted accuracy: root mean square of the error's length on production, in m."""
    risk: float
    """Probability that the error is larger although the run stopped for it."""
    reached: bool
    looks: tuple[ProductionError, ...]
    """After each pose from the first estimate on; of poses of earlier sessions the last."""
    further: tuple[ProductionError, ...] = ()
    """With further poses, as expected from the last look."""
    places: tuple[Point, ...] = ()
    """Contact points of the best further poses in base, in m, the best first."""

    def sentence(self) -> str:
        """Return whether the accuracy is reached, or how many more poses may reach it."""
        wanted = mm(self.wanted)
        if not self.looks:
            return "the error on production could not be estimated"
        last = self.looks[-1]
        if self.reached:
            return (
                f"{wanted} reached with {last.poses} poses: the error on production is below"
                f" {mm(last.high)}"
            )
        left = f"springs and noise of a reading leave {mm(last.model)}, which poses do not remove"
        if last.model * last.error > self.wanted * last.high:
            return f"no number of poses shows {wanted}: {left}"
        enough = [each for each in self.further if each.high <= self.wanted]
        if not enough:
            return f"{wanted} not reached, nor expected soon: {left}"
        more = enough[0].poses - last.poses
        return (
            f"{wanted} not reached; with {more} more poses it may be: `elastocal plan --more`"
            " chooses them"
        )

    def show(self) -> Iterator[Block]:
        """Yield the looks, what further poses would bring, and where they would be."""
        heads = ("Poses", "Springs", "Expected error", "Interval at all looks")
        caption = (
            "Error to expect on production, root mean square of its length; risk"
            f" {self.risk:.3g} that an end is wrong at any of the looks"
        )
        yield Table(caption, heads, tuple(map(_row, self.looks)), texts=2)
        if self.further:
            rows = tuple(map(_row, self.further))
            yield Table("What further poses would bring", heads, rows, texts=2)
        if self.places:
            places = "; ".join(
                f"{1e3 * x:.0f}, {1e3 * y:.0f}, {1e3 * z:.0f} mm" for x, y, z in self.places
            )
            yield Paragraph(f"the best further poses touch at (x, y, z in base) {places}")
        # Why a run stopped is its own message.
        if not self.reached:
            yield Paragraph(self.sentence())


def _row(each: ProductionError) -> tuple[str, ...]:
    return str(each.poses), each.springs, mm(each.error), f"{mm(each.low)} to {mm(each.high)}"


def cell_error(
    cell: Cell, data: Dataset, level: float, settings: FitSettings | None = None
) -> ProductionError:
    """Return the error to expect on a cell's production of a calibration of a dataset.

    Parameters
    ----------
    cell : Cell
        With a process.
    data : Dataset
        Measured in it.
    level : float
        See `production_error`.
    settings : FitSettings, optional
        Settings of the calibration.

    Raises
    ------
    ProcedureError
        If the cell names no process.
    IdentificationError
        If there are too few poses, or nothing can be fitted.
    """
    if cell.process is None:
        raise ProcedureError(NO_PRODUCTION.format(name=cell.name))
    robot = find_robot(None, None, None, data)
    path = cell.process
    rows = ProductionRows(path.joint_position, path.force, path.moment)
    options = (settings or FitSettings()).options()
    readings = data.readings(robot.joint_names)
    return production_error(robot, readings, rows, options, data.marker, level=level)


@dataclass(eq=False)
class AccuracyWatch:
    """Judges the calibration of a run after each pose; `__call__` is the hook of the runner."""

    cell: Cell
    plan: PlanResult
    folder: RunFolder
    wanted: float
    """In m."""
    risk: float
    tell: Callable[[Sequence[str]], None]
    """Shows lines to the operator; may wait."""
    looks: list[ProductionError] = field(default_factory=list)
    reason: str = ""
    """Why the poses so far are enough; empty: they are not."""
    _poses: dict[int, PoseReadings] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what could never be judged.

        Raises
        ------
        ProcedureError
            If the accuracy or the risk is no such number, there is no process, or too few poses.
        """
        if not 0.0 < self.wanted < np.inf:
            raise ProcedureError(f"--until {self.wanted} m: must be a positive length")
        if not 0.0 < self.risk < 0.5:
            raise ProcedureError(f"--risk {self.risk}: must be between 0 and 0.5")
        if self.cell.process is None:
            raise ProcedureError(NO_PRODUCTION.format(name=self.cell.name))
        if len(self.plan.poses) < FEWEST:
            raise ProcedureError(
                f"--until: the plan has {len(self.plan.poses)} poses, and the error on production"
                f" is estimated from {FEWEST} on: plan more"
            )

    @property
    def level(self) -> float:
        """Level of each look."""
        return level_of_a_look(FEWEST, len(self.plan.poses), self.risk)

    def add(self, log: PoseLog) -> None:
        """Take a pose that an earlier session has committed.

        Raises
        ------
        ElastocalError
            If its streams cannot be read.
        """
        self._poses[log.pose] = procedure.read_pose(self.folder, log, self.cell)

    def __call__(self, log: PoseLog) -> str:
        """Return why the run has enough poses, or nothing."""
        try:
            self.add(log)
        except ElastocalError as error:
            self._say(f"pose {log.pose} cannot be judged: {error}")
            return ""
        return self.look()

    def look(self) -> str:
        """Return why the poses so far are enough, or nothing."""
        self.reason = ""
        if len(self._poses) < FEWEST:
            return ""
        try:
            found = cell_error(self.cell, self._dataset(), self.level)
            covered = present(plan_coverage(self.cell, self._measured()), "coverage")
        except ElastocalError as error:
            # What cannot be judged yet is no fault of the run, which goes on.
            self._say(f"after {len(self._poses)} poses no error can be stated: {error}")
            return ""
        self.looks.append(found)
        self._say(found.sentence())
        if not found.high <= self.wanted:
            return ""
        if not covered.is_enough:
            self._say(covered.sentence())
            return ""
        self.reason = ReachedAccuracy(self.wanted, self.risk, True, (found,)).sentence()
        return self.reason

    def result(self, reached: bool, pool: PoolData | None) -> ReachedAccuracy:
        """Return the looks, and what further poses from the plan's pool would bring."""
        further: tuple[ProductionError, ...] = ()
        places: tuple[Point, ...] = ()
        if self.looks and pool is not None:
            last = self.looks[-1]
            measured, postures = self._measured(), postures_of(pool)
            found = best_additions(self.cell, postures, measured, max(_FURTHER))
            further = tuple(last.after(n, float(found.share[n - 1])) for n in _FURTHER)
            x = postures.contact[found.order[:_PLACES]].tolist()
            places = tuple((a, b, c) for a, b, c in x)
        return ReachedAccuracy(self.wanted, self.risk, reached, tuple(self.looks), further, places)

    def _dataset(self) -> Dataset:
        poses = tuple(self._poses.values())
        return procedure.derive_poses(poses, self.cell, self.plan, (), "").dataset

    def _measured(self) -> FloatArray:
        return np.array([self.plan.poses[pose].joints for pose in self._poses])

    def _say(self, line: str) -> None:
        # A terminal that takes no output must not keep the arm waiting.
        threading.Thread(target=self.tell, args=([line],), daemon=True).start()
