"""Whether a cell is the one that a plan was made for."""

from elastocal.cell import Cell
from elastocal.errors import PlanningError
from elastocal.planning import PlanResult


def check_robot(plan: PlanResult, cell: Cell) -> None:
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
