"""Whether what is to be drawn together belongs together."""

import numpy as np

from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning.plan_file import PlanFile
from elastocal.planning.pool_file import PoolData


def check_belongs(plan: PlanFile, pool: PoolData) -> None:
    """Refuse a pool that is not the one the plan was chosen from.

    Raises
    ------
    PlanningError
        If the plan has no pose, or a pose is not that candidate of the pool.
    """
    if not plan.poses:
        raise PlanningError(f"the plan of cell {plan.cell.name!r} has no poses to show")
    size = len(pool.contact)
    others = plan.comparison.candidates if plan.comparison else ()
    for number in (*(pose.candidate for pose in plan.poses), *others):
        if not 0 <= number < size:
            raise PlanningError(
                f"the plan names candidate {number}, the pool has {size}: they are not of one run"
            )
    for pose in plan.poses:
        if not np.allclose(pool.contact[pose.candidate], pose.tcp_position, rtol=0.0, atol=1e-6):
            raise PlanningError(
                f"pose {pose.id} of the plan is not where candidate {pose.candidate} of the pool"
                " is: they are not of one run"
            )


def check_robot(plan: PlanFile, cell: Cell) -> None:
    """Refuse a cell whose robot has other joints than the plan's.

    Raises
    ------
    PlanningError
        By the names of the joints.
    """
    if plan.robot.joints != cell.robot.joint_names:
        raise PlanningError(
            f"the plan is for joints {', '.join(plan.robot.joints)}; the robot of cell"
            f" {cell.name!r} has {', '.join(cell.robot.joint_names)}"
        )
