"""Which robot a command works with: a URDF file, a catalogue name, or what the dataset says."""

from pathlib import Path

from elastocal.dataset import Dataset
from elastocal.errors import RobotError
from elastocal.files import read_text
from elastocal.robot import Robot, catalogue, leaf_links, parse_urdf, with_tool
from elastocal.workflows._postures import parse_frame

TOOL_LINK = "tcp"
"""Name of the link that a tool given by numbers gets."""


def find_robot(
    robot: str | None, tcp: str | None, tool: str | None, dataset: Dataset | None = None
) -> Robot:
    """Return the robot that a user means.

    Parameters
    ----------
    robot : str or None
        A URDF file, a catalogue name, or None for the dataset's own.
    tcp : str or None
        Link at the tool centre point; by default the dataset's, or the robot's only leaf link.
    tool : str or None
        Pose of the tcp behind that link, ``"x, y, z, a, b, c"`` with units (KUKA Z-Y'-X'').
    dataset : Dataset, optional
        A dataset that may name both.

    Raises
    ------
    RobotError
        If there is no robot, or no way to tell its tool centre point.
    """
    own = dataset is not None and robot is None
    urdf = _urdf_of(robot, dataset)
    tcp = tcp or (dataset.tcp_frame if own and dataset is not None else None)
    if tcp is None:
        leaves = leaf_links(parse_urdf(urdf))
        if len(leaves) != 1:
            raise RobotError(f"name the tool centre point with --tcp: {', '.join(leaves)}")
        tcp = leaves[0]
    if tool is not None:
        urdf = with_tool(urdf, tcp, TOOL_LINK, parse_frame(tool, "tool", error=RobotError))
        tcp = TOOL_LINK
    return Robot.from_urdf(urdf, tcp)


def _urdf_of(robot: str | None, dataset: Dataset | None) -> str:
    if robot is None:
        if dataset is None or not dataset.robot_urdf:
            raise RobotError(
                "the dataset names no robot: give --robot with a URDF file or a catalogue name"
                " (see `elastocal robots`)"
            )
        return dataset.robot_urdf
    path = Path(robot)
    if path.suffix.lower() in (".urdf", ".xml") or _is_file(path):
        return read_text(path)
    return catalogue.urdf(robot)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:
        return False
