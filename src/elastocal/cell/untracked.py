"""A cell whose readings no tracker takes: the tooling holds the tool, and light contact is zero."""

from dataclasses import replace

import numpy as np

from elastocal.cell.cell import Cell
from elastocal.cell.devices import BeamState, PointBlock
from elastocal.cell.procedure import LIGHT_CONTACT

TRACKER = "tracker"
"""The instrument that a plan can do without."""


def without_tracker(cell: Cell) -> Cell:
    """Return a cell without marker and tracker stations.

    Displacements then count from light contact: from off the surface they would hold the way to it,
    which nothing measures.
    """
    procedure = cell.file.procedure.model_copy(update={"reference": LIGHT_CONTACT})
    changes = {"marker": None, "trackers": (), "procedure": procedure}
    return replace(cell, file=cell.file.model_copy(update=changes))


class NoMetrology:
    """What stands in the place of a tracker where there is none: it measures nothing."""

    stations: tuple[str, ...] = ()
    rate: float = 0.0

    def look(self, station: str) -> None:
        """Do nothing: there is no station."""

    def read(self) -> PointBlock:
        """Return an empty block with a broken beam."""
        none = np.empty((0, 3))
        return PointBlock(np.empty(0), none, none, BeamState.BROKEN, "", "no tracker")
