"""The example cell with a plan of a few poses, made once."""

import re
from dataclasses import dataclass
from pathlib import Path

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.planning import make_plan, write_plan


@dataclass(frozen=True)
class PlannedCell:
    """A cell file and the folder of its plan."""

    cell: Path
    plan: Path

    def with_text(self, name: str, text: str) -> "PlannedCell":
        """Return a cell beside this one with a section added; the plan fits it as well."""
        path = self.cell.with_name(name)
        path.write_text(f"{self.cell.read_text(encoding='utf-8')}\n{text}\n", encoding="utf-8")
        return PlannedCell(path, self.plan)


def planned_cell(
    folder: Path, poses: int = 4, example: str = "afp", *changes: tuple[str, str]
) -> PlannedCell:
    """Write an example's cell, its pool and load cases few and its truth kind; plan it.

    Changes of the cell's text are pairs of a pattern and what takes its place.
    """
    cell = write_example(folder / "cell", example)[0]
    text = cell.read_text(encoding="utf-8")
    for pattern, replacement in (
        (r"\n  (d_max|poses): .*", f"\n  poses: {poses}"),
        (r"\n  pool: .*", "\n  pool: 40"),
        (r"\n  preset: .*", "\n  preset: kind"),
        (r"\n  cases: .*(\n  level: .*\n  check: .*)?", "\n  cases: [normal, north]"),
        *changes,
    ):
        text, count = re.subn(pattern, replacement, text)
        assert count == 1, pattern
    cell.write_text(text, encoding="utf-8")
    plan = folder / "plan"
    plan.mkdir()
    write_plan(plan, make_plan(load_cell(cell), None, 1).plan)
    return PlannedCell(cell, plan)
