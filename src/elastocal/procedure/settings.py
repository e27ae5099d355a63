"""What the runner needs to know of a cell and its plan."""

from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.cell.description import ProcedureSettings
from elastocal.errors import ProcedureError
from elastocal.planning import PlanResult
from elastocal.planning.motion import AxisMotion
from elastocal.robot import GRAVITY

LIMIT_PER_LOAD = 1.3
"""Default force limit, as a multiple of the largest load case."""


@dataclass(frozen=True, eq=False)
class Settings:
    """Figures of one run."""

    procedure: ProcedureSettings
    override: float
    """Part of the axis speeds that is used between poses."""
    axes: AxisMotion
    """For estimates of time."""
    R_tcp_sensor: FloatArray
    """Axes of the force sensor in the tcp frame, shape (3, 3)."""
    force_limit: float
    """Largest force that is let happen, in N."""
    tool_weight: float
    """In N."""
    near_contact: float
    """Distance from the surface at the unloaded reference, in m."""
    approach_distance: float
    """Distance from the surface at the approach pose, in m."""
    loads: tuple[tuple[str, FloatArray], ...]
    """Name of each load case and force on the robot in the tcp frame, shape (3,), in N."""

    @property
    def largest_load(self) -> float:
        """Norm of the largest load case, in N."""
        return max(float(np.linalg.norm(force)) for _, force in self.loads)


def settings_of(cell: Cell, plan: PlanResult) -> Settings:
    """Return the settings of a run.

    Parameters
    ----------
    cell : Cell
        The cell.
    plan : PlanResult
        Its plan.

    Raises
    ------
    ProcedureError
        If the cell has no force sensor or no tracker, the force limit leaves no room between the
        largest load case and the range of the sensor, or the contact force is not below every
        load case (and with it below the force limit).
    """
    T_sensor_tcp = cell.T_sensor_tcp
    if T_sensor_tcp is None:
        raise ProcedureError(f"{cell.path}: sensor is missing: a run measures the force")
    unseen = [pose.id for pose in plan.poses if pose.seen_by is None]
    if unseen:
        raise ProcedureError(
            f"{cell.path}: pose {unseen[0]} is seen by no tracker: a run measures the marker"
        )
    loads = tuple((name, np.array(force)) for name, force in plan.contact.load_cases.items())
    _check_contact_force(cell, loads)
    motion = cell.file.motion
    return Settings(
        procedure=cell.file.procedure,
        override=motion.override,
        axes=AxisMotion(cell.axis_speeds, motion.acceleration_time),
        R_tcp_sensor=T_sensor_tcp[:3, :3].T,
        force_limit=_force_limit(cell, loads, T_sensor_tcp[:3, :3]),
        tool_weight=cell.file.tool.mass * float(np.linalg.norm(GRAVITY)),
        near_contact=plan.contact.near_contact,
        approach_distance=plan.contact.approach_distance,
        loads=loads,
    )


def _check_contact_force(cell: Cell, loads: tuple[tuple[str, FloatArray], ...]) -> None:
    """Refuse a guarded approach that would press more than a load case does."""
    name, least = min(((name, -float(f[2])) for name, f in loads), key=lambda load: load[1])
    contact_force = cell.file.procedure.contact_force
    if not contact_force < least:
        raise ProcedureError(
            f"{cell.path}: procedure.contact_force must be below {least:g} N (load case {name!r}"
            f" along the normal), got {contact_force:g} N"
        )


def _force_limit(
    cell: Cell, loads: tuple[tuple[str, FloatArray], ...], R_sensor_tcp: FloatArray
) -> float:
    """Return the force limit; it stays within the sensor's range in the direction of each load."""
    sensor, asked = cell.file.sensor, cell.file.procedure.force_limit
    assert sensor is not None
    norms = [float(np.linalg.norm(force)) for _, force in loads]
    largest = max(norms)
    within = min(
        norm / float(np.max(np.abs(R_sensor_tcp @ force) / sensor.largest_force))
        for norm, (_, force) in zip(norms, loads, strict=True)
    )
    limit = min(LIMIT_PER_LOAD * largest, within) if asked is None else asked
    room = largest + cell.file.procedure.force_tolerance
    if not room < limit <= within:
        raise ProcedureError(
            f"{cell.path}: procedure.force_limit must be above {room:g} N (largest load case and"
            f" force_tolerance) and at most {within:g} N (range of the sensor), got {limit:g} N"
        )
    return limit
