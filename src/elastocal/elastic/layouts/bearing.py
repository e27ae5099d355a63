"""Layout ``bearing``: the axial springs and two springs orthogonal to each joint axis."""

from elastocal.elastic.layouts.actuated import actuated
from elastocal.elastic.springs import Spring, orthogonal_axes
from elastocal.robot import Robot


def bearing(robot: Robot, distal: bool = False) -> tuple[Spring, ...]:
    """Return the paper's lumped kinetostatic model (section 4.1; 18 springs on a 6R arm).

    Order: all axial springs, then the virtual ones joint by joint, the paper's
    ``[c_a; c_v]`` of Eq. 11.

    Parameters
    ----------
    robot : Robot
        The robot.
    distal : bool
        Put the virtual springs behind each joint's motion instead of in the bearing housing.
    """
    virtual = (
        Spring(f"{joint.name}.{name}", joint.name, axis, distal=distal)
        for joint in robot.chain.joints
        for name, axis in orthogonal_axes(joint.axis).items()
    )
    return (*actuated(robot), *virtual)
