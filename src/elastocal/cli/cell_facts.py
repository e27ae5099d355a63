"""What ``elastocal check`` looks at in a cell: all that `elastocal plan` would refuse at once."""

from pathlib import Path
from typing import Any

import numpy as np

from elastocal.cell import load_cell
from elastocal.planning import (
    cell_surface,
    collision_scene,
    require_possible_search,
    surface_findings,
)
from elastocal.planning.motion import mover_for, require_free_home


def cell_facts(path: Path) -> dict[str, Any]:
    """Return what a cell file describes.

    Every mesh is read, the surface is held against the robot's reach, and HOME against the
    solids; no candidate is made.

    Raises
    ------
    ElastocalError
        If the cell cannot be planned for whatever the candidates: its file, a file that it names,
        the search technique, the place of the surface, or a collision at HOME.
    """
    cell = load_cell(path)
    search = cell.file.search
    require_possible_search(cell)
    surface = cell_surface(cell)
    findings = surface_findings(cell, surface, np.random.default_rng(search.seed))
    require_free_home(cell.home, mover_for(cell, collision_scene(cell, surface)))
    return {
        "schema": "elastocal.cell/1",
        "cell": cell.name,
        "robot": cell.robot.name,
        "load_cases": list(cell.file.load_cases.cases),
        "trackers": [tracker.name for tracker in cell.file.trackers],
        "technique": search.technique,
        "faces": len(surface.mesh.faces),
        "findings": [finding.message for finding in findings],
    }
