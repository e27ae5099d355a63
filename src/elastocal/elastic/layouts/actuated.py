"""Layout ``actuated``: one spring about each joint axis."""

from elastocal.elastic.springs import Spring, axial
from elastocal.robot import Robot


def actuated(robot: Robot) -> tuple[Spring, ...]:
    """Return one axial spring per joint (6 on a 6R arm; the model of paper section 4.2.4)."""
    return tuple(axial(joint) for joint in robot.chain.joints)
