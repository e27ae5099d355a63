"""``plan``: from a cell to an ordered, checked, executable set of poses, with its files."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from elastocal.cell import Cell, load_cell
from elastocal.files import filling
from elastocal.planning import PLAN, PlannedPoses, make_plan, write_plan, write_pool
from elastocal.planning.export import check_name, takes_krl, write_krl, write_table
from elastocal.progress import Progress
from elastocal.report import write_plan_figure, write_plan_page
from elastocal.workflows._workflow import workflow


@dataclass(frozen=True)
class PlanSettings:
    """Which cell to plan, and where the files go."""

    cell: str | PathLike[str]
    """Cell file, ``.yaml``."""
    out: str | PathLike[str]
    """Folder to write the plan into."""
    compare: str | None = None
    """Search technique to lay beside the cell's, or ``none``; by default ``ioops`` beside
    ``cover``, else ``cover``."""
    program: str = "calib"
    """Name of the KRL program."""
    jobs: int | None = None
    """Processes for large pools; by default all cores."""
    force: bool = False
    """Replace the files of a plan that is there."""
