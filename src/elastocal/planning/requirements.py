"""What a cell must have before any candidate is made: `elastocal check` and `plan` ask the same.

What depends on the pose alone is left to the checks of the pool.
"""

import numpy as np

from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.findings import Finding, Kind
from elastocal.planning.checks import (
    EdgeCheck,
    FlatnessCheck,
    FrictionCheck,
    SensorCheck,
    TorqueCheck,
)
from elastocal.planning.search import technique
from elastocal.planning.surface import Surface, arm_reach, sample_uniform, tiny_finding
from elastocal.robot import has_wrist

_POINTS = 200
"""Points of the surface at which a place for the contact disk is looked for."""


def require_possible_search(cell: Cell, compare: str | None = None) -> None:
    """Require a search that can be made, as far as no pool is needed to tell.

    Parameters
    ----------
    cell : Cell
        The cell.
    compare : str, optional
        Search technique to lay beside the cell's own.

    Raises
    ------
    PlanningError
        If a technique is unknown, or an accuracy is wanted without a process; if the process
        has no force, or fewer candidates are asked for than poses.
    """
    search = cell.file.search
    technique(cell.technique)
    if compare is not None:
        technique(compare)
    if search.accuracy is not None and cell.process is None:
        raise PlanningError(
            "search.accuracy is the error on production: name its path in process.file of the cell"
            " file"
        )
    if cell.process is not None and not np.any(cell.process.force):
        raise PlanningError(
            "process.file: no row has a force, and a process without forces deflects nothing: give"
            " the force on the robot of each row (force_x[N] …), or leave process out"
        )
    wanted = search.pose_limit or 0
    if not search.pool >= wanted:
        raise PlanningError(
            f"search.pool: must be at least the {wanted} poses that are to be chosen (the default"
            f" of search.poses), got {search.pool}"
        )


def require_loads_possible_anywhere(cell: Cell, surface: Surface) -> None:
    """Require load cases that a pose could hold, and a robot whose torques can be judged.

    Parameters
    ----------
    cell, surface : Cell, Surface
        Who presses, and on what.

    Raises
    ------
    PlanningError
        If friction, or the sensor's range, refuses the load cases wherever they are applied; if
        torques are limited and the robot has no masses to tell what gravity takes of them; if
        the contact disk lies whole and flat nowhere on the surface.
    SurfaceError
        If the region holds no part of the surface.
    """
    friction, sensor = FrictionCheck.of(cell, surface), SensorCheck.of(cell, surface)
    if not friction.everywhere > 0.0:
        raise PlanningError(
            f"load_cases: at every pose friction is {-friction.everywhere:.4g} N short of holding"
            f" them (friction fz / safety against the lateral force): {friction.advice}"
        )
    if sensor is not None and not sensor.everywhere > 0.0:
        raise PlanningError(
            "load_cases: at every pose they need"
            f" {1.0 - sensor.everywhere:.3g} times the sensor's range, the tool's weight included:"
            f" {sensor.advice}"
        )
    torque = TorqueCheck.of(cell, surface)
    if torque is not None and not cell.robot.has_masses:
        raise PlanningError(
            f"limits.torque: the torques of {', '.join(torque.judged)} are limited, and what the"
            f" arm's weight takes of them is not known: robot {cell.robot.name!r} has no link"
            " masses; give its links masses in the URDF (<inertial>), or leave the torques out"
            " (effort in the URDF, limits.torque.values)"
        )
    _require_place_for_disk(cell, surface)


def _require_place_for_disk(cell: Cell, surface: Surface) -> None:
    """Require that the whole contact disk lies on the surface, and flat, at one of many points."""
    points = sample_uniform(surface, _POINTS, np.random.default_rng(cell.file.search.seed))
    radius = 1e3 * cell.file.engagement.disk_radius
    for check in (EdgeCheck.of(cell, surface, points), FlatnessCheck.of(cell, surface, points)):
        best = float(check.at_points.max())
        if not best > 0.0:
            short = f"{-1e3 * best:.3g} mm" if check.unit == "m" else f"{-np.degrees(best):.3g} deg"
            doubts = tiny_finding(surface, arm_reach(cell.robot))
            advice = doubts[0] if doubts else check.advice
            raise PlanningError(
                f"engagement: no place of the surface takes the contact disk (radius {radius:.4g}"
                f" mm): of {_POINTS} points the best is {short} short of check {check.name!r};"
                f" {advice}"
            )


TORQUES_UNKNOWN = Kind("plan.torques-unknown", "torques of {joints} are not known and not judged")
NO_WRIST = Kind(
    "plan.no-wrist",
    "limits.wrist_angle is not judged: {name} has no six joints of which the fourth"
    " and the sixth turn",
)


def unjudged_limits(cell: Cell) -> list[Finding]:
    """Return what a limit of the cell file asks for and no check can judge on this robot."""
    known = zip(cell.robot.joint_names, np.isfinite(cell.torque_limits), strict=True)
    unknown = [name for name, is_known in known if not is_known]
    notes = [TORQUES_UNKNOWN(joints=unknown)] if unknown else []
    return notes if has_wrist(cell.robot) else [*notes, NO_WRIST(name=cell.robot.name)]
