"""The robot catalogue: dimensions, limits and masses of KUKA robots, each with its source.

The table `kuka.yaml` beside this file is the only copy of the numbers; the URDF is made from it
on demand. What has no source says so in `Robot.assumptions`.
"""

from elastocal.robot.catalogue.record import CatalogueEntry
from elastocal.robot.catalogue.table import entries, find
from elastocal.robot.catalogue.writer import urdf_of
from elastocal.robot.robot import Robot


def names() -> tuple[str, ...]:
    """Return the names of all robots, in the order of the table."""
    return tuple(entries())


def entry(name: str) -> CatalogueEntry:
    """Return what is known of a robot, with the sources.

    Parameters
    ----------
    name : str
        For example ``"KR 120 R2700-2"``; case, spaces, hyphens and underscores do not matter.

    Raises
    ------
    RobotError
        If no robot has that name.
    """
    return find(name)


def urdf(name: str) -> str:
    """Return the URDF of a robot; see `elastocal.robot.catalogue.writer`."""
    return urdf_of(find(name))


def load(name: str, tip: str = "flange") -> Robot:
    """Return a robot ready to compute with.

    >>> load("kr 210 r2700-2").joint_names[:2]
    ('joint_a1', 'joint_a2')

    Parameters
    ----------
    name : str
        See `entry`.
    tip : str
        Link to take as the tool centre point; to add a tool, see `elastocal.robot.mounting`.

    Raises
    ------
    RobotError
        If no robot has that name, or it has no such link.
    """
    return Robot.from_urdf(urdf(name), tip)
