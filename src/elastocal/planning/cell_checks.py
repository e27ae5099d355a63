"""The registry of checks, and the checks of a cell."""

from elastocal.cell import Cell
from elastocal.planning import checks as exported
from elastocal.planning.checks import Checks, PointCheck, PostureCheck
from elastocal.planning.surface import Surface, SurfacePoints

_EXPORTED = tuple(getattr(exported, name) for name in dir(exported))

CHECKS: tuple[type[PostureCheck], ...] = tuple(
    sorted(
        (each for each in _EXPORTED if PostureCheck in getattr(each, "__mro__", ())[1:]),
        key=lambda each: each.order,
    )
)
"""Every check of postures that `elastocal.planning.checks` exports, in order."""
POINT_CHECKS: tuple[type[PointCheck], ...] = tuple(
    sorted(
        (each for each in _EXPORTED if PointCheck in getattr(each, "__mro__", ())[1:]),
        key=lambda each: each.order,
    )
)
"""Every check that a sampled point decides alone, in order."""


def point_checks(cell: Cell, surface: Surface, points: SurfacePoints) -> tuple[PointCheck, ...]:
    """Return the checks that sampled points decide alone.

    Parameters
    ----------
    cell : Cell
        The cell.
    surface : Surface
        What the robot presses on.
    points : SurfacePoints
        The sampled points that postures refer to.
    """
    return tuple(kind.of(cell, surface, points) for kind in POINT_CHECKS)


def robot_checks(cell: Cell, surface: Surface) -> Checks:
    """Return the checks that postures decide, of all `CHECKS` that the cell has numbers for."""
    made = [check for kind in CHECKS if (check := kind.of(cell, surface)) is not None]
    quick = tuple(check for check in made if not check.slow)
    return Checks((), quick, tuple(check for check in made if check.slow))
