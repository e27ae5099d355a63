"""The files of a plan."""

from pathlib import Path

from elastocal.cell import Cell
from elastocal.planning import PlanAndPool, write_plan, write_pool
from elastocal.planning.export import takes_krl, write_krl, write_table
from elastocal.report import write_plan_figure, write_plan_page


def write_plan_folder(folder: Path, cell: Cell, planned: PlanAndPool, program: str) -> list[str]:
    """Write every file of a plan; return their names.

    Parameters
    ----------
    folder : Path
        An empty folder.
    cell : Cell
        That the plan was made for.
    planned : PlanAndPool
        Plan, pool and surface.
    program : str
        Name of the KRL program; none is written for an arm whose axes KRL cannot name.

    Raises
    ------
    PlanningError
        If the program's name is none that a KUKA controller takes.
    FileAccessError
        If a file cannot be written.
    """
    plan, pool, surface = planned.plan, planned.pool, planned.surface
    paths = [
        write_plan(folder, plan),
        write_pool(folder, pool),
        write_table(folder, plan),
        *(write_krl(folder, plan, program) if takes_krl(cell.robot) else ()),
        write_plan_page(folder / "plan.html", cell, surface, plan, pool),
        write_plan_figure(folder / "plan.svg", surface, plan, pool),
    ]
    return [path.name for path in paths]
