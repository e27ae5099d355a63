"""The parts that a run folder holds: cell, plan, pool, journal, dataset, summary."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from elastocal import dataset as datasets
from elastocal.cell import Cell, load_cell
from elastocal.files import read_text
from elastocal.planning import (
    PLAN,
    POOL,
    PlanResult,
    PoolData,
    cell_surface,
    check_pool_of,
    read_plan,
    read_pool,
)
from elastocal.procedure import Entry, RunFolder, check_plan, read_journal, read_summary
from elastocal.report.belongs import check_robot
from elastocal.report.document.parts import Absence, Parts
from elastocal.report.document.places import run_files
from elastocal.report.document.searching import Part, Search
from elastocal.report.document.shapes import checked_summary


def with_run(parts: Parts, search: Search) -> Parts:
    """Return the parts with what a run folder holds.

    Parameters
    ----------
    parts : Parts
        Without them.
    search : Search
        Where to look; notes what was used and what could not be.
    """
    run = search.places.run
    if run is None:
        reason = "no folder of a run was given: nothing is known of how the readings came about"
        search.absent.append(Absence("run", reason))
        return parts
    journal = search.read("journal", run.journal, lambda: read_journal(run.journal), named=False)
    cell = _cell(search, run, journal)
    parts = replace(parts, journal=journal, cell=cell)
    if cell is not None:
        surface = search.read("surface", cell.path, lambda: cell_surface(cell), named=False)
        parts = replace(parts, surface=surface, cell_text=read_text(cell.path))
    parts = _with_plan(parts, search, run, journal)
    summary = _derived(
        search,
        "summary of the run",
        run.summary,
        lambda path: checked_summary(read_summary(path), str(path)),
    )
    parts = replace(parts, dataset=_derived(search, "dataset", run.dataset, datasets.read))
    for file in run_files(run):
        search.use(file)
    return replace(parts, summary=summary)


def _cell(search: Search, run: RunFolder, journal: tuple[Entry, ...] | None) -> Cell | None:
    record = journal[0].run if journal else None
    path = run.cell / (record.cell_file if record else "cell.yaml")
    return search.read("cell", path, lambda: load_cell(path), named=False)


def _with_plan(
    parts: Parts, search: Search, run: RunFolder, journal: tuple[Entry, ...] | None
) -> Parts:
    cell, record = parts.cell, journal[0].run if journal else None

    def plan_of_cell() -> PlanResult:
        plan = read_plan(run.plan)
        if record is not None:
            check_plan(run, record)
        if cell is not None:
            check_robot(plan, cell)
        return plan

    plan = search.read("plan", run.plan / PLAN, plan_of_cell, named=False)
    if plan is None:
        return parts

    def pool_of_plan() -> PoolData:
        pool = read_pool(run.plan)
        check_pool_of(plan, pool)
        return pool

    pool = search.read("pool", run.plan / POOL, pool_of_plan, named=False)
    return replace(parts, plan=plan, pool=pool)


def _derived(search: Search, name: str, path: Path, read: Callable[[Path], Part]) -> Part | None:
    if not path.is_file():
        reason = f"there is no {search.places.shown(path)}; `elastocal derive` makes it"
        search.absent.append(Absence(name, reason))
        return None
    return search.read(name, path, lambda: read(path), named=False)
