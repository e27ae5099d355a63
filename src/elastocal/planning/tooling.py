"""The surface of a cell, and what is odd about it."""

import numpy as np
from numpy.random import Generator

from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning.surface import (
    Finding,
    ReachableFrom,
    Surface,
    arm_reach,
    arm_stands,
    flipped,
    load_surface,
    mesh_findings,
    placement_findings,
)
from elastocal.robot.inverse import inverse_for


def cell_surface(cell: Cell) -> Surface:
    """Return the surface that the cell file names, in base, its normals as it says.

    Raises
    ------
    SurfaceError, FileAccessError
        If the mesh cannot be read.
    """
    entry = cell.file.surface
    surface = load_surface(
        cell.surface_path, entry.metres, cell.T_base_surface, entry.region, entry.crease_angle
    )
    return flipped(surface) if entry.flip_normals else surface


def surface_findings(cell: Cell, surface: Surface, rng: Generator) -> tuple[Finding, ...]:
    """Return what a user should know of the mesh and of where it stands.

    Parameters
    ----------
    cell : Cell
        The cell.
    surface : Surface
        Its surface.
    rng : Generator
        Seeded source of randomness, for the points that are tried.

    Raises
    ------
    PlanningError
        If planning on this surface cannot lead anywhere.
    SurfaceError
        If the region holds no part of the surface.
    """
    external = cell.external_positions
    # The middle and the ends of a grid will do to see from which side the robot can work.
    few = external[np.unique(np.linspace(0, len(external) - 1, 3).astype(int))]
    found = mesh_findings(surface) + placement_findings(
        surface,
        arm_stands(cell.robot, external),
        arm_reach(cell.robot),
        ReachableFrom(inverse_for(cell.robot), few),
        rng,
    )
    for finding in found:
        if finding.fatal:
            raise PlanningError(finding.message)
    return found
